/* SPDX-License-Identifier: MIT */
/* Implements offline/offline.h (see there): interpolation, rounding and simulated axes in one process, without a bus.
 * Called by host_tools/hodograph/native. One thread for each struct offline. Changes only its struct and the caller's
 * arrays; no I/O. */
#include "offline/offline.h"

#include <stddef.h>

#include "core/counts.h"
#include "core/first_axis.h"

typedef char offline_assert_row_has_no_holes[sizeof(struct offline_row) == 144 ? 1 : -1];

static int offline_start_point(struct offline *sim, int32_t start[PROGRAM_AXES])
{
    struct interpolator_point point;
    if (interpolator_at(&sim->interp, 0, &point) < 0) {
        return OFFLINE_ERR_INTERP;
    }
    for (uint32_t axis = 0; axis < sim->axis_count; axis++) {
        start[axis] =
            counts_from_q40_mm(point.position_q40[axis], sim->configs[axis].counts_per_mm);
    }
    return 0;
}

static int offline_drives(struct offline *sim, const struct program *program,
                          const struct drive_config *drives)
{
    for (uint32_t axis = 0; axis < sim->axis_count; axis++) {
        const int error = drive_init(&sim->drives[axis], &drives[axis]);
        if (error != 0) {
            return OFFLINE_ERR_DRIVE - 10 * (int)axis + error;
        }
        if (drives[axis].period_us != program->header.period_us) {
            return OFFLINE_ERR_PERIOD;
        }
    }
    const bool in_mm = first_axis(&program->header) == 0u;
    for (uint32_t axis = 1; axis < program_curve_axes(sim->axis_count); axis++) {
        if (in_mm && drives[axis].counts_per_mm != drives[0].counts_per_mm) {
            return OFFLINE_ERR_COUNTS;
        }
    }
    for (uint32_t axis = 0; axis < sim->axis_count; axis++) {
        sim->configs[axis] = drives[axis];
        sim->counts_per_unit[axis] = drives[axis].counts_per_mm;
    }
    return 0;
}

int offline_begin(struct offline *sim, const struct program *program,
                  const struct drive_config *drives, struct contour_segment *segments)
{
    const struct feedforward_gains without = {.period_us = drives[0].period_us};
    int32_t start[PROGRAM_AXES] = {0};
    sim->axis_count = program->header.axis_count;
    int error = offline_drives(sim, program, drives);
    if (error != 0) {
        return error;
    }
    sim->tick = 0;
    sim->influenced = false;
    sim->faults = NULL;
    sim->fault_count = 0;
    sim->fault_tick = -1;
    sim->program_ticks = program_ticks(program);
    if (interpolator_begin(&sim->interp, program) != 0) {
        return OFFLINE_ERR_COEFFICIENTS;
    }
    error = offline_start_point(sim, start);
    if (error != 0) {
        return error;
    }
    for (uint32_t axis = 0; axis < sim->axis_count; axis++) {
        drive_place(&sim->drives[axis], start[axis]);
        sim->latched_counts[axis] = start[axis];
        sim->gains[axis] = without;
        sim->rated_torque_nm[axis] = drive_config_rated_torque_nm(&drives[axis]);
        influence_none(&sim->influences[axis], &drives[axis]);
    }
    feed_override_begin(&sim->feed, program, program->header.period_us, 0);
    path_outputs_begin(&sim->outputs, program, -1);
    sim->orders = NULL;
    sim->order_count = 0;
    sim->next_order = 0;
    sim->last_q40_mm = 0;
    sim->stop = (struct offline_stop){UINT32_MAX, UINT32_MAX, 0, 0, 0};
    contour_begin(&sim->contour, program, segments);
    return 0;
}

void offline_feedforward(struct offline *sim, const struct feedforward_gains *gains)
{
    for (uint32_t axis = 0; axis < sim->axis_count; axis++) {
        sim->gains[axis] = gains[axis];
        sim->gains[axis].period_us = sim->configs[axis].period_us;
        sim->gains[axis].counts_per_mm = sim->configs[axis].counts_per_mm;
    }
    sim->influenced = true;
}

void offline_equip(struct offline *sim, int axis, double rated_torque_nm, double friction_volts)
{
    sim->rated_torque_nm[axis] = rated_torque_nm;
    sim->influences[axis].friction_volts = friction_volts;
    sim->influenced = sim->influenced || friction_volts > 0.0;
}

int offline_faults(struct offline *sim, const struct offline_fault *faults, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        if (!offline_fault_ok(&faults[i]) || faults[i].axis >= sim->axis_count) {
            return OFFLINE_ERR_FAULT;
        }
    }
    sim->faults = faults;
    sim->fault_count = count;
    sim->influenced = sim->influenced || count > 0;
    return 0;
}

int offline_orders(struct offline *sim, const struct offline_order *orders, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        const bool late = i > 0 && orders[i].tick < orders[i - 1].tick;
        if ((int)orders[i].kind < 0 || orders[i].kind >= OFFLINE_ORDER_KINDS || late) {
            return OFFLINE_ERR_FAULT;
        }
    }
    sim->orders = orders;
    sim->order_count = count;
    return 0;
}

void offline_stop_get(const struct offline *sim, struct offline_stop *stop)
{
    *stop = sim->stop;
}

static bool offline_at_rest(const struct offline *sim)
{
    const enum feed_state state = feed_override_state(&sim->feed);
    return state == FEED_HELD || state == FEED_STOPPED || state == FEED_ENDED;
}

static void offline_order_stop(struct offline *sim, enum program_stop_kind kind)
{
    sim->stop.tick = sim->tick;
    sim->stop.rest_tick = UINT32_MAX;
    sim->stop.bound_us = feed_override_bound_us(&sim->feed, kind);
    sim->stop.from_q40_mm = sim->last_q40_mm;
}

static void offline_order(struct offline *sim, const struct offline_order *order)
{
    switch (order->kind) {
    case OFFLINE_ORDER_HOLD:
        offline_order_stop(sim, PROGRAM_STOP_HOLD);
        feed_override_hold(&sim->feed);
        break;
    case OFFLINE_ORDER_STOP:
        offline_order_stop(sim, PROGRAM_STOP_HOLD);
        feed_override_stop(&sim->feed);
        path_outputs_clear(&sim->outputs); /* as a controller that has no other command */
        break;
    case OFFLINE_ORDER_FAULT_STOP:
        offline_order_stop(sim, PROGRAM_STOP_FAULT);
        feed_override_fault_stop(&sim->feed);
        path_outputs_clear(&sim->outputs); /* as a controller that has no other command */
        break;
    case OFFLINE_ORDER_RESUME:
        feed_override_resume(&sim->feed);
        break;
    default:
        feed_override_set(&sim->feed, order->percent);
        break;
    }
}

static int offline_point_next(struct offline *sim, struct interpolator_point *point)
{
    while (sim->next_order < sim->order_count && sim->orders[sim->next_order].tick <= sim->tick) {
        offline_order(sim, &sim->orders[sim->next_order++]);
    }
    if (feed_override_next(&sim->feed, &sim->interp, point) != 0) {
        return OFFLINE_ERR_INTERP;
    }
    sim->last_q40_mm = point->arc_length_q40_mm;
    if (sim->stop.tick != UINT32_MAX && sim->stop.rest_tick == UINT32_MAX && offline_at_rest(sim)) {
        sim->stop.rest_tick = sim->tick;
        sim->stop.rest_q40_mm = point->arc_length_q40_mm;
    }
    return 0;
}

static int offline_command(struct offline *sim, struct offline_row *row)
{
    struct interpolator_point point;
    if (offline_point_next(sim, &point) != 0) {
        return OFFLINE_ERR_INTERP;
    }
    row->arc_length_q40_mm = point.arc_length_q40_mm;
    row->feed_q32_mm_s = feed_override_feed_q32(&sim->feed);
    for (uint32_t axis = 0; axis < PROGRAM_AXES; axis++) {
        const bool follows = axis < sim->axis_count;
        row->cmd_q40_mm[axis] = follows ? point.position_q40[axis] : 0;
        row->set_counts[axis] =
            follows ? counts_from_q40_mm(point.position_q40[axis], sim->configs[axis].counts_per_mm)
                    : 0;
    }
    path_outputs_step(&sim->outputs, row->arc_length_q40_mm, row->feed_q32_mm_s);
    row->outputs = sim->outputs.values;
    row->tick = sim->tick++;
    return 0;
}

/* As the controller sends it: from the program's first setpoint to its last, the first at rest. */
static struct feedforward_offset offline_offset(struct offline *sim, const struct offline_row *row,
                                                uint32_t axis)
{
    const struct feedforward_offset none = {0, 0};
    if (row->tick == 0) {
        feedforward_begin(&sim->feedforwards[axis], row->cmd_q40_mm[axis]);
    }
    return row->tick < sim->program_ticks
               ? feedforward_next(&sim->feedforwards[axis], &sim->gains[axis],
                                  row->cmd_q40_mm[axis])
               : none;
}

static bool offline_arrives(const struct offline *sim, uint32_t axis)
{
    for (uint32_t i = 0; i < sim->fault_count; i++) {
        if (sim->faults[i].axis == axis && offline_fault_loses(&sim->faults[i], sim->fault_tick)) {
            return false;
        }
    }
    return true;
}

/* Begins and ends faults, and latches what arrives. */
static void offline_latch(struct offline *sim, const struct offline_row *row)
{
    bool moves = false;
    for (uint32_t axis = 0; axis < sim->axis_count; axis++) {
        moves = moves || row->set_counts[axis] != sim->latched_counts[axis];
    }
    if (sim->fault_tick >= 0 || moves) {
        sim->fault_tick++;
    }
    for (uint32_t i = 0; i < sim->fault_count; i++) {
        const uint32_t axis = sim->faults[i].axis;
        offline_fault_tick(&sim->faults[i], sim->fault_tick, &sim->influences[axis],
                           &sim->drives[axis]);
    }
    for (uint32_t axis = 0; axis < sim->axis_count; axis++) {
        if (offline_arrives(sim, axis)) {
            sim->latched_counts[axis] = row->set_counts[axis];
        }
    }
}

static void offline_move_forward(struct offline *sim, const struct offline_row *row)
{
    offline_latch(sim, row);
    for (uint32_t axis = 0; axis < sim->axis_count; axis++) {
        struct influence *influence = &sim->influences[axis];
        const struct feedforward_offset offset = offline_offset(sim, row, axis);
        influence_offsets(influence, &sim->drives[axis], &sim->configs[axis],
                          offset.velocity_counts_s, offset.torque_permille,
                          sim->rated_torque_nm[axis]);
        if (influence_acts(influence, &sim->drives[axis])) {
            influence_period(influence, &sim->drives[axis], sim->latched_counts[axis]);
        } else {
            drive_period(&sim->drives[axis], sim->latched_counts[axis]);
        }
    }
}

static void offline_move(struct offline *sim, struct offline_row *row)
{
    if (sim->influenced) {
        offline_move_forward(sim, row);
    } else {
        drive_period_pair(&sim->drives[0], &sim->drives[1], row->set_counts);
        for (uint32_t axis = PROGRAM_PLANE; axis < sim->axis_count; axis++) {
            drive_period(&sim->drives[axis], row->set_counts[axis]);
        }
    }
    for (uint32_t axis = 0; axis < PROGRAM_AXES; axis++) {
        const bool follows = axis < sim->axis_count;
        row->act_counts[axis] = follows ? drive_position_counts(&sim->drives[axis]) : 0;
        row->volts_mv[axis] = follows ? drive_volts_mv(&sim->drives[axis]) : 0;
    }
}

int offline_run(struct offline *sim, struct offline_row *rows, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++) {
        const int error = offline_command(sim, &rows[i]);
        if (error != 0) {
            return error;
        }
        offline_move(sim, &rows[i]);
        contour_errors_um(&sim->contour, 1, &rows[i].arc_length_q40_mm, rows[i].act_counts,
                          sim->axis_count, sim->counts_per_unit, &rows[i].contour_error_um);
    }
    return 0;
}

static int offline_point(struct interpolator *interp, uint64_t time_q42_s,
                         struct interpolator_point *point)
{
    int result = interpolator_at_q42(interp, time_q42_s, point);
    if (result == INTERPOLATOR_ERR_JUMP && interpolator_seek(interp, time_q42_s >> 10) == 0) {
        result = interpolator_at_q42(interp, time_q42_s, point);
    }
    return result < 0 ? OFFLINE_ERR_INTERP : 0;
}

int offline_points(struct interpolator *interp, uint32_t n, const uint64_t *time_q42_s,
                   uint32_t counts_per_mm, struct interpolator_point *points, int32_t *counts)
{
    for (uint32_t i = 0; i < n; i++) {
        if (offline_point(interp, time_q42_s[i], &points[i]) != 0) {
            return OFFLINE_ERR_INTERP;
        }
        const uint32_t axes = interp->program->header.axis_count;
        for (uint32_t axis = 0; counts != NULL && axis < axes; axis++) {
            counts[axes * (size_t)i + axis] =
                counts_from_q40_mm(points[i].position_q40[axis], counts_per_mm);
        }
    }
    return 0;
}

/* round(tick * period * 2^42 / 10^6) = round(tick * period * 2^36 / 15625), in two parts against
 * overflow. */
static uint64_t offline_time(uint64_t microseconds)
{
    const uint64_t whole_s = microseconds / 1000000;
    const uint64_t rest_us = microseconds % 1000000;
    return (whole_s << 42) + ((rest_us << 37) + 15625) / 31250;
}

void offline_times(const struct program *program, uint32_t tick0, uint32_t n, uint64_t *time_q42_s)
{
    const uint64_t duration = program->header.duration_q32_s << 10;
    for (uint32_t i = 0; i < n; i++) {
        const uint64_t time = offline_time(((uint64_t)tick0 + i) * program->header.period_us);
        time_q42_s[i] = time < duration ? time : duration;
    }
}

void offline_counts(uint32_t n, const int64_t *q40_mm, uint32_t counts_per_mm, int32_t *counts)
{
    for (uint32_t i = 0; i < n; i++) {
        counts[i] = counts_from_q40_mm(q40_mm[i], counts_per_mm);
    }
}
