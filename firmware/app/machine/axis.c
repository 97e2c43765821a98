/* SPDX-License-Identifier: MIT */
/* Implements app/machine/axis.h (see there): one drive as the tick uses it. Used by firmware/app. Receive interrupt,
 * timer, and main loop in a critical section. Changes only its struct; no I/O. */
#include "app/machine/axis.h"

#include <string.h>

static uint32_t distance(int32_t a, int32_t b)
{
    return a > b ? (uint32_t)a - (uint32_t)b : (uint32_t)b - (uint32_t)a;
}

void axis_init(struct axis *axis, uint8_t node)
{
    memset(axis, 0, sizeof *axis);
    axis->node = node;
    axis->goal = CIA402_GOAL_OFF;
    axis->unmoved_syncs = AXIS_UNMOVED_SYNCS;
    pdo_begin_setpoint(node, &axis->setpoint);
}

void axis_forget(struct axis *axis, uint8_t node)
{
    const bool homed = axis->homed && axis->node == node;
    const int32_t last_counts =
        axis->tpdo1.present ? axis->position_counts : axis->last_seen_counts;
    axis_init(axis, node);
    axis->homed = homed;
    axis->last_seen_counts = last_counts;
}

void axis_reconnected(struct axis *axis, int32_t position_counts, uint32_t tolerance_counts)
{
    axis->homed =
        axis->homed && distance(axis->last_seen_counts, position_counts) <= tolerance_counts;
    axis->last_seen_counts = position_counts;
}

void axis_command(struct axis *axis, enum cia402_goal goal)
{
    axis->goal = goal;
    axis->control_extra = 0;
    axis->moves_by_drive = false;
    axis->deviation_syncs = 0;
    axis->deviates = false;
}

static void take_status(struct axis *axis, uint16_t statusword)
{
    axis->statusword_before = axis->statusword;
    axis->statusword = statusword;
    axis->state = cia402_decode(statusword);
}

void axis_receive(struct axis *axis, const struct pdo_actual *actual, uint32_t now_us)
{
    take_status(axis, actual->statusword);
    axis->position_counts = actual->position_counts;
    tpdo_monitor_take(&axis->tpdo1, now_us);
    if (axis_enabled(axis) && axis->goal == CIA402_GOAL_ENABLED) {
        statusword_monitor_take(&axis->statusword_bits, axis->statusword, !axis->moves_by_drive);
    }
    axis->statusword_ok =
        axis_enabled(axis) && axis->statusword_bits.in_row <= STATUSWORD_MONITOR_TOLERATED;
}

void axis_restarted(struct axis *axis)
{
    axis->statusword = cia402_status_bits(CIA402_NOT_READY);
    axis->state = CIA402_NOT_READY;
    axis->statusword_ok = false;
}

static void count_standstill(struct axis *axis, uint32_t tolerance_counts)
{
    const bool still = axis->target_counts == axis->target_sent_counts && axis_enabled(axis) &&
                       distance(axis->target_counts, axis->position_counts) <= tolerance_counts;
    if (!still) {
        axis->standstill_syncs = 0;
    } else if (axis->standstill_syncs < AXIS_STANDSTILL_SYNCS) {
        axis->standstill_syncs++;
    }
}

static bool moves_in(enum cia402_state state)
{
    return state == CIA402_OPERATION_ENABLED || state == CIA402_QUICK_STOP_ACTIVE ||
           state == CIA402_FAULT_REACTION_ACTIVE;
}

/* Restarts with each state: an axis stands when its power comes on. */
static void count_unmoved(struct axis *axis, uint32_t tolerance_counts)
{
    if (!moves_in(axis->state)) {
        axis->unmoved_syncs = AXIS_UNMOVED_SYNCS;
        axis->unmoved_counts = axis->position_counts;
    } else if ((axis->state != axis->unmoved_state && moves_in(axis->unmoved_state)) ||
               distance(axis->unmoved_counts, axis->position_counts) > tolerance_counts) {
        axis->unmoved_syncs = 0;
        axis->unmoved_counts = axis->position_counts;
    } else if (axis->unmoved_syncs < AXIS_STANDSTILL_SYNCS) {
        axis->unmoved_syncs++;
    }
    axis->unmoved_state = axis->state;
}

void axis_compare(struct axis *axis, uint32_t window_counts, uint32_t syncs_max)
{
    const bool follows =
        axis->was_enabled && axis->goal == CIA402_GOAL_ENABLED && !axis->moves_by_drive;
    if (!follows || axis_deviation_counts(axis) <= window_counts) {
        axis->deviation_syncs = 0;
        axis->deviates = false;
    } else if (axis->deviation_syncs < syncs_max) {
        axis->deviation_syncs++;
    } else {
        axis->deviates = true;
    }
}

/* One statusword with "not enabled" must not move the target: the drive may still follow it. */
static void note_enabled(struct axis *axis)
{
    if (axis->goal == CIA402_GOAL_ENABLED) {
        if (axis_enabled(axis)) {
            axis->was_enabled = true;
        }
    } else if (axis->goal != CIA402_GOAL_QUICK_STOP && !axis_enabled(axis)) {
        axis->was_enabled = false;
        statusword_monitor_init(&axis->statusword_bits);
    }
}

static int32_t within(const struct config_travel *travel, int32_t counts)
{
    const int32_t above = counts < travel->min_counts ? travel->min_counts : counts;
    return above > travel->max_counts ? travel->max_counts : above;
}

/* A drive that is switched on and gets a target beyond its software limit (0x607D) reports that it does not follow. */
static void follow_position(struct axis *axis, const struct config_travel *travel)
{
    if (axis->goal == CIA402_GOAL_QUICK_STOP) {
        axis->target_counts = axis->target_sent_counts;
    } else if (axis->moves_by_drive) {
        axis->target_counts = axis->position_counts;
    } else if (!axis->was_enabled) {
        axis->target_counts = axis->goal == CIA402_GOAL_ENABLED
                                  ? within(travel, axis->position_counts)
                                  : axis->position_counts;
    }
}

/* In the frame only when it changes. */
static void set_controlword(struct axis *axis)
{
    const uint16_t command = cia402_master_controlword(axis->goal, axis->state, axis->controlword);
    const uint16_t extra = command == CIA402_ENABLE_OPERATION ? axis->control_extra : 0u;
    const uint16_t word = (uint16_t)(command | extra);
    if (word != axis->controlword) {
        axis->controlword = word;
        pdo_put_controlword(&axis->setpoint, word);
    }
}

void axis_setpoint(struct axis *axis, uint32_t tolerance_counts, const struct config_travel *travel)
{
    set_controlword(axis);
    note_enabled(axis);
    follow_position(axis, travel);
    pdo_put_target(&axis->setpoint, axis->target_counts);
    count_standstill(axis, tolerance_counts);
    count_unmoved(axis, tolerance_counts);
}

bool axis_lost_for_long(const struct axis *axis, uint32_t now_us)
{
    return axis->tpdo1.lost && now_us - axis->tpdo1.last_us > AXIS_LOST_FOR_LONG_US;
}

bool axis_in_fault(const struct axis *axis)
{
    return axis->state == CIA402_FAULT || axis->state == CIA402_FAULT_REACTION_ACTIVE;
}

bool axis_left_operation_enabled(const struct axis *axis)
{
    return axis->was_enabled && axis->goal == CIA402_GOAL_ENABLED && !axis_enabled(axis);
}

bool axis_follows(const struct axis *axis)
{
    return axis_enabled(axis) && !axis->tpdo1.lost &&
           statusword_monitor_follows(&axis->statusword_bits);
}

bool axis_moves(const struct axis *axis)
{
    return moves_in(axis->state) && axis->unmoved_syncs < AXIS_UNMOVED_SYNCS;
}

/* One invalid statusword does not make a moving drive a stopped one. */
bool axis_has_stopped(const struct axis *axis)
{
    if (axis->state == CIA402_NOT_READY && moves_in(cia402_decode(axis->statusword_before))) {
        return axis->tpdo1.lost;
    }
    return axis->tpdo1.lost || !moves_in(axis->state) ||
           (axis->state == CIA402_QUICK_STOP_ACTIVE && axis->unmoved_state == axis->state &&
            axis->unmoved_syncs >= AXIS_STANDSTILL_SYNCS);
}

bool axis_reached(const struct axis *axis)
{
    const bool follows = axis->goal != CIA402_GOAL_ENABLED || axis->moves_by_drive ||
                         (axis->statusword & CIA402_STATUS_FOLLOWS) != 0u;
    return follows && cia402_master_reached(axis->goal, axis->statusword);
}

bool axis_stands(const struct axis *axis)
{
    return axis->standstill_syncs >= AXIS_STANDSTILL_SYNCS;
}

uint32_t axis_deviation_counts(const struct axis *axis)
{
    return distance(axis->position_counts, axis->expected_counts);
}

uint32_t axis_distance(const struct axis *axis, int32_t place_counts)
{
    const uint32_t target = distance(axis->target_counts, place_counts);
    const uint32_t actual = distance(axis->position_counts, place_counts);
    return target > actual ? target : actual;
}
