/* SPDX-License-Identifier: MIT */
#include "canopen/cob.h"
#include "canopen/sdo_abort.h"
#include "node/drive_node_private.h"

void drive_node_od_fill(struct drive_node *node)
{
    const struct drive_config *c = &node->axis.config;
    const double two_pi = 6.283185307179586476925;
    const double feed = two_pi * c->plant.screw_mm_rad * (double)c->counts_per_mm;
    od_drive_set_node(&node->values, node->id);
    node->values.position_encoder_resolution[0] = c->encoder_counts_per_rev;
    node->values.feed_constant[0] = feed < (double)UINT32_MAX ? (uint32_t)(feed + 0.5) : UINT32_MAX;
    node->values.communication_cycle_period = c->period_us;
    node->values.target_position = node->axis.target_counts;
}

/* Counts per second, over the last period. */
static int32_t drive_node_speed(const struct drive_node *node)
{
    const double mm_s =
        node->axis.drive.state.motor.speed_rad_s * node->axis.config.plant.screw_mm_rad;
    return encoder_to_i32(mm_s * (double)node->axis.config.counts_per_mm);
}

void drive_node_od_refresh_cyclic(struct drive_node *node)
{
    struct od_drive *v = &node->values;
    v->statusword = cia402_device_statusword(&node->device);
    v->position_actual_value = drive_position_counts(&node->axis.drive);
    v->motor_voltage = drive_volts_mv(&node->axis.drive);
}

void drive_node_od_refresh(struct drive_node *node)
{
    struct od_drive *v = &node->values;
    const struct drive *drive = &node->axis.drive;
    drive_node_od_refresh_cyclic(node);
    v->modes_of_operation_display = v->modes_of_operation;
    v->position_demand_value = node->axis.target_counts;
    v->position_actual_internal_value =
        encoder_to_i32(drive->state.motor.position_mm * drive->encoder.increments_per_mm);
    v->following_error_actual_value =
        encoder_to_i32((double)v->position_demand_value - (double)v->position_actual_value);
    v->velocity_actual_value = drive_node_speed(node);
    v->simulation.parked = drive_parked(drive) ? 1 : 0;
}

static uint32_t drive_node_read(void *context, const struct od_entry *entry)
{
    (void)entry;
    drive_node_od_refresh(context);
    return SDO_OK;
}

/* The period that 0x60C2 gives, us; 0 when it is no such number. */
static uint32_t drive_node_period_us(uint32_t value, int32_t exponent)
{
    uint32_t period_us = value;
    if (exponent < -6 || exponent > 0) {
        return 0;
    }
    for (int32_t i = -6; i < exponent; i++) {
        period_us *= 10u;
    }
    return period_us;
}

/* The period that the model would have after the write; 0: the write is not about it. */
static uint32_t drive_node_asked_period(const struct drive_node *node, const struct od_entry *entry,
                                        const uint8_t *value, uint32_t size)
{
    const uint32_t number = (uint32_t)cob_get(value, size);
    if (entry->index == OD_DRIVE_COMMUNICATION_CYCLE_PERIOD) {
        return number;
    }
    if (entry->sub == 1) {
        return drive_node_period_us(
            number, node->values.interpolation_time_period.interpolation_time_index);
    }
    return drive_node_period_us(
        node->values.interpolation_time_period.interpolation_time_period_value,
        (int32_t)cob_signed(number, size));
}

static uint32_t drive_node_write(void *context, const struct od_entry *entry, const uint8_t *value,
                                 uint32_t size)
{
    struct drive_node *node = context;
    if (entry->index == OD_DRIVE_PREDEFINED_ERROR_FIELD) {
        return value[0] == 0 ? SDO_OK : SDO_ABORT_VALUE;
    }
    if (entry->index == OD_DRIVE_MODES_OF_OPERATION) {
        return value[0] == CIA402_MODE_CSP ? SDO_OK : SDO_ABORT_VALUE;
    }
    const uint32_t refused = drive_node_pdo_write(node, entry, value, size);
    if (refused != SDO_OK) {
        return refused;
    }
    if (entry->index != OD_DRIVE_COMMUNICATION_CYCLE_PERIOD &&
        entry->index != OD_DRIVE_INTERPOLATION_TIME_PERIOD) {
        return SDO_OK;
    }
    if (cia402_device_action(&node->device) != CIA402_POWER_OFF) {
        return SDO_ABORT_STATE;
    }
    const uint32_t period_us = drive_node_asked_period(node, entry, value, size);
    return axis_motion_set_period(&node->axis, period_us) == 0 ? SDO_OK : SDO_ABORT_VALUE;
}

static void drive_node_written(void *context, const struct od_entry *entry)
{
    struct drive_node *node = context;
    switch (entry->index) {
    case OD_DRIVE_PREDEFINED_ERROR_FIELD:
        emcy_producer_forget(&node->emcy);
        break;
    case OD_DRIVE_CONSUMER_HEARTBEAT_TIME:
        heartbeat_consumer_init_entry(&node->master, node->values.consumer_heartbeat_time[0]);
        break;
    case OD_DRIVE_SYNCHRONOUS_COUNTER_OVERFLOW_VALUE:
        sync_consumer_init(&node->sync, node->values.synchronous_counter_overflow_value);
        break;
    case OD_DRIVE_CONTROLWORD:
        drive_node_control(node, node->values.controlword);
        break;
    case OD_DRIVE_TARGET_POSITION:
        node->setpoint_fresh = true;
        break;
    default:
        drive_node_pdo_written(node, entry);
        break;
    }
}

const struct od_hooks drive_node_od_hooks = {
    .read = drive_node_read,
    .write = drive_node_write,
    .written = drive_node_written,
};
