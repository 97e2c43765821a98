/* SPDX-License-Identifier: MIT */
/*
 * virtual_time: the participants of virtual time, and which of them computes next: conservative co-simulation. Used by
 * sim/hub/hub. No I/O; the functions change struct virtual_time only. One thread.
 *
 * A participant is active from its grant to its next wait; time does not advance in between. If none is active, the
 * next grant goes to one that is due or was woken; of several, in the order of their names, and with equal names in the
 * order of their joining. If none is due, time advances to the next instant at which one is due, or at which another
 * event happens.
 */
#ifndef HUB_VIRTUAL_TIME_H
#define HUB_VIRTUAL_TIME_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "port/linux/local_bus.h"

#define VIRTUAL_TIME_PARTICIPANTS 32u

/* The start: 2000-01-01 in nanoseconds since 1970, so that recordings have a date that their formats can hold. */
#define VIRTUAL_TIME_BEGIN_NS 946684800000000000u

struct participant {
    uint32_t number; /* 0: none */
    char name[LOCAL_BUS_NAME];
    bool active;
    bool woken;
    bool frames; /* frames have come since its last grant */
    bool suspended;
    bool all; /* frames that it defers wake it as well */
    bool wants_notices;
    uint64_t until_ns;
    uint32_t grant; /* number of the last one */
};

struct virtual_time {
    struct participant participants[VIRTUAL_TIME_PARTICIPANTS]; /* in the order of their grants */
    size_t count;
    uint64_t now_ns;
    uint32_t last_number;
};

void virtual_time_init(struct virtual_time *time);

/* A new participant, active. Its number; 0 when there is no room. */
uint32_t virtual_time_join(struct virtual_time *time, const char *name, bool wants_notices);

void virtual_time_leave(struct virtual_time *time, uint32_t number);

/* The participant of this number or name; NULL: there is none. */
struct participant *virtual_time_find(struct virtual_time *time, uint32_t number);
struct participant *virtual_time_named(struct virtual_time *time, const char *name);

/* The participant waits; `all`: frames that it defers wake it as well. A wait with the number of an older grant is out
 * of date and changes nothing. A second one for the same grant ends the wait before its time: true. */
bool virtual_time_wait(struct virtual_time *time, uint32_t number, uint32_t grant,
                       uint64_t until_ns, bool all);

/* Makes a participant due now; an active one will be due as soon as it waits. Without effect if there is none of this
 * number. */
void virtual_time_wake(struct virtual_time *time, uint32_t number);

/* As virtual_time_wake, but only if it waits for all frames. */
void virtual_time_wake_for_all(struct virtual_time *time, uint32_t number);

/* A frame has come for it: its next grant has LOCAL_BUS_FRAMES. */
void virtual_time_note_frame(struct virtual_time *time, uint32_t number);

bool virtual_time_is_held(const struct virtual_time *time); /* a participant is active */

/* Makes the next participant that is due now active; NULL: none is due. Only if none is active. */
struct participant *virtual_time_grant(struct virtual_time *time);

/* When the next participant is due; LOCAL_BUS_NEVER: none will be. */
uint64_t virtual_time_next_ns(const struct virtual_time *time);

#endif
