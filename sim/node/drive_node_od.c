/* SPDX-License-Identifier: MIT */
#include "canopen/sdo_abort.h"
#include "node/drive_node_private.h"

static const double overload_warning = 0.8; /* of the level that trips */

static uint32_t drive_node_u32(double value)
{
    return value < (double)UINT32_MAX ? (uint32_t)(value + 0.5) : UINT32_MAX;
}

void drive_node_od_fill(struct drive_node *node)
{
    struct od_drive *v = &node->values;
    const struct drive_config *c = &node->axis.config;
    od_drive_set_node(v, node->id);
    v->identity_object.vendor_id = node->equipment.vendor;
    v->identity_object.serial_number = node->equipment.serial;
    v->position_encoder_resolution[0] = c->encoder_counts_per_rev;
    if (node->axis.drive.counts_per_mm == (double)c->counts_per_mm) {
        v->feed_constant[0] = drive_node_u32(drive_node_scale_feed(node));
    }
    v->communication_cycle_period = c->period_us;
    v->target_position = node->axis.target_counts;
    v->motor_rated_torque = drive_node_u32(1000.0 * node->equipment.rated_torque_nm);
    v->motor_rated_current = drive_node_u32(1000.0 * node->equipment.rated_current_a);
    drive_node_inputs(node);
}

static bool drive_node_warns(const struct drive_node *node)
{
    const uint32_t ends = EQUIPMENT_INPUT_NEGATIVE | EQUIPMENT_INPUT_POSITIVE;
    return (node->values.digital_inputs & ends) != 0 ||
           overload_above(&node->overload, overload_warning);
}

static uint16_t drive_node_statusword(struct drive_node *node)
{
    const uint16_t flags =
        (uint16_t)(CIA402_STATUS_REMOTE | (node->supply_failed ? 0u : CIA402_STATUS_VOLTAGE) |
                   (drive_node_warns(node) ? CIA402_STATUS_WARNING : 0u));
    node->device.flags = flags;
    return (uint16_t)(cia402_device_statusword(&node->device) | drive_node_mode_flags(node));
}

void drive_node_od_refresh_cyclic(struct drive_node *node)
{
    struct od_drive *v = &node->values;
    v->statusword = drive_node_statusword(node);
    v->position_actual_value = axis_motion_position(&node->axis);
    v->motor_voltage = drive_volts_mv(&node->axis.drive);
}

static int16_t drive_node_permille(double ratio)
{
    const int32_t permille = encoder_to_i32(1000.0 * ratio);
    const int32_t low = permille < INT16_MIN ? INT16_MIN : permille;
    return (int16_t)(low > INT16_MAX ? INT16_MAX : low);
}

void drive_node_od_refresh(struct drive_node *node)
{
    struct od_drive *v = &node->values;
    const struct drive *drive = &node->axis.drive;
    const double load = drive->state.volts * node->load_per_volt;
    drive_node_od_refresh_cyclic(node);
    v->position_demand_value = node->axis.target_counts;
    v->position_actual_internal_value = encoder_to_i32(
        influence_read_mm(&node->axis.influence, drive) * drive->encoder.increments_per_mm);
    v->following_error_actual_value =
        encoder_to_i32((double)v->position_demand_value - (double)v->position_actual_value);
    v->velocity_actual_value = axis_motion_speed(&node->axis);
    v->torque_actual_value = drive_node_permille(load);
    v->current_actual_value = v->torque_actual_value;
    v->simulation.parked = drive_parked(drive) ? 1 : 0;
    v->simulation.overload = overload_permille(&node->overload);
}

static uint32_t drive_node_od_read(void *context, const struct od_entry *entry)
{
    (void)entry;
    drive_node_od_refresh(context);
    return SDO_OK;
}

const struct od_hooks drive_node_od_hooks = {
    .read = drive_node_od_read,
    .write = drive_node_od_write,
    .written = drive_node_od_written,
};
