/* SPDX-License-Identifier: MIT */
/*
 * hodograph: the core, from a program image to one setpoint in each period. This header is its manual, and includes
 * what an application needs. Each function is described in the header that declares it. Included by applications that
 * take the core as a library (docs/guides/embed.md: files, compilers, memory). Licence: MIT.
 *
 * ## What to call, in this order
 *
 *   main loop   program_open                 reads the image: sizes, magic, version, CRC
 *               program_check                all rules of the format, and the limits of this controller
 *               kernel_find                  fixed, float or double; NULL where it is not linked
 *               coefficients_make_in         coefficient records of each segment and piece, in memory
 *               (or coefficients_make and coefficients_attach: by a sink, for flash)
 *               interpolator_begin           the cursor on the curve
 *               feed_override_begin          the motion: at rest, at a program time, override 100 %
 *               (program_time_at_q42: the program time of an arc length, to start inside the path)
 *               feedforward_begin            of each axis, where drives take offsets
 *   tick        feed_override_next           the next setpoint, as a point in mm
 *               counts_from_q40_mm           the same in counts, for the bus
 *               feedforward_next             velocity and torque offsets, where drives take them
 *   A job in chunks (core/chunk.h): kernel_find and the calls of the tick as above. These calls replace the others:
 *   main loop   coefficient_cache_init       memory for the coefficient records near the motion
 *               chunk_open                   reads a chunk and the program in it
 *               chunk_check                  checks this program, and that the chunk continues its predecessor
 *               coefficient_cache_fits       has the memory space for the least number of records?
 *               with the first chunk:
 *               coefficient_cache_begin      records from its start on
 *               interpolator_begin_window    the cursor on the curve
 *               feed_override_begin_job      the motion, at rest
 *               again and again; * marks calls with the tick held off (see Context):
 *               feed_override_place *        where the motion needs records
 *               coefficient_cache_prepare    makes them; NULL: they are there already
 *               feed_override_use *          1: the motion uses them
 *               coefficient_cache_used       after this 1
 *               with the next chunk:
 *               feed_override_may_take_over *    1: it can be taken over now; gives where it needs records
 *               coefficient_cache_prepare    makes them
 *               feed_override_take_over *    1: the next chunk is the program under way
 *               coefficient_cache_used       after this 1
 *   any time: in the tick, or in the main loop with the tick held off
 *               feed_override_hold, _resume, _set, _stop, _fault_stop         commands
 *               feed_override_state, _late, _waits, _feed_q32, _time_q42, _bound_us, _saturated, _actual_q30
 *                                            state at the last setpoint
 *   main loop, as needed, with an interpolator that no motion uses:
 *               interpolator_seek, interpolator_at, interpolator_at_q42, interpolator_at_arc_length   points of the path
 *               interpolator_ends            its first and last point
 *               program_segment_get, program_piece_get, program_stop_get, program_ticks   what the image contains
 *
 * ## Context
 *
 * The main loop calls what reads the whole program. A tick is one run of the timer interrupt. It calls only the
 * functions listed for it above, which take bounded time, and those listed for any time. Nothing here locks: no two
 * calls for the same motion may overlap. So the main loop holds the tick off (masks the timer interrupt) during each
 * call that changes or reads a motion under way. Structs are the caller's, and no function allocates or has state of
 * its own. The image, the records and the structs must stay where they are while a motion uses them; the image and the
 * records must not change.
 *
 * ## Path axes
 *
 * A planar program moves x and y, a spatial one x, y, z and up to three extra axes (docs/reference/protocol.md section
 * 1). program.header.axis_count is their number; positions, limits and offsets are arrays of PROGRAM_AXES elements, of
 * which the first axis_count are used. A controller with a fixed number of axes sets program_limits.axis_count.
 * program_check then refuses programs with another number, and programs whose first axis is not the machine's first
 * axis (core/first_axis.h). If program_limits.axis_count is 0, it accepts such programs. The caller then has to
 * evaluate first_axis().
 *
 * ## Limits
 *
 * program_check compares a program with struct program_limits (core/program_rules.h). 0 means no limit for feed,
 * acceleration and jerk along the path, for velocity, acceleration and jerk of each axis, for axis count, period and
 * stop time. Travel is always checked: min_q40_mm and max_q40_mm need values for each path axis. Travel from -4096 to
 * 4096 mm (times 2^40) allows all that the format allows.
 *
 * ## Cost
 *
 *   program_check          some 10^3 to 10^4 instructions a segment and piece, more for limits of the axes
 *   coefficients_make_in   some 2500 instructions a segment; bytes: coefficients_size
 *   feed_override_begin    linear in the number of pieces
 *   feed_override_next     docs/validation/wcet.md: bounds of instructions for each core and kernel
 *   code and stack         docs/guides/embed.md section 7
 *   struct interpolator    about 0.2 KiB; struct feed_override about 0.6 KiB
 *
 * ## Errors
 *
 * Functions return 0 or a negative code:
 *
 *   program_open, program_check              enum program_error (core/program_rules.h); text: program_error_text
 *   coefficients_make_in                     COEFFICIENTS_ERR_SIZE
 *   interpolator_begin, feed_override_next   INTERPOLATOR_ERR_...
 *
 * If feed_override_next fails, the point that it was given keeps its values. With a program that passed program_check
 * and has all its coefficient records a tick never fails. In a job in chunks it fails (INTERPOLATOR_ERR_JUMP) if the
 * main loop has not made the next records in time (core/coefficient_cache.h). Only program_check and chunk_check
 * validate: what a header demands of the caller is not checked again. Predicates return an int, 1 (true) or 0 (false).
 *
 * ## Numbers
 *
 * Units and scales stand in the names; core/qmath.h has the rules. All arithmetic is in integers, except in the kernels
 * float and double. With the same kernel, the same program and commands give the same bits on every target.
 *
 * ## Example
 *
 * tests/host/core/test_core_manual.py compiles this text and runs it.
 *
 *     #include "core/hodograph.h"
 *
 *     static struct program program;
 *     static uint64_t records[8192];
 *     static struct interpolator interpolator;
 *     static struct feed_override feed;
 *
 *     // Main loop. The image has to stay. In `limits` all is 0 but the travel (see Limits).
 *     int load(const uint8_t *image, uint32_t size, const struct program_limits *limits)
 *     {
 *         struct program_fault fault;
 *         int error = program_open(&program, image, size);
 *         if (error == 0) {
 *             error = program_check(&program, limits, &fault);
 *         }
 *         if (error == 0) {
 *             error = coefficients_make_in(&program, kernel_find(KERNEL_FIXED), records, sizeof records);
 *         }
 *         if (error == 0) {
 *             error = interpolator_begin(&interpolator, &program);
 *         }
 *         if (error == 0) {
 *             feed_override_begin(&feed, &program, program.header.period_us, 0);
 *         }
 *         return error;
 *     }
 *
 *     // Timer interrupt, once in each period, for axes with 1000000 counts for each mm. 1: this was the last setpoint.
 *     int tick(int32_t counts[2])
 *     {
 *         struct interpolator_point point;
 *         const int error = feed_override_next(&feed, &interpolator, &point);
 *         if (error != 0) {
 *             return error;
 *         }
 *         counts[0] = counts_from_q40_mm(point.position_q40[0], 1000000);
 *         counts[1] = counts_from_q40_mm(point.position_q40[1], 1000000);
 *         return feed_override_state(&feed) == FEED_ENDED;
 *     }
 */
#ifndef HODOGRAPH_CORE_HODOGRAPH_H
#define HODOGRAPH_CORE_HODOGRAPH_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#include "core/chunk.h"
#include "core/coefficient_cache.h"
#include "core/coefficients.h"
#include "core/counts.h"
#include "core/feed_override.h"
#include "core/feedforward.h"
#include "core/interpolator.h"
#include "core/kernel.h"
#include "core/program.h"
#include "core/program_check.h"
#include "core/program_time.h"

#ifdef __cplusplus
}
#endif

#endif
