/* SPDX-License-Identifier: MIT */
/* Implements node/drive_homing.h (see there): the homing mode of a simulated drive. Called by node/servo and
 * node/drive_od. All in one context. Changes its struct and the axis that it is given; no I/O. */
#include "node/drive_homing.h"

#include <stddef.h>

#include "canopen/cia402.h"
#include "node/equipment.h"

enum { FAST, SLOW }; /* 0x6099 subs 1, 2 */

struct method {
    uint32_t inputs_switch;
    int8_t number;
    bool entering;
    int8_t direction;
};

static const struct method methods[] = {
    {EQUIPMENT_INPUT_NEGATIVE, 17, false, -1},
    {EQUIPMENT_INPUT_POSITIVE, 18, false, 1},
    {EQUIPMENT_INPUT_HOME, 19, false, 1},
    {EQUIPMENT_INPUT_HOME, 20, true, 1},
    {EQUIPMENT_INPUT_HOME, 21, false, -1},
    {EQUIPMENT_INPUT_HOME, 22, true, -1},
    {0, 35, false, 0},
    {0, 37, false, 0},
};

static const struct method *find_method(int8_t number)
{
    for (size_t i = 0; i < sizeof methods / sizeof methods[0]; i++) {
        if (methods[i].number == number) {
            return &methods[i];
        }
    }
    return NULL;
}

bool drive_homing_supports(int8_t method)
{
    return find_method(method) != NULL;
}

bool drive_homing_busy(const struct drive_homing *homing)
{
    return homing->phase >= DRIVE_HOMING_SEARCH && homing->phase <= DRIVE_HOMING_STOP;
}

void drive_homing_leave(struct drive_homing *homing)
{
    homing->phase = DRIVE_HOMING_IDLE;
    homing->start_bit = false;
}

static void interrupt(struct drive_homing *homing)
{
    if (drive_homing_busy(homing)) {
        homing->phase = DRIVE_HOMING_IDLE;
    }
}

static void begin(struct drive_homing *homing, int8_t number, const struct axis_motion *axis)
{
    const struct method *method = find_method(number);
    homing->homed = false;
    homing->edge_counts = axis_motion_position(axis);
    if (method == NULL) {
        homing->phase = DRIVE_HOMING_FAILED;
        return;
    }
    homing->inputs_switch = method->inputs_switch;
    homing->direction = method->direction;
    homing->entering = method->entering;
    homing->phase = method->direction == 0 ? DRIVE_HOMING_STOP : DRIVE_HOMING_SEARCH;
}

void drive_homing_control(struct drive_homing *homing, bool start_bit, bool permitted,
                          int8_t method, const struct axis_motion *axis)
{
    const bool rises = start_bit && !homing->start_bit;
    homing->start_bit = start_bit && permitted;
    if (!homing->start_bit) {
        interrupt(homing);
    } else if (rises) {
        begin(homing, method, axis);
    }
}

/* Counts a period, with sign. */
static int64_t phase_speed(const struct drive_homing *homing, const struct axis_motion *axis,
                           const struct od_drive *values)
{
    const bool search = homing->phase == DRIVE_HOMING_SEARCH;
    const bool back = homing->phase == DRIVE_HOMING_BACK;
    const int64_t counts_s = values->homing_speeds[search ? FAST : SLOW];
    const int64_t speed = counts_s * axis->config.period_us / 1000000;
    if (!(search || back || homing->phase == DRIVE_HOMING_APPROACH) ||
        (values->controlword & CIA402_CONTROL_HALT) != 0) {
        return 0;
    }
    return (speed > 0 ? speed : 1) * (back ? -homing->direction : homing->direction);
}

bool drive_homing_move(const struct drive_homing *homing, struct axis_motion *axis,
                       const struct od_drive *values)
{
    return axis_motion_ramp(axis, phase_speed(homing, axis, values), values->homing_acceleration);
}

/* At a limit switch that the method does not use: the home switch was not found. */
static bool at_wrong_end(const struct drive_homing *homing, uint32_t inputs)
{
    const bool back = homing->phase == DRIVE_HOMING_BACK;
    const bool positive = (homing->direction > 0) != back;
    const uint32_t end = positive ? EQUIPMENT_INPUT_POSITIVE : EQUIPMENT_INPUT_NEGATIVE;
    return (inputs & end) != 0 && end != homing->inputs_switch;
}

/* The phase that follows when the method's switch is on or off. */
static enum drive_homing_phase next_phase(const struct drive_homing *homing, bool on)
{
    switch (homing->phase) {
    case DRIVE_HOMING_SEARCH:
        return on ? DRIVE_HOMING_BACK : DRIVE_HOMING_SEARCH;
    case DRIVE_HOMING_BACK:
        return on ? DRIVE_HOMING_BACK
                  : (homing->entering ? DRIVE_HOMING_APPROACH : DRIVE_HOMING_STOP);
    default:
        return on ? DRIVE_HOMING_STOP : DRIVE_HOMING_APPROACH;
    }
}

static void evaluate_switches(struct drive_homing *homing, const struct axis_motion *axis,
                              uint32_t inputs)
{
    if (homing->phase < DRIVE_HOMING_SEARCH || homing->phase > DRIVE_HOMING_APPROACH) {
        return;
    }
    if (at_wrong_end(homing, inputs)) {
        homing->phase = DRIVE_HOMING_FAILED;
        return;
    }
    homing->phase = next_phase(homing, (inputs & homing->inputs_switch) != 0);
    if (homing->phase == DRIVE_HOMING_STOP) {
        homing->edge_counts = axis_motion_position(axis);
    }
}

bool drive_homing_evaluate(struct drive_homing *homing, struct axis_motion *axis,
                           const struct od_drive *values, bool steady)
{
    evaluate_switches(homing, axis, values->digital_inputs);
    if (drive_homing_busy(homing) &&
        (axis->target_counts == INT32_MAX || axis->target_counts == INT32_MIN)) {
        homing->phase = DRIVE_HOMING_FAILED;
    }
    if (homing->phase != DRIVE_HOMING_STOP || !steady ||
        !axis_motion_settled(axis, values->position_window)) {
        return false;
    }
    axis_motion_shift(axis, homing->edge_counts, values->home_offset);
    homing->phase = DRIVE_HOMING_DONE;
    homing->homed = true;
    return true;
}
