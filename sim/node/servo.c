/* SPDX-License-Identifier: MIT */
/* Implements node/servo.h (see there): the CiA 402 part of a simulated drive, without its communication. Called by
 * node/drive_node, node/drive_pdos, node/drive_od and node/node_faults. No I/O, no heap. All functions in one context.
 */
#include "node/servo.h"

#define CONTROL_HOMING_START 0x0010u

enum { ABORT_NOTHING, ABORT_FAULT, ABORT_VOLTAGE_OFF, ABORT_QUICK_STOP }; /* 0x6007 */

int servo_init(struct servo *servo, const struct drive_config *config, int32_t position_counts,
               struct od_drive *values)
{
    struct equipment equipment;
    servo->values = values;
    const int error = axis_motion_init(&servo->axis, config, position_counts);
    if (error != 0) {
        return error;
    }
    equipment_init(&equipment, config);
    servo_equip(servo, &equipment);
    return 0;
}

void servo_equip(struct servo *servo, const struct equipment *equipment)
{
    servo->equipment = *equipment;
    servo->axis.rated_torque_nm = equipment->rated_torque_nm;
    servo->axis.brake_volts = equipment->brake_volts;
    servo->axis.influence.friction_volts = equipment->friction_volts;
    supervision_equip(&servo->supervision, equipment, &servo->axis.config.plant);
}

void servo_power_on(struct servo *servo)
{
    cia402_device_init(&servo->device);
    (void)cia402_device_ready(&servo->device);
    (void)axis_motion_set_scale(&servo->axis, 0.0);
    axis_motion_offsets(&servo->axis, 0, 0);
    drive_homing_leave(&servo->homing);
    axis_stop_reset(&servo->stop);
    servo->supervision.following_us = 0;
    servo->supervision.overloaded = false; /* an overload that persists trips again */
    servo->enabled_now = false;
    servo->setpoint_fresh = false;
    servo->limit_switch_hit = false;
    servo->software_limit = false;
}

/* ---- errors ---- */

/* An option code may have been written after the last controlword. */
static void take_options(struct servo *servo)
{
    struct cia402_options *options = &servo->device.options;
    options->quick_stop = servo->values->quick_stop_option_code;
    options->fault_reaction = servo->values->fault_reaction_option_code;
    options->shutdown = servo->values->shutdown_option_code;
    options->disable = servo->values->disable_operation_option_code;
}

void servo_fail(struct servo *servo, uint16_t code)
{
    take_options(servo);
    if (cia402_device_fault(&servo->device)) {
        axis_stop_reset(&servo->stop);
        drive_errors_report(&servo->errors, code, 0);
    }
}

/* The motor cannot stop the axis; the brake has to. In state Fault it is one more error, which is reported as well. */
void servo_fail_powerless(struct servo *servo, uint16_t code)
{
    const int16_t reaction = servo->device.options.fault_reaction;
    servo->device.options.fault_reaction = 0;
    if (servo->device.state == CIA402_FAULT_REACTION_ACTIVE) {
        (void)cia402_device_stopped(&servo->device);
    }
    if (cia402_device_fault(&servo->device)) {
        axis_stop_reset(&servo->stop);
    }
    drive_errors_report(&servo->errors, code, 0);
    servo->device.options.fault_reaction = reaction;
}

void servo_check_causes(struct servo *servo)
{
    if (servo->supervision.encoder_failed) {
        servo_fail_powerless(servo, EMCY_POSITION_SENSOR_1);
    }
    if (servo->supervision.supply_failed) {
        servo_fail_powerless(servo, EMCY_DC_UNDERVOLTAGE);
    }
}

static void quick_stop(struct servo *servo, uint16_t code, uint8_t detail)
{
    take_options(servo);
    if (servo->device.state == CIA402_OPERATION_ENABLED) {
        axis_stop_reset(&servo->stop);
        drive_errors_report(&servo->errors, code, detail);
        (void)cia402_device_quick_stop(&servo->device);
    }
}

void servo_disconnect(struct servo *servo, uint16_t code)
{
    if (servo->device.state != CIA402_OPERATION_ENABLED) {
        return;
    }
    servo->values->simulation.reproducible = 0;
    switch (servo->values->abort_connection_option_code) {
    case ABORT_NOTHING:
        drive_errors_report(&servo->errors, code, 0);
        break;
    case ABORT_FAULT:
        servo_fail(servo, code);
        break;
    case ABORT_VOLTAGE_OFF:
        drive_errors_report(&servo->errors, code, 0);
        (void)cia402_device_power_off(&servo->device);
        break;
    default:
        quick_stop(servo, code, 0);
        break;
    }
}

static void clear_errors(struct servo *servo)
{
    servo->supervision.following_us = 0;
    servo->limit_switch_hit = false;
    drive_errors_clear(&servo->errors);
}

/* ---- controlword and mode ---- */

/* Operation enabled begins. A drive that is enabled manually, without a setpoint, stays at its position. */
static void begin_operation(struct servo *servo)
{
    servo->values->simulation.reproducible = 1;
    servo->enabled_now = true;
    clear_errors(servo);
    axis_stop_reset(&servo->stop);
    if (!servo->setpoint_fresh) {
        servo->values->target_position = servo->axis.target_counts;
    }
}

/* False too at power-on: mode 0, no mode. */
static bool follows_setpoints(const struct servo *servo)
{
    return servo->values->modes_of_operation_display == CIA402_MODE_CSP;
}

static bool homes(const struct servo *servo)
{
    return servo->values->modes_of_operation_display == CIA402_MODE_HOMING;
}

void servo_control(struct servo *servo, uint16_t controlword)
{
    struct cia402_device *device = &servo->device;
    const bool was_fault = device->state == CIA402_FAULT;
    const bool was_enabled = device->state == CIA402_OPERATION_ENABLED;
    servo->values->controlword = controlword;
    take_options(servo);
    device->fault_persists = was_fault && supervision_cause_persists(&servo->supervision);
    const bool changed = cia402_device_control(device, controlword);
    if (changed && was_fault) {
        clear_errors(servo);
    }
    if (changed && !was_enabled && cia402_device_action(device) == CIA402_FOLLOW) {
        begin_operation(servo);
    }
    drive_homing_control(&servo->homing, (controlword & CONTROL_HOMING_START) != 0,
                         homes(servo) && cia402_device_action(device) == CIA402_FOLLOW,
                         servo->values->homing_method, &servo->axis);
}

bool servo_mode_may_change(const struct servo *servo)
{
    switch (cia402_device_action(&servo->device)) {
    case CIA402_POWER_OFF:
    case CIA402_HOLD:
        return true;
    case CIA402_FOLLOW:
        return servo->axis.speed_counts_period == 0 && !drive_homing_busy(&servo->homing);
    default:
        return false;
    }
}

void servo_take_mode(struct servo *servo)
{
    struct od_drive *v = servo->values;
    const int8_t requested = v->modes_of_operation;
    if (requested == v->modes_of_operation_display ||
        (requested != CIA402_MODE_CSP && requested != CIA402_MODE_HOMING) ||
        !servo_mode_may_change(servo)) {
        return;
    }
    drive_homing_leave(&servo->homing);
    v->modes_of_operation_display = requested;
    if (!servo->setpoint_fresh) {
        v->target_position = servo->axis.target_counts;
    }
}

/* ---- one period ---- */

/* The setpoint within the software limits 0x607D. */
static int32_t limited_target(struct servo *servo)
{
    const int32_t requested = servo->values->target_position;
    const int32_t low = servo->values->software_position_limit[0];
    const int32_t high = servo->values->software_position_limit[1];
    const int32_t target = requested < low ? low : (requested > high ? high : requested);
    servo->software_limit = target != requested;
    return target;
}

/* Velocity and torque offset 0x60B1, 0x60B2 of this period. */
static void set_offsets(struct servo *servo, bool on)
{
    const int32_t speed = on ? servo->values->velocity_offset : 0;
    const int16_t torque = on ? servo->values->torque_offset : 0;
    const bool act = speed != 0 || torque != 0;
    if (act || servo->offsets_act) {
        axis_motion_offsets(&servo->axis, speed, torque);
    }
    servo->offsets_act = act;
}

/* Whether the limit switch of this direction is on. */
static bool at_limit_switch(uint32_t inputs, int64_t change_counts)
{
    return (change_counts < 0 && (inputs & EQUIPMENT_INPUT_NEGATIVE) != 0) ||
           (change_counts > 0 && (inputs & EQUIPMENT_INPUT_POSITIVE) != 0);
}

/* One period in CSP. Returns false when the setpoint leads further onto a limit switch: nothing has moved yet. */
static bool follow_setpoint(struct servo *servo)
{
    const int32_t target = limited_target(servo);
    const int64_t change_counts = (int64_t)target - servo->axis.target_counts;
    if (at_limit_switch(servo->values->digital_inputs, change_counts)) {
        servo->limit_switch_hit = true;
        quick_stop(servo, EMCY_POSITION_LIMIT, change_counts < 0 ? 1 : 2);
        return false;
    }
    set_offsets(servo, true);
    axis_motion_follow(&servo->axis, target);
    return true;
}

static void home(struct servo *servo)
{
    const bool steady = drive_homing_move(&servo->homing, &servo->axis, servo->values);
    servo_refresh_inputs(servo);
    if (drive_homing_evaluate(&servo->homing, &servo->axis, servo->values, steady)) {
        servo->values->target_position = servo->axis.target_counts;
    }
}

static void stop_by_option(struct servo *servo, int16_t option_code)
{
    if (axis_stop_by_option(&servo->stop, &servo->axis, servo->values, option_code)) {
        (void)cia402_device_stopped(&servo->device);
    }
}

static void slow_down(struct servo *servo)
{
    if (axis_stop_ramp(&servo->stop, &servo->axis, servo->values,
                       servo->values->profile_deceleration)) {
        (void)cia402_device_stopped(&servo->device);
    }
}

/* One period without setpoints. */
static void move_by_itself(struct servo *servo, enum cia402_action action)
{
    set_offsets(servo, false);
    switch (action) {
    case CIA402_FOLLOW:
        home(servo);
        break;
    case CIA402_SLOW_DOWN:
        slow_down(servo);
        break;
    case CIA402_STOP_QUICKLY:
        stop_by_option(servo, servo->values->quick_stop_option_code);
        break;
    case CIA402_STOP_FOR_FAULT:
        stop_by_option(servo, servo->values->fault_reaction_option_code);
        break;
    default:
        axis_stop_reset(&servo->stop);
        (void)axis_motion_hold(&servo->axis);
        break;
    }
}

static void move(struct servo *servo)
{
    const enum cia402_action action = cia402_device_action(&servo->device);
    if (action != CIA402_FOLLOW || homes(servo)) {
        move_by_itself(servo, action);
    } else if (!follows_setpoints(servo)) {
        move_by_itself(servo, CIA402_HOLD);
    } else if (!follow_setpoint(servo)) {
        move_by_itself(servo, cia402_device_action(&servo->device));
    }
}

static void supervise(struct servo *servo)
{
    const enum cia402_action action = cia402_device_action(&servo->device);
    const bool following =
        action == CIA402_FOLLOW || action == CIA402_SLOW_DOWN || action == CIA402_STOP_QUICKLY;
    servo_refresh_inputs(servo);
    const uint16_t code =
        supervision_step(&servo->supervision, &servo->axis, servo->values, following);
    if (code == EMCY_OVERLOAD) {
        servo_fail_powerless(servo, code);
    } else if (code != EMCY_NO_ERROR) {
        servo_fail(servo, code);
    }
}

void servo_step(struct servo *servo)
{
    servo_take_mode(servo);
    move(servo);
    supervise(servo);
    servo->setpoint_fresh = false;
    servo->values->simulation.periods++;
}

/* ---- results ---- */

/* CiA 402-2, homing: bit 12 attained, 13 error, 10 at standstill. */
static uint16_t homing_flags(const struct servo *servo)
{
    const uint16_t reached =
        servo->axis.speed_counts_period == 0 ? CIA402_STATUS_TARGET_REACHED : 0;
    switch (servo->homing.phase) {
    case DRIVE_HOMING_IDLE:
        return servo->homing.homed ? reached | CIA402_STATUS_FOLLOWS : reached;
    case DRIVE_HOMING_DONE:
        return CIA402_STATUS_FOLLOWS | CIA402_STATUS_TARGET_REACHED;
    case DRIVE_HOMING_FAILED:
        return CIA402_STATUS_FOLLOWING_ERROR | reached;
    default:
        return 0;
    }
}

/* CSP: bit 12 follows the command value, 13 following error. */
static uint16_t csp_flags(const struct servo *servo)
{
    const bool follows = cia402_device_action(&servo->device) == CIA402_FOLLOW &&
                         follows_setpoints(servo) && !servo->software_limit &&
                         !servo->limit_switch_hit;
    const bool error = servo->values->error_code == EMCY_FOLLOWING_ERROR;
    return (uint16_t)((follows ? CIA402_STATUS_FOLLOWS : 0u) |
                      (error ? CIA402_STATUS_FOLLOWING_ERROR : 0u));
}

static bool internal_limit_active(const struct servo *servo)
{
    const double volts = servo->axis.drive.state.volts;
    const double limit = servo->axis.influence.volts_limit;
    return servo->software_limit || servo->limit_switch_hit || volts >= limit || volts <= -limit;
}

/* Bits that depend on neither state nor mode. */
static uint16_t general_flags(const struct servo *servo)
{
    const bool warning = supervision_warning(&servo->supervision, servo->values->digital_inputs);
    return (uint16_t)(CIA402_STATUS_REMOTE |
                      (servo->supervision.supply_failed ? 0u : CIA402_STATUS_VOLTAGE) |
                      (warning ? CIA402_STATUS_WARNING : 0u));
}

static uint16_t statusword(struct servo *servo)
{
    const uint16_t mode = homes(servo) ? homing_flags(servo) : csp_flags(servo);
    servo->device.flags = general_flags(servo);
    return (uint16_t)(cia402_device_statusword(&servo->device) | mode |
                      (internal_limit_active(servo) ? CIA402_STATUS_LIMIT : 0u));
}

void servo_refresh_inputs(struct servo *servo)
{
    servo->values->digital_inputs =
        equipment_inputs(&servo->equipment, axis_motion_place_mm(&servo->axis)) |
        servo->supervision.forced_inputs;
}

void servo_refresh_cyclic(struct servo *servo)
{
    struct od_drive *v = servo->values;
    v->statusword = statusword(servo);
    v->position_actual_value = axis_motion_position(&servo->axis);
    v->motor_voltage = drive_volts_mv(&servo->axis.drive);
}

static int16_t permille(double ratio)
{
    const int32_t value = encoder_to_i32(1000.0 * ratio);
    const int32_t low = value < INT16_MIN ? INT16_MIN : value;
    return (int16_t)(low > INT16_MAX ? INT16_MAX : low);
}

void servo_refresh(struct servo *servo)
{
    struct od_drive *v = servo->values;
    const struct drive *drive = &servo->axis.drive;
    servo_refresh_cyclic(servo);
    v->position_demand_value = servo->axis.target_counts;
    v->position_actual_internal_value = encoder_to_i32(
        influence_read_mm(&servo->axis.influence, drive) * drive->encoder.increments_per_mm);
    v->following_error_actual_value =
        encoder_to_i32((double)v->position_demand_value - (double)v->position_actual_value);
    v->velocity_actual_value = axis_motion_speed(&servo->axis);
    v->torque_actual_value = permille(drive->state.volts * servo->supervision.load_per_volt);
    v->current_actual_value = v->torque_actual_value;
    v->simulation.parked = drive_parked(drive) ? 1 : 0;
    v->simulation.overload = overload_permille(&servo->supervision.overload);
}
