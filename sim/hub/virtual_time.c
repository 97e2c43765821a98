/* SPDX-License-Identifier: MIT */
/* Implements hub/virtual_time.h (see there): the participants of virtual time, and which of them computes next. Used
 * by sim/hub/hub. No I/O; the functions change struct virtual_time only. One thread. */
#define _GNU_SOURCE
#include "hub/virtual_time.h"

#include <string.h>

void virtual_time_init(struct virtual_time *time)
{
    memset(time, 0, sizeof *time);
    time->now_ns = VIRTUAL_TIME_BEGIN_NS;
}

uint32_t virtual_time_join(struct virtual_time *time, const char *name, bool wants_notices)
{
    if (time->count == VIRTUAL_TIME_PARTICIPANTS) {
        return 0;
    }
    size_t at = time->count;
    while (at > 0u && strncmp(time->participants[at - 1u].name, name, LOCAL_BUS_NAME - 1u) > 0) {
        time->participants[at] = time->participants[at - 1u];
        at--;
    }
    struct participant *fresh = &time->participants[at];
    memset(fresh, 0, sizeof *fresh);
    memcpy(fresh->name, name, strnlen(name, LOCAL_BUS_NAME - 1u));
    fresh->number = ++time->last_number;
    fresh->active = true;
    fresh->wants_notices = wants_notices;
    time->count++;
    return fresh->number;
}

struct participant *virtual_time_find(struct virtual_time *time, uint32_t number)
{
    for (size_t i = 0; i < time->count && number != 0u; ++i) {
        if (time->participants[i].number == number) {
            return &time->participants[i];
        }
    }
    return NULL;
}

struct participant *virtual_time_named(struct virtual_time *time, const char *name)
{
    for (size_t i = 0; i < time->count; ++i) {
        if (strncmp(time->participants[i].name, name, LOCAL_BUS_NAME - 1u) == 0) {
            return &time->participants[i];
        }
    }
    return NULL;
}

void virtual_time_leave(struct virtual_time *time, uint32_t number)
{
    struct participant *gone = virtual_time_find(time, number);
    if (gone != NULL) {
        const size_t at = (size_t)(gone - time->participants);
        memmove(gone, gone + 1, (time->count - at - 1u) * sizeof *gone);
        time->count--;
    }
}

bool virtual_time_wait(struct virtual_time *time, uint32_t number, uint32_t grant,
                       uint64_t until_ns, bool all)
{
    struct participant *waits = virtual_time_find(time, number);
    if (waits == NULL || grant != waits->grant) {
        return false;
    }
    const bool again = !waits->active;
    waits->active = false;
    waits->until_ns = until_ns;
    waits->all = all;
    return again;
}

void virtual_time_wake(struct virtual_time *time, uint32_t number)
{
    struct participant *waits = virtual_time_find(time, number);
    if (waits != NULL) {
        waits->woken = true;
    }
}

void virtual_time_wake_for_all(struct virtual_time *time, uint32_t number)
{
    struct participant *waits = virtual_time_find(time, number);
    if (waits != NULL && waits->all) {
        waits->woken = true;
    }
}

void virtual_time_note_frame(struct virtual_time *time, uint32_t number)
{
    struct participant *to = virtual_time_find(time, number);
    if (to != NULL) {
        to->frames = true;
    }
}

bool virtual_time_is_held(const struct virtual_time *time)
{
    for (size_t i = 0; i < time->count; ++i) {
        if (time->participants[i].active) {
            return true;
        }
    }
    return false;
}

struct participant *virtual_time_grant(struct virtual_time *time)
{
    for (size_t i = 0; i < time->count; ++i) {
        struct participant *next = &time->participants[i];
        if (!next->suspended && (next->woken || next->until_ns <= time->now_ns)) {
            next->woken = false;
            next->active = true;
            next->grant++;
            return next;
        }
    }
    return NULL;
}

uint64_t virtual_time_next_ns(const struct virtual_time *time)
{
    uint64_t next_ns = LOCAL_BUS_NEVER;
    for (size_t i = 0; i < time->count; ++i) {
        const struct participant *each = &time->participants[i];
        if (!each->suspended && each->until_ns < next_ns) {
            next_ns = each->until_ns;
        }
    }
    return next_ns;
}
