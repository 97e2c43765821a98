/* SPDX-License-Identifier: MIT */
/*
 * The feed override: which point of the path the next tick gets, by the feed plan of the program and the commands: feed
 * hold, resume, override 0 to 200 %, stop and fault stop, and a start from rest anywhere in the program. The tool never
 * leaves the curve.
 *
 * Override and resume change the override (core/override_plan) along jerk-limited ramps inside the override bounds of
 * every feed piece that they touch. Hold, stop and fault stop leave the nominal motion: they are path stops
 * (core/path_brake) from the speed and acceleration of the last setpoint, with the stop parameters of the piece. Where
 * a path stop may not begin, the nominal motion continues for another tick. If the program would end before a path stop
 * would, it ends without one. So a stop takes at most the bound of the piece in which it was requested
 * (docs/reference/protocol.md 1.4). A hold or stop that is requested while the override rises first ends the rise. If
 * the program is in another piece by then, the bound of that piece counts from that instant.
 *
 * At standstill of a hold the program time of the place is searched, a step in each tick; a resume goes on from there.
 * It is found to 2^-42 s of program time.
 *
 * In a job in chunks (core/chunk.h) feed_override_take_over replaces the program under way by the next one. At the end
 * of a tail the motion rests and waits for the takeover. Its state is still running, held or stopped.
 *
 * Integers only, the same on every target. One owner: no tick may run while a command is called from elsewhere.
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
    FEED_RUNNING = 0,  /* at the override, or on the way to it; also with an override of 0 */
    FEED_STOPPING = 1, /* comes to rest, for good */
    FEED_STOPPED = 2,  /* at rest before the end */
    FEED_ENDED = 3,    /* the last setpoint was the exact end point */
    FEED_HOLDING = 4,  /* comes to rest until resumed */
    FEED_HELD = 5,     /* at rest until resumed */
};

/* Contents private: use the functions. */
struct feed_override {
    struct program_clock clock;
    struct override_plan plan;
    struct path_brake brake;
    struct path_brake_numbers numbers; /* of the requested stop, in this piece: */
    uint32_t numbers_piece;
    uint32_t numbers_kind; /* enum program_stop_kind; NO_NUMBERS: none, or the piece has no brake */
    struct interpolator_search place; /* of rest */
    struct interpolator_point point;  /* of the last setpoint */
    uint32_t state;   /* enum feed_state: what is wanted, and whether it is reached, */
    uint32_t at_end;  /* and what it becomes at the end of the program */
    uint32_t phase;   /* where setpoints come from */
    uint32_t kind;    /* enum program_stop_kind of the requested stop */
    uint32_t replace; /* 1: a fault stop, whose numbers the brake has not got yet */
    uint32_t found;   /* 1: `place` is */
    uint32_t goes_on; /* 1: the job goes on behind the end of the program */
    int64_t left_q30; /* ticks at override 1 until the deadline */
};

/* For a checked program with coefficient records, at rest at a program time (0: its start; else program_time_at_q42),
 * running, override 100 %. period_us: 1000, 2000, 4000 or 8000. Reads all pieces: main loop only. The program must stay
 * as it is. */
void feed_override_begin(struct feed_override *f, const struct program *p, uint32_t period_us,
                         uint64_t time_q42_s);

/* The same for the first chunk of a job, from its start, with these records, which have its first piece and segment
 * (interpolator_begin_window). The override stays at or below 100 % until the last chunk. */
void feed_override_begin_job(struct feed_override *f, const struct chunk *first,
                             const struct coefficients_window *window, uint32_t period_us);

/* --- The records near the motion (core/coefficient_cache.h), main loop with the tick held off --- */

/* Where the motion needs records: in this piece and this segment, and in what comes behind them. */
struct feed_place {
    uint32_t piece;
    uint32_t segment;
    int64_t arc_length_q40_mm;
    /* 1: the piece is to be looked for from this one on, as that of the arc length */
    uint32_t by_arc;
};

void feed_override_place(const struct feed_override *f, const struct interpolator *it,
                         struct feed_place *place);

/* Goes on with these records of the program under way. 1, or 0: they do not have what the next tick needs, and nothing
 * has changed. After 1 the records before are no longer in use. Constant time. */
int feed_override_use(struct feed_override *f, struct interpolator *it,
                      const struct coefficients_window *window);

/* 1: half of the records of the window are behind, and the program goes on behind it. Also in the tick. */
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

/* 1: feed_override_take_over takes the next chunk now, with records of it for this place. */
int feed_override_may_take_over(const struct feed_override *f, const struct interpolator *it,
                                const struct chunk *next, struct feed_place *place);

/* Takes the next chunk, which chunk_check has accepted behind the one under way and of which these records are there,
 * for the same kernel, for the program from the next tick on. In motion: where all setpoints up to the joint are those
 * of the program under way, bit for bit. So not in a brake, nor beyond the joint, nor while the override looks for a
 * ramp or is on one that was decided with pieces behind the joint. At rest (held, or at the end of the tail): on from
 * the same arc length; the motion goes on when it is running and the place is found, with the override from 0. A chunk
 * that begins at rest: at the end of its predecessor, running; the next tick gives its first setpoint, as of a program.
 * Returns 1, or 0: not now, or not with these records, and nothing has changed; try again after the next tick. After 1
 * the program before and its records are no longer in use. Constant time. */
int feed_override_take_over(struct feed_override *f, struct interpolator *it,
                            const struct chunk *next, const struct coefficients_window *window);

/* --- Commands: take effect from the next tick. Any sequence is allowed. Constant time. --- */

/* To rest until resumed. Without effect when stopping, stopped or ended. */
void feed_override_hold(struct feed_override *f);

/* Back to the override; a brake under way comes to rest first. Without effect when not holding or held. */
void feed_override_resume(struct feed_override *f);

/* Override wanted, in per cent; more than 200 counts as 200. Kept while held. */
void feed_override_set(struct feed_override *f, uint32_t percent);

/* To rest inside the program's limits, and to an end there: final. When the program ends first, it ends. */
void feed_override_stop(struct feed_override *f);

/* The same inside the machine's limits: at once also from the brake of a hold or a stop. */
void feed_override_fault_stop(struct feed_override *f);

/* --- Tick --- */

/* The next setpoint; *it is an interpolator of the same program that nobody else moves. After the end, or at rest, the
 * same point again. Returns 0 or a negative INTERPOLATOR_ERR_..., then *out is unchanged. Bounded time, tick
 * context. */
int feed_override_next(struct feed_override *f, struct interpolator *it,
                       struct interpolator_point *out);

/* Part of feed_override_next: a tick in which a stop is under way, or rest. By itself, so that the longest path of a
 * tick in which only the plan goes on can be counted without it. */
int feed_override_stop_tick(struct feed_override *f, struct interpolator *it);

/* Part of a tick of a stop: how the plan passes the place of its last setpoint; in *turned_q56 what the change of the
 * override adds to the acceleration. Returns 1, or 0 where the feed is beyond all brakes. */
int feed_override_motion(const struct feed_override *f, const struct interpolator *it,
                         struct path_state *state, int64_t *turned_q56);

/* --- What is so at the last setpoint --- */

enum feed_state feed_override_state(const struct feed_override *f);

/* 1 while it comes to rest for a hold or a stop and has taken longer than its bound and a fifth of it. */
int feed_override_late(const struct feed_override *f);

/* Program time in 2^-42 s, rounded to nearest; from the first tick of a brake on that of the last setpoint before it,
 * until the place of rest is found. */
uint64_t feed_override_time_q42(const struct feed_override *f);

/* The longest time, in us, of a stop that is requested now: what the stop table says. Where less than twice that is
 * left to the end of the program, it is the time to that end, since a brake may not fit before it. */
uint32_t feed_override_bound_us(const struct feed_override *f, enum program_stop_kind kind);

/* Feed along the path, 2^-32 mm/s. */
int64_t feed_override_feed_q32(const struct feed_override *f);

/* The override as it is, 2^30 = 1; 0 in a brake and at rest. */
uint32_t feed_override_actual_q30(const struct feed_override *f);

/* 1 at rest at the end of a tail, running or held, until the next chunk is taken over. */
int feed_override_waits(const struct feed_override *f);

/* 1 while the override wanted is more than the pieces allow here, so that the override stays below. */
int feed_override_saturated(const struct feed_override *f);

#endif
