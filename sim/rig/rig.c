/* SPDX-License-Identifier: MIT */
#include "rig/rig.h"

#include <stddef.h>

#include "core/counts.h"

typedef char rig_assert_row_has_no_holes[sizeof(struct rig_row) == 64 ? 1 : -1];

static int rig_start_point(struct rig *rig, int32_t start[2])
{
    struct interp_point point;
    if (interp_at(&rig->interp, 0, &point) < 0) {
        return RIG_ERR_INTERP;
    }
    start[0] = counts_from_q40_mm(point.x_q40_mm, rig->counts_per_mm);
    start[1] = counts_from_q40_mm(point.y_q40_mm, rig->counts_per_mm);
    return 0;
}

static int rig_drives(struct rig *rig, const struct program *program,
                      const struct drive_config drives[2])
{
    for (int axis = 0; axis < 2; axis++) {
        const int error = drive_init(&rig->drives[axis], &drives[axis]);
        if (error != 0) {
            return RIG_ERR_DRIVE - 10 * axis + error;
        }
        if (drives[axis].period_us != program->header.period_us) {
            return RIG_ERR_PERIOD;
        }
    }
    return drives[0].counts_per_mm == drives[1].counts_per_mm ? 0 : RIG_ERR_COUNTS;
}

int rig_begin(struct rig *rig, const struct program *program, enum interp_kernel kernel,
              const struct drive_config drives[2], struct contour_segment *segments)
{
    const struct feedforward_gains without = {.period_us = drives[0].period_us};
    int32_t start[2];
    int error = rig_drives(rig, program, drives);
    if (error != 0) {
        return error;
    }
    rig->counts_per_mm = drives[0].counts_per_mm;
    rig->tick = 0;
    rig->influenced = false;
    rig->faults = NULL;
    rig->fault_count = 0;
    rig->fault_tick = -1;
    rig->program_ticks = program_ticks(program);
    if (interp_begin(&rig->interp, program, kernel) != 0) {
        return RIG_ERR_KERNEL;
    }
    error = rig_start_point(rig, start);
    if (error != 0) {
        return error;
    }
    for (int axis = 0; axis < 2; axis++) {
        drive_place(&rig->drives[axis], start[axis]);
        rig->latched_counts[axis] = start[axis];
        rig->configs[axis] = drives[axis];
        rig->gains[axis] = without;
        rig->rated_torque_nm[axis] = drive_config_rated_torque_nm(&drives[axis]);
        influence_none(&rig->influences[axis], &drives[axis]);
    }
    feed_override_begin(&rig->feed, program, program->header.period_us, 0);
    rig->orders = NULL;
    rig->order_count = 0;
    rig->next_order = 0;
    rig->last_q40_mm = 0;
    rig->stop = (struct rig_stop){UINT32_MAX, UINT32_MAX, 0, 0, 0};
    contour_begin(&rig->contour, program, segments);
    return 0;
}

void rig_feedforward(struct rig *rig, const struct feedforward_gains gains[2])
{
    for (int axis = 0; axis < 2; axis++) {
        rig->gains[axis] = gains[axis];
        rig->gains[axis].period_us = rig->configs[axis].period_us;
        rig->gains[axis].counts_per_mm = rig->counts_per_mm;
    }
    rig->influenced = true;
}

void rig_equip(struct rig *rig, int axis, double rated_torque_nm, double friction_volts)
{
    rig->rated_torque_nm[axis] = rated_torque_nm;
    rig->influences[axis].friction_volts = friction_volts;
    rig->influenced = rig->influenced || friction_volts > 0.0;
}

int rig_faults(struct rig *rig, const struct rig_fault *faults, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        if (!rig_fault_ok(&faults[i])) {
            return RIG_ERR_FAULT;
        }
    }
    rig->faults = faults;
    rig->fault_count = count;
    rig->influenced = rig->influenced || count > 0;
    return 0;
}

int rig_orders(struct rig *rig, const struct rig_order *orders, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        const bool late = i > 0 && orders[i].tick < orders[i - 1].tick;
        if ((int)orders[i].kind < 0 || orders[i].kind >= RIG_ORDER_KINDS || late) {
            return RIG_ERR_FAULT;
        }
    }
    rig->orders = orders;
    rig->order_count = count;
    return 0;
}

void rig_stop_get(const struct rig *rig, struct rig_stop *stop)
{
    *stop = rig->stop;
}

static bool rig_at_rest(const struct rig *rig)
{
    const enum feed_state state = feed_override_state(&rig->feed);
    return state == FEED_HELD || state == FEED_STOPPED || state == FEED_ENDED;
}

static void rig_order_stop(struct rig *rig, enum program_stop_kind kind)
{
    rig->stop.tick = rig->tick;
    rig->stop.rest_tick = UINT32_MAX;
    rig->stop.bound_us = feed_override_bound_us(&rig->feed, kind);
    rig->stop.from_q40_mm = rig->last_q40_mm;
}

static void rig_order(struct rig *rig, const struct rig_order *order)
{
    switch (order->kind) {
    case RIG_ORDER_HOLD:
        rig_order_stop(rig, PROGRAM_STOP_HOLD);
        feed_override_hold(&rig->feed);
        break;
    case RIG_ORDER_STOP:
        rig_order_stop(rig, PROGRAM_STOP_HOLD);
        feed_override_stop(&rig->feed);
        break;
    case RIG_ORDER_FAULT_STOP:
        rig_order_stop(rig, PROGRAM_STOP_FAULT);
        feed_override_fault_stop(&rig->feed);
        break;
    case RIG_ORDER_RESUME:
        feed_override_resume(&rig->feed);
        break;
    default:
        feed_override_set(&rig->feed, order->percent);
        break;
    }
}

static int rig_point_next(struct rig *rig, struct interp_point *point)
{
    while (rig->next_order < rig->order_count && rig->orders[rig->next_order].tick <= rig->tick) {
        rig_order(rig, &rig->orders[rig->next_order++]);
    }
    if (feed_override_next(&rig->feed, &rig->interp, point) != 0) {
        return RIG_ERR_INTERP;
    }
    rig->last_q40_mm = point->arc_length_q40_mm;
    if (rig->stop.tick != UINT32_MAX && rig->stop.rest_tick == UINT32_MAX && rig_at_rest(rig)) {
        rig->stop.rest_tick = rig->tick;
        rig->stop.rest_q40_mm = point->arc_length_q40_mm;
    }
    return 0;
}

static int rig_command(struct rig *rig, struct rig_row *row)
{
    struct interp_point point;
    if (rig_point_next(rig, &point) != 0) {
        return RIG_ERR_INTERP;
    }
    row->arc_length_q40_mm = point.arc_length_q40_mm;
    row->feed_q32_mm_s = feed_override_feed_q32(&rig->feed);
    row->cmd_q40_mm[0] = point.x_q40_mm;
    row->cmd_q40_mm[1] = point.y_q40_mm;
    row->set_counts[0] = counts_from_q40_mm(point.x_q40_mm, rig->counts_per_mm);
    row->set_counts[1] = counts_from_q40_mm(point.y_q40_mm, rig->counts_per_mm);
    row->tick = rig->tick++;
    return 0;
}

/* As the controller sends it: from the program's first setpoint to its last, the first at rest. */
static struct feedforward_offset rig_offset(struct rig *rig, const struct rig_row *row, int axis)
{
    const struct feedforward_offset none = {0, 0};
    if (row->tick == 0) {
        feedforward_begin(&rig->feedforwards[axis], row->cmd_q40_mm[axis]);
    }
    return row->tick < rig->program_ticks
               ? feedforward_next(&rig->feedforwards[axis], &rig->gains[axis],
                                  row->cmd_q40_mm[axis])
               : none;
}

static bool rig_arrives(const struct rig *rig, uint32_t axis)
{
    for (uint32_t i = 0; i < rig->fault_count; i++) {
        if (rig->faults[i].axis == axis && rig_fault_loses(&rig->faults[i], rig->fault_tick)) {
            return false;
        }
    }
    return true;
}

/* Begins and ends faults, and latches what arrives. */
static void rig_latch(struct rig *rig, const struct rig_row *row)
{
    const bool moves = row->set_counts[0] != rig->latched_counts[0] ||
                       row->set_counts[1] != rig->latched_counts[1];
    if (rig->fault_tick >= 0 || moves) {
        rig->fault_tick++;
    }
    for (uint32_t i = 0; i < rig->fault_count; i++) {
        const uint32_t axis = rig->faults[i].axis;
        rig_fault_tick(&rig->faults[i], rig->fault_tick, &rig->influences[axis],
                       &rig->drives[axis]);
    }
    for (uint32_t axis = 0; axis < 2; axis++) {
        if (rig_arrives(rig, axis)) {
            rig->latched_counts[axis] = row->set_counts[axis];
        }
    }
}

static void rig_move_forward(struct rig *rig, const struct rig_row *row)
{
    rig_latch(rig, row);
    for (int axis = 0; axis < 2; axis++) {
        struct influence *influence = &rig->influences[axis];
        const struct feedforward_offset offset = rig_offset(rig, row, axis);
        influence_offsets(influence, &rig->drives[axis], &rig->configs[axis],
                          offset.velocity_counts_s, offset.torque_permille,
                          rig->rated_torque_nm[axis]);
        if (influence_acts(influence, &rig->drives[axis])) {
            influence_period(influence, &rig->drives[axis], rig->latched_counts[axis]);
        } else {
            drive_period(&rig->drives[axis], rig->latched_counts[axis]);
        }
    }
}

static void rig_move(struct rig *rig, struct rig_row *row)
{
    if (rig->influenced) {
        rig_move_forward(rig, row);
    } else {
        drive_period_pair(&rig->drives[0], &rig->drives[1], row->set_counts);
    }
    for (int axis = 0; axis < 2; axis++) {
        row->act_counts[axis] = drive_position_counts(&rig->drives[axis]);
        row->volts_mv[axis] = drive_volts_mv(&rig->drives[axis]);
    }
}

int rig_run(struct rig *rig, struct rig_row *rows, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++) {
        const int error = rig_command(rig, &rows[i]);
        if (error != 0) {
            return error;
        }
        rig_move(rig, &rows[i]);
        contour_errors_um(&rig->contour, 1, &rows[i].arc_length_q40_mm, rows[i].act_counts,
                          rig->counts_per_mm, &rows[i].contour_error_um);
    }
    return 0;
}

static int rig_point(struct interp *interp, uint64_t time_q42_s, struct interp_point *point)
{
    int result = interp_at_q42(interp, time_q42_s, point);
    if (result == INTERP_ERR_JUMP && interp_seek(interp, time_q42_s >> 10) == 0) {
        result = interp_at_q42(interp, time_q42_s, point);
    }
    return result < 0 ? RIG_ERR_INTERP : 0;
}

int rig_points(struct interp *interp, uint32_t n, const uint64_t *time_q42_s,
               uint32_t counts_per_mm, struct interp_point *points, int32_t *counts)
{
    for (uint32_t i = 0; i < n; i++) {
        if (rig_point(interp, time_q42_s[i], &points[i]) != 0) {
            return RIG_ERR_INTERP;
        }
        if (counts == NULL) {
            continue;
        }
        counts[2 * i] = counts_from_q40_mm(points[i].x_q40_mm, counts_per_mm);
        counts[2 * i + 1] = counts_from_q40_mm(points[i].y_q40_mm, counts_per_mm);
    }
    return 0;
}

/* round(tick * period * 2^42 / 10^6) = round(tick * period * 2^36 / 15625), in two parts against
 * overflow. */
static uint64_t rig_time(uint64_t microseconds)
{
    const uint64_t whole_s = microseconds / 1000000;
    const uint64_t rest_us = microseconds % 1000000;
    return (whole_s << 42) + ((rest_us << 37) + 15625) / 31250;
}

void rig_times(const struct program *program, uint32_t tick0, uint32_t n, uint64_t *time_q42_s)
{
    const uint64_t duration = program->header.duration_q32_s << 10;
    for (uint32_t i = 0; i < n; i++) {
        const uint64_t time = rig_time(((uint64_t)tick0 + i) * program->header.period_us);
        time_q42_s[i] = time < duration ? time : duration;
    }
}

void rig_counts(uint32_t n, const int64_t *q40_mm, uint32_t counts_per_mm, int32_t *counts)
{
    for (uint32_t i = 0; i < n; i++) {
        counts[i] = counts_from_q40_mm(q40_mm[i], counts_per_mm);
    }
}
