/* SPDX-License-Identifier: MIT */
#include "app/drives/drive_plan.h"

#include <stddef.h>
#include <string.h>

#include "app/drives/drive_rows.h"
#include "canopen/sdo_abort.h"

static uint8_t node_of(const struct drive_plan *plan)
{
    return plan->config->node[plan->axis];
}

static const struct config_axis *axis_of(const struct drive_plan *plan)
{
    return &plan->config->axis[plan->axis];
}

static bool configured(const struct drive_plan *plan, enum drive_when when)
{
    const struct config_axis *axis = axis_of(plan);
    switch (when) {
    case WHEN_TORQUE:
        return (plan->config->feedforward & CONFIG_TORQUE_FEEDFORWARD) != 0u;
    case WHEN_VELOCITY:
        return (plan->config->feedforward & CONFIG_VELOCITY_FEEDFORWARD) != 0u;
    case WHEN_HOMING:
        return axis->homing_method != 0 && drive_supports(plan->facts, CIA402_MODE_HOMING);
    case WHEN_WINDOW:
        return axis->following_window_counts != UINT32_MAX;
    case WHEN_VENDOR:
        return axis->expected_vendor != 0u;
    case WHEN_PRODUCT:
        return axis->expected_product != 0u;
    case WHEN_REVISION:
        return axis->expected_revision != 0u;
    case WHEN_ENCODER:
        return axis->encoder_increments != 0u;
    case WHEN_GEAR:
        return axis->gear_motor_revolutions != 0u && axis->gear_shaft_revolutions != 0u;
    case WHEN_FEED:
    default:
        return axis->feed_constant_counts != 0u;
    }
}

static bool concerns(const struct drive_plan *plan, enum drive_when when)
{
    switch (when) {
    case WHEN_ALWAYS:
        return true;
    case WHEN_SIMULATED:
        return drive_is_simulated(plan->facts);
    case WHEN_REAL:
        return !drive_is_simulated(plan->facts);
    case WHEN_INPUTS:
        return plan->facts->known[DRIVE_INPUTS];
    case WHEN_NOT_MAPPED:
        return !plan->facts->known[DRIVE_INPUTS_MAPPED];
    case WHEN_NO_TORQUE:
        return !plan->facts->known[DRIVE_TORQUE_MAPPED];
    case WHEN_NO_VELOCITY:
        return !plan->facts->known[DRIVE_VELOCITY_MAPPED];
        return !configured(plan, WHEN_WINDOW);
    default:
        return configured(plan, when);
    }
}

static uint32_t axis_number(const struct drive_plan *plan, size_t offset)
{
    uint32_t number;
    memcpy(&number, (const uint8_t *)axis_of(plan) + offset, sizeof number);
    return number;
}

static uint32_t value_of(const struct drive_plan *plan, const struct drive_row *row)
{
    const struct config *config = plan->config;
    switch (row->source) {
    case FROM_AXIS:
        return axis_number(plan, row->argument);
    case FROM_PERIOD_US:
        return config->period_us;
    case FROM_PERIOD_MS:
        return config->period_us / 1000u;
    case FROM_TRAVEL_MIN:
        return (uint32_t)config->travel_min_counts[plan->axis];
    case FROM_TRAVEL_MAX:
        return (uint32_t)config->travel_max_counts[plan->axis];
    case FROM_OWN_NODE:
        return ((uint32_t)config->own_node << 16) | row->argument;
    case FROM_SETPOINT_TIMEOUT:
        return config->setpoint_timeout_ms;
    case FROM_ROW:
    default:
        return row->argument;
    }
}

static uint32_t low_bytes(uint32_t size)
{
    return size < 4u ? (UINT32_C(1) << (8u * size)) - 1u : UINT32_MAX;
}

static const enum drive_op_kind kinds[] = {
    [ROW_PRE_OPERATIONAL] = DRIVE_OP_NMT_PRE_OPERATIONAL,
    [ROW_EXPECT] = DRIVE_OP_READ,
    [ROW_NEED_BITS] = DRIVE_OP_READ,
    [ROW_LEARN] = DRIVE_OP_READ,
    [ROW_MUST] = DRIVE_OP_WRITE,
    [ROW_MAY] = DRIVE_OP_WRITE,
    [ROW_TRY] = DRIVE_OP_PREPARE,
};

static void plain_op(const struct drive_plan *plan, const struct drive_row *row,
                     struct drive_op *op)
{
    *op = (struct drive_op){.kind = kinds[row->kind],
                            .index = row->index,
                            .sub = row->sub,
                            .size = row->size,
                            .optional = row->kind == ROW_MAY || row->kind == ROW_LEARN,
                            .fact = DRIVE_NO_FACT};
    op->mask = low_bytes(row->size);
    if (row->kind == ROW_LEARN) {
        op->fact = (uint8_t)row->argument;
        op->mask = 0;
        return;
    }
    op->value = value_of(plan, row) & op->mask;
    if (row->kind == ROW_NEED_BITS) {
        op->mask = op->value;
    }
}

static bool is_pdo(const struct drive_row *row)
{
    return row->kind == ROW_PDO || row->kind == ROW_PDO_MAY || row->kind == ROW_PDO_OFFSET;
}

/* The row's present operation; false: it has no more. */
static bool row_op(const struct drive_plan *plan, const struct drive_row *row, struct drive_op *op)
{
    if (!concerns(plan, row->when)) {
        return false;
    }
    if (!is_pdo(row)) {
        plain_op(plan, row, op);
        return plan->item == 0u;
    }
    return drive_pdo_op(&drive_pdos[row->argument], node_of(plan),
                        plan->config->setpoint_timeout_ms, plan->item, op);
}

static void next_row(struct drive_plan *plan)
{
    plan->row++;
    plan->item = 0;
}

void drive_plan_begin(struct drive_plan *plan, const struct config *config, uint8_t axis,
                      struct drive_properties *facts)
{
    memset(plan, 0, sizeof *plan);
    memset(facts, 0, sizeof *facts);
    plan->config = config;
    plan->axis = axis;
    plan->facts = facts;
}

bool drive_plan_op(struct drive_plan *plan, struct drive_op *op)
{
    while (plan->row < drive_row_count) {
        const struct drive_row *row = &drive_rows[plan->row];
        if (row_op(plan, row, op)) {
            return true;
        }
        if (is_pdo(row) && concerns(plan, row->when)) {
            drive_properties_read(plan->facts, drive_pdos[row->argument].fact, 1);
        }
        next_row(plan);
    }
    return false;
}

void drive_plan_advance(struct drive_plan *plan)
{
    plan->item++;
}

static bool can_do_without(enum drive_row_kind kind, uint32_t abort_code)
{
    return kind == ROW_PDO_MAY ||
           (kind == ROW_PDO_OFFSET &&
            (abort_code == SDO_ABORT_NO_OBJECT || abort_code == SDO_ABORT_NOT_MAPPABLE));
}

bool drive_plan_refused(struct drive_plan *plan, uint32_t abort_code)
{
    if (!can_do_without(drive_rows[plan->row].kind, abort_code)) {
        return false;
    }
    next_row(plan);
    return true;
}
