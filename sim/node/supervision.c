/* SPDX-License-Identifier: MIT */
/* Implements node/supervision.h (see there): what a simulated drive supervises in each period. Used by node/servo. All
 * in one context. Changes only its struct; no I/O. */
#include "node/supervision.h"

#include "canopen/emcy.h"

static const double overload_warning = 0.8; /* of the level that trips */

/* A tripped overload accepts a reset when it has cooled down to this. */
static const double overload_cool = 0.8;

void supervision_equip(struct supervision *supervision, const struct equipment *equipment,
                       const struct drive_plant *plant)
{
    const double rated_volts = equipment->rated_torque_nm * plant->torque_to_volts;
    supervision->load_per_volt = 1.0 / rated_volts;
    overload_init(&supervision->overload, plant->volts_limit / rated_volts, equipment->overload_s);
}

static bool overload_trips(struct supervision *supervision, const struct axis_motion *axis)
{
    if (supervision->overload.level_s <= 0.0) {
        return false;
    }
    const bool before = supervision->overloaded;
    overload_step(&supervision->overload, axis->drive.state.volts * supervision->load_per_volt,
                  (double)axis->config.period_us * 1e-6);
    supervision->overloaded = overload_above(&supervision->overload, 1.0);
    return supervision->overloaded && !before;
}

static bool following_error(struct supervision *supervision, const struct axis_motion *axis,
                            const struct od_drive *values)
{
    if (values->following_error_window == UINT32_MAX) {
        return false;
    }
    if (axis_motion_settled(axis, values->following_error_window)) {
        supervision->following_us = 0;
        return false;
    }
    supervision->following_us += axis->config.period_us;
    return supervision->following_us > 1000u * (uint32_t)values->following_error_time_out;
}

uint16_t supervision_step(struct supervision *supervision, const struct axis_motion *axis,
                          const struct od_drive *values, bool following)
{
    const bool trips = overload_trips(supervision, axis);
    const bool lags = following && following_error(supervision, axis, values);
    if (trips) {
        return EMCY_OVERLOAD;
    }
    return lags ? EMCY_FOLLOWING_ERROR : EMCY_NO_ERROR;
}

bool supervision_warning(const struct supervision *supervision, uint32_t inputs)
{
    const uint32_t ends = EQUIPMENT_INPUT_NEGATIVE | EQUIPMENT_INPUT_POSITIVE;
    return (inputs & ends) != 0 || overload_above(&supervision->overload, overload_warning);
}

bool supervision_cause_persists(const struct supervision *supervision)
{
    return supervision->encoder_failed || supervision->supply_failed ||
           overload_above(&supervision->overload, overload_cool);
}
