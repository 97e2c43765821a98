/* SPDX-License-Identifier: MIT */
#include "app/axis.h"

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
}

void axis_receive(struct axis *axis, const struct pdo_actual *actual, uint32_t now_us)
{
    axis->statusword = actual->statusword;
    axis->position_counts = actual->position_counts;
    axis->answered_us = now_us;
    axis->answered = true;
    axis->present = true;
    axis->missed_in_row = 0;
}

bool axis_close_sync(struct axis *axis)
{
    const bool missed = axis->present && !axis->answered;
    if (missed && axis->missed_in_row < UINT32_MAX) {
        axis->missed_in_row++;
    }
    if (missed && axis->missed < UINT32_MAX) {
        axis->missed++;
    }
    axis->answered = false;
    return missed;
}

static void count_standstill(struct axis *axis, uint32_t tolerance_counts)
{
    const bool still = axis_enabled(axis) && axis->target_counts == axis->target_sent_counts &&
                       distance(axis->target_counts, axis->position_counts) <= tolerance_counts;
    if (!still) {
        axis->still_syncs = 0;
    } else if (axis->still_syncs < AXIS_STANDSTILL_SYNCS) {
        axis->still_syncs++;
    }
}

void axis_setpoint(struct axis *axis, uint32_t tolerance_counts, struct can_msg *out)
{
    const uint16_t before = axis->controlword;
    axis->controlword = cia402_master_controlword(axis->goal, axis->statusword, before);
    if (axis->controlword == CIA402_ENABLE_OPERATION) {
        axis->controlword = (uint16_t)(axis->controlword | axis->control_extra);
    }
    if ((before & CIA402_CONTROL_ENABLE) == 0u && !axis_enabled(axis)) {
        axis->target_counts = axis->position_counts;
    }
    count_standstill(axis, tolerance_counts);
    const struct pdo_setpoint setpoint = {.controlword = axis->controlword,
                                          .target_counts = axis->target_counts};
    pdo_encode_setpoint(axis->node, &setpoint, out);
    axis->target_sent_counts = axis->target_counts;
}

bool axis_lost(const struct axis *axis, uint32_t now_us)
{
    const bool silent = now_us - axis->answered_us > AXIS_SILENCE_MAX_US;
    return axis->missed_in_row > (silent ? AXIS_MISSED_MAX : AXIS_MISSED_LOST);
}

bool axis_in_fault(const struct axis *axis)
{
    const enum cia402_state state = cia402_decode(axis->statusword);
    return state == CIA402_FAULT || state == CIA402_FAULT_REACTION_ACTIVE;
}

bool axis_enabled(const struct axis *axis)
{
    return cia402_decode(axis->statusword) == CIA402_OPERATION_ENABLED;
}

bool axis_reached(const struct axis *axis)
{
    return cia402_master_reached(axis->goal, axis->statusword);
}

bool axis_still(const struct axis *axis)
{
    return axis->still_syncs >= AXIS_STANDSTILL_SYNCS;
}

uint32_t axis_distance(const struct axis *axis, int32_t place_counts)
{
    const uint32_t target = distance(axis->target_counts, place_counts);
    const uint32_t actual = distance(axis->position_counts, place_counts);
    return target > actual ? target : actual;
}
