/* SPDX-License-Identifier: MIT */
/* offline: the offline simulation, without a bus: interpolator, rounding to counts, simulated axes and contour error in
 * one process. It gives the same setpoints and encoder positions as a run on the bus, bit for bit. Called by
 * host_tools/hodograph/native. Changes only its struct and the caller's arrays; no I/O.
 *
 * Timing (docs/reference/protocol.md section 2): row k holds setpoint k, which is sent after SYNC k, latched
 * at SYNC k+1 and reached at SYNC k+2, and the positions and volts that the drives report for SYNC
 * k+2. The drives begin at standstill at the program's start point. Rows after the program's last tick repeat its end
 * point (settling), those after a stop its place of standstill.
 *
 * Use: offline_begin, then offline_run as often as needed. No heap: the caller lends the segment array. The program,
 * its image, its coefficient records and the segments must outlive the simulation. One thread for each struct offline.
 */
#ifndef HODOGRAPH_OFFLINE_OFFLINE_H
#define HODOGRAPH_OFFLINE_OFFLINE_H

#include <stdbool.h>
#include <stdint.h>

#include "core/feed_override.h"
#include "core/feedforward.h"
#include "core/interpolator.h"
#include "core/path_outputs.h"
#include "core/program.h"
#include "offline/contour.h"
#include "offline/offline_fault.h"
#include "plant/drive.h"
#include "plant/influence.h"

/* One tick; 144 bytes without holes, 0 for axes beyond those of the program. Python maps it as a numpy record. */
struct offline_row {
    int64_t arc_length_q40_mm;
    int64_t feed_q32_mm_s;            /* along the path */
    int64_t cmd_q40_mm[PROGRAM_AXES]; /* unrounded, from the kernel */
    double contour_error_um;
    int32_t set_counts[PROGRAM_AXES];
    int32_t act_counts[PROGRAM_AXES];
    int16_t volts_mv[PROGRAM_AXES];
    uint32_t tick;
    struct path_outputs_values outputs; /* on the path; those of a stop are off */
};

enum offline_order_kind {
    OFFLINE_ORDER_HOLD,       /* feed hold */
    OFFLINE_ORDER_RESUME,     /* ends it */
    OFFLINE_ORDER_OVERRIDE,   /* feed override: `percent` */
    OFFLINE_ORDER_STOP,       /* controlled stop */
    OFFLINE_ORDER_FAULT_STOP, /* fault stop */
    OFFLINE_ORDER_KINDS       /* how many there are */
};

/* A command that takes effect from setpoint `tick` on, which is the first that may differ for it. */
struct offline_order {
    enum offline_order_kind kind;
    uint32_t tick;
    uint32_t percent;
};

/* The last hold, stop or fault stop. */
struct offline_stop {
    uint32_t tick;       /* of the order, */
    uint32_t rest_tick;  /* and of the first setpoint at standstill; UINT32_MAX: not yet */
    uint32_t bound_us;   /* of the stop table, at the piece in which it was commanded */
    int64_t from_q40_mm; /* arc length of the last setpoint before the order, */
    int64_t rest_q40_mm; /* and at standstill */
};

enum offline_error {
    OFFLINE_ERR_COEFFICIENTS = -100, /* the program has no coefficient records */
    OFFLINE_ERR_PERIOD = -101,       /* a drive's period is not the program's */
    OFFLINE_ERR_COUNTS = -102,       /* counts per mm of x, y and z differ */
    OFFLINE_ERR_FAULT = -103,        /* a fault or an order that cannot be carried out */
    OFFLINE_ERR_DRIVE = -200,        /* minus 10 * axis, plus the enum drive_error of that axis */
    OFFLINE_ERR_INTERP = -300,       /* the interpolator failed: the program was not checked */
};

/* Fields are private. */
struct offline {
    struct interpolator interp;
    struct feed_override feed;
    struct path_outputs outputs;
    const struct offline_order *orders; /* borrowed */
    uint32_t order_count;
    uint32_t next_order;
    struct offline_stop stop;
    int64_t last_q40_mm;
    struct contour contour;
    uint32_t axis_count; /* of the program */
    struct drive drives[PROGRAM_AXES];
    struct drive_config configs[PROGRAM_AXES];
    uint32_t counts_per_unit[PROGRAM_AXES]; /* those of the drives */
    struct influence influences[PROGRAM_AXES];
    struct feedforward feedforwards[PROGRAM_AXES];
    struct feedforward_gains gains[PROGRAM_AXES];
    double rated_torque_nm[PROGRAM_AXES];
    bool influenced;                    /* by feedforward, friction or faults */
    const struct offline_fault *faults; /* borrowed */
    uint32_t fault_count;
    int64_t fault_tick;                   /* of the faults; negative before the first motion */
    int32_t latched_counts[PROGRAM_AXES]; /* the last setpoint that arrived */
    uint32_t program_ticks;
    uint32_t tick;
};

/* Sets up for a program that passed program_check and has coefficient records. `segments` has room for its
 * segment_count, `drives` has one element for each axis of the program. Returns 0 or an error. */
int offline_begin(struct offline *sim, const struct program *program,
                  const struct drive_config *drives, struct contour_segment *segments);

/* The controller's feedforward of each axis (0x2018 ... 0x201A), right after offline_begin; period and
 * counts per mm in the gains are those of the simulation. */
void offline_feedforward(struct offline *sim, const struct feedforward_gains *gains);

/* Rated torque of axis `axis` (from 0), more than 0, by default drive_config_rated_torque_nm; and its Coulomb friction
 * as volts, 0 or more, by default 0. Right after offline_begin. */
void offline_equip(struct offline *sim, int axis, double rated_torque_nm, double friction_volts);

/* Faults of this run, right after offline_begin; they must outlive the simulation. Positions and contour error stay
 * those of the axis itself, not of its encoder. Only one fault of a kind acts on an axis at a time.
 * Returns 0 or OFFLINE_ERR_FAULT. */
int offline_faults(struct offline *sim, const struct offline_fault *faults, uint32_t count);

/* Commands of this run, by ascending tick, right after offline_begin; they must outlive the simulation. Returns 0 or
 * OFFLINE_ERR_FAULT. */
int offline_orders(struct offline *sim, const struct offline_order *orders, uint32_t count);

/* The result of the last order to hold or stop. */
void offline_stop_get(const struct offline *sim, struct offline_stop *stop);

/* The next n ticks. Returns 0 or OFFLINE_ERR_INTERP. */
int offline_run(struct offline *sim, struct offline_row *rows, uint32_t n);

/* Only the commanded points, for n program times in 2^-42 s, in any order (fastest if ascending). counts: those of all
 * axes of a point, one point after the other, or NULL. Call interpolator_begin before. Returns 0 or
 * OFFLINE_ERR_INTERP. */
int offline_points(struct interpolator *interp, uint32_t n, const uint64_t *time_q42_s,
                   uint32_t counts_per_mm, struct interpolator_point *points, int32_t *counts);

/* Program times of n ticks from tick0 on, as the controller's program clock gives them at override 1, in
 * 2^-42 s. */
void offline_times(const struct program *program, uint32_t tick0, uint32_t n, uint64_t *time_q42_s);

/* counts_from_q40_mm for n values. */
void offline_counts(uint32_t n, const int64_t *q40_mm, uint32_t counts_per_mm, int32_t *counts);

#endif
