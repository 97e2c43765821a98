/* SPDX-License-Identifier: MIT */
/*
 * feed_override: which point of the path the next tick gets, by the feed plan of the program and the commands: feed
 * hold, resume, override 0 to 200 %, stop and fault stop, and a start from rest anywhere in the program. The tool never
 * leaves the curve. Called by firmware/app, sim/offline and host tools. Changes only its struct and the interpolator
 * that it is given; no I/O.
 *
 * Override and resume change the override (core/override_plan) along jerk-limited ramps inside the override bounds of
 * every feed piece that they touch. Hold, stop and fault stop leave the nominal motion: they are path stops
 * (core/path_brake) from the speed and acceleration of the last setpoint, with the stop parameters of the piece. Where
 * a path stop may not begin, the nominal motion continues for another tick. If the program would end before a path stop
 * would, it ends without one. So at an override of 100 % a stop takes at most the bound of the piece in which it was
 * requested. docs/reference/protocol.md 1.4 has the exceptions: a lower override, a rising override, the end of the
 * program. A hold or stop that is requested while the override rises first ends the rise. If the motion enters another
 * piece before that, the bound of that piece counts from the tick in which the motion enters it.
 *
 * At standstill of a hold the program time of the place is searched, one step in each tick, to 2^-42 s. A resume
 * continues from there.
 *
 * In a job in chunks (core/chunk.h) feed_override_take_over replaces the program under way by the next one. At the end
 * of a tail the motion rests and waits for the takeover. Its state is still running, held or stopped.
 *
 * Integers only, the same on every target. One owner: no tick may run while the main loop calls a command.
 */
#ifndef HODOGRAPH_CORE_FEED_OVERRIDE_H
#define HODOGRAPH_CORE_FEED_OVERRIDE_H

#include <stdint.h>

#include "core/chunk.h"
#include "core/interpolator.h"
#include "core/override_plan.h"
#include "core/path_brake.h"
#include "core/program_clock.h"

enum feed_state {
    FEED_RUNNING = 0,  /* at the override, or on a ramp to it; also with an override of 0 */
    FEED_STOPPING = 1, /* brakes to standstill, final */
    FEED_STOPPED = 2,  /* at standstill before the end */
    FEED_ENDED = 3,    /* the last setpoint was the exact end point */
    FEED_HOLDING = 4,  /* brakes to standstill until resumed */
    FEED_HELD = 5,     /* at standstill until resumed */
};

/* Contents private: use the functions. */
struct feed_override {
    struct program_clock clock;
    struct override_plan plan;
    struct path_brake brake;
    struct path_brake_numbers numbers; /* of the requested stop, in this piece: */
    uint32_t numbers_piece;
    uint32_t numbers_kind; /* enum program_stop_kind; NO_NUMBERS: none, or no stop begins here */
    struct interpolator_search place; /* of rest */
    struct interpolator_point point;  /* of the last setpoint */
    uint32_t state;                   /* enum feed_state, */
    uint32_t at_end;                  /* and the state that follows at the end of the program */
    uint32_t phase;                   /* where setpoints come from */
    uint32_t kind;                    /* enum program_stop_kind of the requested stop */
    uint32_t replace; /* 1: a fault stop, whose parameters `brake` does not have yet */
    uint32_t found;   /* 1: `place` has been found */
    uint32_t goes_on; /* 1: the job continues after the end of the program */
    int64_t left_q30; /* ticks at override 1 until the deadline */
};

/* For a checked program with coefficient records, at rest at a program time (0: its start; else program_time_at_q42 of
 * core/program_time.h, which the shared library does not export), running, override 100 %. period_us: 1000, 2000, 4000
 * or 8000. Reads all pieces: main loop only. The program must not change. */
void feed_override_begin(struct feed_override *f, const struct program *p, uint32_t period_us,
                         uint64_t time_q42_s);

/* The same for the first chunk of a job, from its start, with these records, which have its first piece and segment
 * (interpolator_begin_window). The override stays at or below 100 % until the last chunk. */
void feed_override_begin_job(struct feed_override *f, const struct chunk *first,
                             const struct coefficients_window *window, uint32_t period_us);

/* --- The records near the motion (core/coefficient_cache.h), main loop with the tick held off --- */

/* Where the motion needs records: of this piece and this segment, and of those that follow. */
struct feed_place {
    uint32_t piece;
    uint32_t segment;
    int64_t arc_length_q40_mm;
    /* 1: the piece is to be searched by arc length, from this one on */
    uint32_t by_arc;
};

void feed_override_place(const struct feed_override *f, const struct interpolator *it,
                         struct feed_place *place);

/* Changes to these records of the program under way. 1, or 0: they lack what the next tick needs, and nothing has
 * changed. After 1 the previous records are free. Constant time. */
int feed_override_use(struct feed_override *f, struct interpolator *it,
                      const struct coefficients_window *window);

/* 1: the motion has passed half of the records of the window, and the program continues beyond the window. Main loop or
 * tick. */
static inline int feed_override_wants_records(const struct feed_override *f,
                                              const struct interpolator *it)
{
    const struct coefficients_window *w = &it->window;
    const struct program_header *h = &it->program->header;
    return (f->clock.piece >= w->first_piece + w->piece_count / 2u &&
            w->first_piece + w->piece_count < h->piece_count) ||
           (it->segment->number >= w->first_segment + (w->segment_count + 1u) / 2u &&
            w->first_segment + w->segment_count < h->segment_count);
}

/* 1: feed_override_take_over can take the next chunk now, with records of it for this place. */
int feed_override_may_take_over(const struct feed_override *f, const struct interpolator *it,
                                const struct chunk *next, struct feed_place *place);

/* Takes over: from the next tick on the motion follows the next chunk, which chunk_check has accepted after the one
 * under way. `window` has records of it for the same kernel.
 *   in motion                 Accepted if all setpoints up to the joint are those of the program under way, bit for
 *                             bit. So refused during a path stop, after the joint, and while the override is constant
 *                             but not yet at its command. On a ramp: refused while the next ramp is searched, above
 *                             the guaranteed override, and if the ramp may end after the joint.
 *   at standstill             (held, or at the end of the tail) The motion continues from the same arc length, with the
 *                             override from 0, when it is running and the place is found.
 *   a chunk beginning at rest At the end of its predecessor, while running. The next tick gives its first setpoint.
 * Returns 1, or 0: not now, or not with these records, and nothing has changed; try again after the next tick. After 1
 * the previous program and its records are free. Constant time. */
int feed_override_take_over(struct feed_override *f, struct interpolator *it,
                            const struct chunk *next, const struct coefficients_window *window);

/* --- Commands: take effect from the next tick. Any sequence is allowed. Constant time. --- */

/* Feed hold: brakes to standstill until resumed. Without effect when stopping, stopped or ended. */
void feed_override_hold(struct feed_override *f);

/* Resumes: back to the override; a path stop under way ends at standstill first. Without effect when not holding or
 * held. */
void feed_override_resume(struct feed_override *f);

/* The commanded override, in per cent; more than 200 counts as 200. Kept while held. */
void feed_override_set(struct feed_override *f, uint32_t percent);

/* Controlled stop inside the program's limits: final. A program that ends before the stop does so. */
void feed_override_stop(struct feed_override *f);

/* The same inside the machine's limits; it also replaces the path stop of a hold or a stop at once. */
void feed_override_fault_stop(struct feed_override *f);

/* --- Tick --- */

/* The next setpoint; *it is an interpolator of the same program that is used by this motion only. After the end, or at
 * standstill, the same point again. Returns 0 or a negative INTERPOLATOR_ERR_..., then *out is unchanged. Bounded time,
 * tick context. */
int feed_override_next(struct feed_override *f, struct interpolator *it,
                       struct interpolator_point *out);

/* Part of feed_override_next: a tick with a stop under way, or at standstill. A function of its own, so that the
 * worst-case path of a tick without a stop can be counted. */
int feed_override_stop_tick(struct feed_override *f, struct interpolator *it);

/* Part of a tick of a stop: speed and acceleration of the nominal motion at the last setpoint; *turned_q56 is the part
 * of the acceleration that the change of the override makes. Returns 1, or 0 if the feed is above all from which a path
 * stop can begin. */
int feed_override_motion(const struct feed_override *f, const struct interpolator *it,
                         struct path_state *state, int64_t *turned_q56);

/* --- State at the last setpoint. Any context, with the tick held off. --- */

enum feed_state feed_override_state(const struct feed_override *f);

/* 1 while a hold or a stop is under way that has taken longer than its stop deadline. */
int feed_override_late(const struct feed_override *f);

/* Program time in 2^-42 s, rounded to nearest. From the first tick of a path stop until the place of standstill is
 * found it is that of the last setpoint before the path stop. */
uint64_t feed_override_time_q42(const struct feed_override *f);

/* The longest time, in us, of a stop that is requested now: the stop time bound of the stop table. If the program ends
 * within twice that time, it is the time to the end, since a path stop may not fit before it. */
uint32_t feed_override_bound_us(const struct feed_override *f, enum program_stop_kind kind);

/* Feed along the path, 2^-32 mm/s. */
int64_t feed_override_feed_q32(const struct feed_override *f);

/* The present override, 2^30 = 1; 0 in a path stop and at standstill. */
uint32_t feed_override_actual_q30(const struct feed_override *f);

/* 1 at the end of a tail, running or held, until the next chunk is taken over. */
int feed_override_waits(const struct feed_override *f);

/* 1 while the override stays below its command, because the pieces here allow no more. */
int feed_override_saturated(const struct feed_override *f);

#endif
