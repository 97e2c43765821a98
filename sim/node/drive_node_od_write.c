/* SPDX-License-Identifier: MIT */
#include "canopen/cob.h"
#include "canopen/sdo_abort.h"
#include "node/drive_node_private.h"

/* The period that 0x60C2 gives, us; 0 when it is no such number. */
static uint32_t drive_node_period_us(uint32_t value, int32_t exponent)
{
    uint32_t period_us = value;
    for (int32_t i = -6; i < exponent; i++) {
        period_us *= 10u;
    }
    return exponent < -6 || exponent > 0 ? 0 : period_us;
}

/* The period that the model would have after the write. */
static uint32_t drive_node_asked_period(const struct drive_node *node, const struct od_entry *entry,
                                        uint32_t number)
{
    if (entry->index == OD_DRIVE_COMMUNICATION_CYCLE_PERIOD) {
        return number;
    }
    if (entry->sub == 1) {
        return drive_node_period_us(
            number, node->values.interpolation_time_period.interpolation_time_index);
    }
    return drive_node_period_us(
        node->values.interpolation_time_period.interpolation_time_period_value,
        (int32_t)cob_signed(number, entry->size));
}

static uint32_t drive_node_period_write(struct drive_node *node, const struct od_entry *entry,
                                        uint32_t number)
{
    const uint32_t period_us = drive_node_asked_period(node, entry, number);
    if (cia402_device_action(&node->device) != CIA402_POWER_OFF) {
        return SDO_ABORT_STATE;
    }
    if (entry->index == OD_DRIVE_COMMUNICATION_CYCLE_PERIOD && period_us == 0) {
        return SDO_OK;
    }
    return axis_motion_set_period(&node->axis, period_us) == 0 ? SDO_OK : SDO_ABORT_VALUE;
}

static uint32_t drive_node_mode_write(const struct drive_node *node, int64_t mode)
{
    if (mode != 0 && mode != CIA402_MODE_CSP && mode != CIA402_MODE_HOMING) {
        return SDO_ABORT_VALUE;
    }
    return mode == 0 || mode == node->values.modes_of_operation_display ||
                   drive_node_mode_may_change(node)
               ? SDO_OK
               : SDO_ABORT_STATE;
}

/* CiA 301: the counter may change only while 0x1006 is 0; 1 is no overflow value. */
static uint32_t drive_node_counter_write(const struct drive_node *node, uint32_t value)
{
    if (value == node->values.synchronous_counter_overflow_value) {
        return SDO_OK;
    }
    if (value == 1) {
        return SDO_ABORT_VALUE;
    }
    return node->values.communication_cycle_period == 0 ? SDO_OK : SDO_ABORT_STATE;
}

uint32_t drive_node_od_write(void *context, const struct od_entry *entry, const uint8_t *value,
                             uint32_t size)
{
    struct drive_node *node = context;
    const uint32_t number = (uint32_t)cob_get(value, size);
    switch (entry->index) {
    case OD_DRIVE_PREDEFINED_ERROR_FIELD:
        return number == 0 ? SDO_OK : SDO_ABORT_VALUE;
    case OD_DRIVE_COMMUNICATION_CYCLE_PERIOD:
    case OD_DRIVE_INTERPOLATION_TIME_PERIOD:
        return drive_node_period_write(node, entry, number);
    case OD_DRIVE_SYNCHRONOUS_COUNTER_OVERFLOW_VALUE:
        return drive_node_counter_write(node, number);
    case OD_DRIVE_MODES_OF_OPERATION:
        return drive_node_mode_write(node, cob_signed(number, size));
    case OD_DRIVE_HOMING_METHOD:
        return home_seek_supports((int8_t)cob_signed(number, size)) ? SDO_OK : SDO_ABORT_VALUE;
    case OD_DRIVE_POSITION_ENCODER_RESOLUTION:
    case OD_DRIVE_GEAR_RATIO:
    case OD_DRIVE_FEED_CONSTANT:
        return drive_node_scale_write(node, entry, number);
    default:
        return drive_node_pdo_write(node, entry, value, size);
    }
}

void drive_node_od_written(void *context, const struct od_entry *entry)
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
    case OD_DRIVE_MODES_OF_OPERATION:
        drive_node_mode_take(node);
        break;
    case OD_DRIVE_GEAR_RATIO:
    case OD_DRIVE_FEED_CONSTANT:
        node->values.target_position = node->axis.target_counts;
        break;
    case OD_DRIVE_TARGET_POSITION:
        node->setpoint_fresh = true;
        break;
    default:
        drive_node_pdo_written(node, entry);
        break;
    }
}
