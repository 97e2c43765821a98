/* SPDX-License-Identifier: MIT */
/* Implements node/drive_od.h (see there): the behaviour of the object dictionary of a simulated drive (drive.eds). Used
 * by node/drive_node. All in one context. Changes the node that it is given; no I/O. */
#include "node/drive_od.h"

#include <stddef.h>
#include <string.h>

#include "canopen/cob.h"
#include "canopen/sdo_abort.h"
#include "node/scaling.h"

static uint32_t rounded_u32(double value)
{
    return value < (double)UINT32_MAX ? (uint32_t)(value + 0.5) : UINT32_MAX;
}

void drive_od_fill(struct drive_node *node)
{
    struct od_drive *v = &node->values;
    struct servo *servo = &node->servo;
    const struct drive_config *c = &servo->axis.config;
    od_drive_set_node(v, node->id);
    v->identity_object.vendor_id = servo->equipment.vendor;
    v->identity_object.serial_number = servo->equipment.serial;
    v->position_encoder_resolution[0] = c->encoder_counts_per_rev;
    if (servo->axis.drive.counts_per_mm == (double)c->counts_per_mm) {
        v->feed_constant[0] = rounded_u32(scaling_own_feed(&servo->axis));
    }
    v->communication_cycle_period = c->period_us;
    v->target_position = servo->axis.target_counts;
    v->motor_rated_torque = rounded_u32(1000.0 * servo->equipment.rated_torque_nm);
    v->motor_rated_current = rounded_u32(1000.0 * servo->equipment.rated_current_a);
    servo_refresh_inputs(servo);
}

void drive_od_reset_communication(struct drive_node *node)
{
    od_reset_communication(&node->od, &od_drive_defaults);
}

/* ---- handlers: _check before the value is stored, _changed after it ---- */

/* A write, for the checks. */
struct od_request {
    const struct od_entry *entry;
    const uint8_t *bytes;
    uint32_t size;
    uint32_t number; /* unsigned */
};

static int64_t signed_number(const struct od_request *request)
{
    return cob_signed(request->number, request->size);
}

static uint32_t history_check(struct drive_node *node, const struct od_request *request)
{
    (void)node;
    return request->number == 0 ? SDO_OK : SDO_ABORT_VALUE;
}

static void history_changed(struct drive_node *node, const struct od_entry *entry)
{
    (void)entry;
    emcy_producer_forget(&node->servo.errors.emcy);
}

static void consumer_heartbeat_changed(struct drive_node *node, const struct od_entry *entry)
{
    (void)entry;
    heartbeat_consumer_init_entry(&node->master, node->values.consumer_heartbeat_time[0]);
}

/* CiA 301: the counter may change only while 0x1006 is 0; 1 is no overflow value. */
static uint32_t sync_counter_check(struct drive_node *node, const struct od_request *request)
{
    if (request->number == node->values.synchronous_counter_overflow_value) {
        return SDO_OK;
    }
    if (request->number == 1) {
        return SDO_ABORT_VALUE;
    }
    return node->values.communication_cycle_period == 0 ? SDO_OK : SDO_ABORT_STATE;
}

static void sync_counter_changed(struct drive_node *node, const struct od_entry *entry)
{
    (void)entry;
    sync_clock_reset_counter(&node->clock, node->values.synchronous_counter_overflow_value);
}

static bool has_no_power(const struct drive_node *node)
{
    return cia402_device_action(&node->servo.device) == CIA402_POWER_OFF;
}

static uint32_t set_period(struct drive_node *node, uint32_t period_us)
{
    if (!has_no_power(node)) {
        return SDO_ABORT_STATE;
    }
    return axis_motion_set_period(&node->servo.axis, period_us) == 0 ? SDO_OK : SDO_ABORT_VALUE;
}

/* 0: the period stays. */
static uint32_t cycle_period_check(struct drive_node *node, const struct od_request *request)
{
    if (request->number == 0) {
        return has_no_power(node) ? SDO_OK : SDO_ABORT_STATE;
    }
    return set_period(node, request->number);
}

/* The period that 0x60C2 gives, us; 0 when it is no such number. */
static uint32_t interpolation_period_us(uint32_t value, int32_t exponent)
{
    uint32_t period_us = value;
    for (int32_t i = -6; i < exponent; i++) {
        period_us *= 10u;
    }
    return exponent < -6 || exponent > 0 ? 0 : period_us;
}

static uint32_t interpolation_period_check(struct drive_node *node,
                                           const struct od_request *request)
{
    const struct od_drive *v = &node->values;
    if (request->entry->sub == 1) {
        return set_period(
            node, interpolation_period_us(request->number,
                                          v->interpolation_time_period.interpolation_time_index));
    }
    return set_period(
        node, interpolation_period_us(v->interpolation_time_period.interpolation_time_period_value,
                                      (int32_t)signed_number(request)));
}

static void controlword_changed(struct drive_node *node, const struct od_entry *entry)
{
    (void)entry;
    servo_control(&node->servo, node->values.controlword);
}

static uint32_t mode_check(struct drive_node *node, const struct od_request *request)
{
    const int64_t mode = signed_number(request);
    if (mode != 0 && mode != CIA402_MODE_CSP && mode != CIA402_MODE_HOMING) {
        return SDO_ABORT_VALUE;
    }
    const bool permitted = mode == 0 || mode == node->values.modes_of_operation_display ||
                           servo_mode_may_change(&node->servo);
    return permitted ? SDO_OK : SDO_ABORT_STATE;
}

static void mode_changed(struct drive_node *node, const struct od_entry *entry)
{
    (void)entry;
    servo_take_mode(&node->servo);
}

static void target_changed(struct drive_node *node, const struct od_entry *entry)
{
    (void)entry;
    node->servo.setpoint_fresh = true;
}

static uint32_t homing_method_check(struct drive_node *node, const struct od_request *request)
{
    (void)node;
    return drive_homing_supports((int8_t)signed_number(request)) ? SDO_OK : SDO_ABORT_VALUE;
}

static uint32_t encoder_check(struct drive_node *node, const struct od_request *request)
{
    return scaling_write_encoder(&node->servo.axis, request->entry->sub, request->number);
}

static uint32_t gear_check(struct drive_node *node, const struct od_request *request)
{
    return scaling_write_gear(&node->servo.axis, &node->values, request->entry->sub,
                              request->number, has_no_power(node));
}

static uint32_t feed_check(struct drive_node *node, const struct od_request *request)
{
    return scaling_write_feed(&node->servo.axis, &node->values, request->entry->sub,
                              request->number, has_no_power(node));
}

static void scale_changed(struct drive_node *node, const struct od_entry *entry)
{
    (void)entry;
    node->values.target_position = node->servo.axis.target_counts;
}

static uint32_t pdo_check(struct drive_node *node, const struct od_request *request)
{
    return drive_pdos_write(&node->pdos, request->entry, request->bytes, request->size);
}

static void pdo_changed(struct drive_node *node, const struct od_entry *entry)
{
    drive_pdos_written(&node->pdos, entry);
}

/* Objects `first` to `last`; either handler may be NULL. */
struct handlers {
    uint16_t first;
    uint16_t last;
    uint32_t (*check)(struct drive_node *node, const struct od_request *request);
    void (*changed)(struct drive_node *node, const struct od_entry *entry);
};

#define OBJECT(name) OD_DRIVE_##name, OD_DRIVE_##name

static const struct handlers objects[] = {
    {OBJECT(PREDEFINED_ERROR_FIELD), history_check, history_changed},
    {OBJECT(COMMUNICATION_CYCLE_PERIOD), cycle_period_check, NULL},
    {OBJECT(CONSUMER_HEARTBEAT_TIME), NULL, consumer_heartbeat_changed},
    {OBJECT(SYNCHRONOUS_COUNTER_OVERFLOW_VALUE), sync_counter_check, sync_counter_changed},
    {0x1400, 0x1BFF, pdo_check, pdo_changed},
    {OBJECT(CONTROLWORD), NULL, controlword_changed},
    {OBJECT(MODES_OF_OPERATION), mode_check, mode_changed},
    {OBJECT(TARGET_POSITION), NULL, target_changed},
    {OBJECT(POSITION_ENCODER_RESOLUTION), encoder_check, NULL},
    {OBJECT(GEAR_RATIO), gear_check, scale_changed},
    {OBJECT(FEED_CONSTANT), feed_check, scale_changed},
    {OBJECT(HOMING_METHOD), homing_method_check, NULL},
    {OBJECT(INTERPOLATION_TIME_PERIOD), interpolation_period_check, NULL},
};

/* NULL: the object has none. */
static const struct handlers *handlers_of(const struct od_entry *entry)
{
    for (size_t i = 0; i < sizeof objects / sizeof objects[0]; i++) {
        if (entry->index >= objects[i].first && entry->index <= objects[i].last) {
            return &objects[i];
        }
    }
    return NULL;
}

/* ---- the od's hooks ---- */

static uint32_t on_read(void *context, const struct od_entry *entry)
{
    struct drive_node *node = context;
    (void)entry;
    servo_refresh(&node->servo);
    return SDO_OK;
}

static uint32_t on_write(void *context, const struct od_entry *entry, const uint8_t *value,
                         uint32_t size)
{
    struct drive_node *node = context;
    const struct od_request request = {entry, value, size, (uint32_t)cob_get(value, size)};
    const struct handlers *handlers = handlers_of(entry);
    return handlers != NULL && handlers->check != NULL ? handlers->check(node, &request) : SDO_OK;
}

static void on_written(void *context, const struct od_entry *entry)
{
    struct drive_node *node = context;
    const struct handlers *handlers = handlers_of(entry);
    if (handlers != NULL && handlers->changed != NULL) {
        handlers->changed(node, entry);
    }
}

const struct od_hooks drive_od_hooks = {
    .read = on_read,
    .write = on_write,
    .written = on_written,
};
