/* SPDX-License-Identifier: MIT */
/* Implements app/machine/axis.h (see there): one drive as the tick uses it. */
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
    axis->rest_syncs = AXIS_REST_SYNCS;
    pdo_begin_setpoint(node, &axis->setpoint);
}

void axis_forget(struct axis *axis, uint8_t node)
{
    const bool homed = axis->homed && axis->node == node;
    const int32_t kept_counts = axis->answers.present ? axis->position_counts : axis->kept_counts;
    axis_init(axis, node);
    axis->homed = homed;
    axis->kept_counts = kept_counts;
}

void axis_found(struct axis *axis, int32_t position_counts, uint32_t tolerance_counts)
{
    axis->homed = axis->homed && distance(axis->kept_counts, position_counts) <= tolerance_counts;
    axis->kept_counts = position_counts;
}

void axis_command(struct axis *axis, enum cia402_goal goal)
{
    axis->goal = goal;
    axis->control_extra = 0;
    axis->by_itself = false;
    axis->away_syncs = 0;
    axis->away = false;
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
    tpdo_monitor_take(&axis->answers, now_us);
    if (axis_enabled(axis) && axis->goal == CIA402_GOAL_ENABLED) {
        statusword_monitor_take(&axis->watch, axis->statusword, !axis->by_itself);
    }
    axis->fit = axis_enabled(axis) && axis->watch.in_row <= STATUSWORD_MONITOR_TOLERATED;
}

void axis_restarted(struct axis *axis)
{
    axis->statusword = cia402_status_bits(CIA402_NOT_READY);
    axis->state = CIA402_NOT_READY;
    axis->fit = false;
}

static void count_standstill(struct axis *axis, uint32_t tolerance_counts)
{
    const bool still = axis->target_counts == axis->target_sent_counts && axis_enabled(axis) &&
                       distance(axis->target_counts, axis->position_counts) <= tolerance_counts;
    if (!still) {
        axis->still_syncs = 0;
    } else if (axis->still_syncs < AXIS_STANDSTILL_SYNCS) {
        axis->still_syncs++;
    }
}

static bool moves_in(enum cia402_state state)
{
    return state == CIA402_OPERATION_ENABLED || state == CIA402_QUICK_STOP_ACTIVE ||
           state == CIA402_FAULT_REACTION_ACTIVE;
}

/* Anew in each state; power finds the axis at rest. */
static void count_rest(struct axis *axis, uint32_t tolerance_counts)
{
    if (!moves_in(axis->state)) {
        axis->rest_syncs = AXIS_REST_SYNCS;
        axis->rest_counts = axis->position_counts;
    } else if ((axis->state != axis->rest_state && moves_in(axis->rest_state)) ||
               distance(axis->rest_counts, axis->position_counts) > tolerance_counts) {
        axis->rest_syncs = 0;
        axis->rest_counts = axis->position_counts;
    } else if (axis->rest_syncs < AXIS_STANDSTILL_SYNCS) {
        axis->rest_syncs++;
    }
    axis->rest_state = axis->state;
}

void axis_compare(struct axis *axis, uint32_t window_counts, uint32_t syncs_max)
{
    const bool follows = axis->engaged && axis->goal == CIA402_GOAL_ENABLED && !axis->by_itself;
    if (!follows || axis_apart(axis) <= window_counts) {
        axis->away_syncs = 0;
        axis->away = false;
    } else if (axis->away_syncs < syncs_max) {
        axis->away_syncs++;
    } else {
        axis->away = true;
    }
}

/* A statusword that once says "not enabled" must not move the target of a drive that may follow it still. */
static void note_engaged(struct axis *axis)
{
    if (axis->goal == CIA402_GOAL_ENABLED) {
        if (axis_enabled(axis)) {
            axis->engaged = true;
        }
    } else if (axis->goal != CIA402_GOAL_QUICK_STOP && !axis_enabled(axis)) {
        axis->engaged = false;
        statusword_monitor_init(&axis->watch);
    }
}

static void follow_position(struct axis *axis)
{
    if (axis->goal == CIA402_GOAL_QUICK_STOP) {
        axis->target_counts = axis->target_sent_counts;
    } else if (axis->by_itself || !axis->engaged) {
        axis->target_counts = axis->position_counts;
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

void axis_setpoint(struct axis *axis, uint32_t tolerance_counts)
{
    set_controlword(axis);
    note_engaged(axis);
    follow_position(axis);
    pdo_put_target(&axis->setpoint, axis->target_counts);
    count_standstill(axis, tolerance_counts);
    count_rest(axis, tolerance_counts);
}

bool axis_gone(const struct axis *axis, uint32_t now_us)
{
    return axis->answers.lost && now_us - axis->answers.last_us > AXIS_GONE_US;
}

bool axis_in_fault(const struct axis *axis)
{
    return axis->state == CIA402_FAULT || axis->state == CIA402_FAULT_REACTION_ACTIVE;
}

bool axis_dropped_out(const struct axis *axis)
{
    return axis->engaged && axis->goal == CIA402_GOAL_ENABLED && !axis_enabled(axis);
}

bool axis_follows(const struct axis *axis)
{
    return axis_enabled(axis) && !axis->answers.lost && statusword_monitor_follows(&axis->watch);
}

bool axis_moves(const struct axis *axis)
{
    return moves_in(axis->state) && axis->rest_syncs < AXIS_REST_SYNCS;
}

/* A statusword that means nothing, once, does not make a moving drive a stopped one. */
bool axis_left(const struct axis *axis)
{
    if (axis->state == CIA402_NOT_READY && moves_in(cia402_decode(axis->statusword_before))) {
        return axis->answers.lost;
    }
    return axis->answers.lost || !moves_in(axis->state) ||
           (axis->state == CIA402_QUICK_STOP_ACTIVE && axis->rest_state == axis->state &&
            axis->rest_syncs >= AXIS_STANDSTILL_SYNCS);
}

bool axis_reached(const struct axis *axis)
{
    const bool follows = axis->goal != CIA402_GOAL_ENABLED || axis->by_itself ||
                         (axis->statusword & CIA402_STATUS_FOLLOWS) != 0u;
    return follows && cia402_master_reached(axis->goal, axis->statusword);
}

bool axis_still(const struct axis *axis)
{
    return axis->still_syncs >= AXIS_STANDSTILL_SYNCS;
}

uint32_t axis_apart(const struct axis *axis)
{
    return distance(axis->position_counts, axis->expected_counts);
}

uint32_t axis_distance(const struct axis *axis, int32_t place_counts)
{
    const uint32_t target = distance(axis->target_counts, place_counts);
    const uint32_t actual = distance(axis->position_counts, place_counts);
    return target > actual ? target : actual;
}
