/* SPDX-License-Identifier: MIT */
/* Implements node/equipment.h (see there): limit switches, home switch and brake of a simulated axis. Used by sim/node
 * only. Any thread; equipment_init writes the caller's struct, the other functions change nothing. No I/O. */
#include "node/equipment.h"

void equipment_init(struct equipment *e, const struct drive_config *config)
{
    e->limit_negative_mm = -EQUIPMENT_NOWHERE;
    e->limit_positive_mm = EQUIPMENT_NOWHERE;
    e->home_from_mm = EQUIPMENT_NOWHERE;
    e->home_to_mm = -EQUIPMENT_NOWHERE;
    e->rated_torque_nm = drive_config_rated_torque_nm(config);
    e->rated_current_a = 5.0;
    e->overload_s = 10.0;
    e->friction_volts = 0.0;
    e->brake_volts = config->plant.volts_limit;
    e->serial = 0;
    e->vendor = 0;
}

const char equipment_rule[] =
    "limit_negative_mm must be below limit_positive_mm; rated_torque_nm, rated_current_a and "
    "brake_volts more than 0; overload_s and friction_volts not negative";

bool equipment_ok(const struct equipment *e)
{
    return e->limit_negative_mm < e->limit_positive_mm && e->rated_torque_nm > 0.0 &&
           e->rated_current_a > 0.0 && e->overload_s >= 0.0 && e->friction_volts >= 0.0 &&
           e->brake_volts > 0.0;
}

uint32_t equipment_inputs(const struct equipment *e, double machine_mm)
{
    uint32_t inputs = 0;
    if (machine_mm <= e->limit_negative_mm) {
        inputs |= EQUIPMENT_INPUT_NEGATIVE;
    }
    if (machine_mm >= e->limit_positive_mm) {
        inputs |= EQUIPMENT_INPUT_POSITIVE;
    }
    if (machine_mm >= e->home_from_mm && machine_mm <= e->home_to_mm) {
        inputs |= EQUIPMENT_INPUT_HOME;
    }
    return inputs;
}
