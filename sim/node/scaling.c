/* SPDX-License-Identifier: MIT */
/* Implements node/scaling.h (see there): bus counts per mm of a simulated drive, from encoder resolution 0x608F, gear
 * ratio 0x6091 and feed constant 0x6092. Used by node/drive_od. All in one context. Changes the axis that it is given;
 * no I/O. */
#include "node/scaling.h"

#include "canopen/sdo_abort.h"

/* Numerators and denominators, subs 1 and 2. */
struct ratios {
    uint32_t gear[2]; /* 0x6091: motor, shaft revolutions */
    uint32_t feed[2]; /* 0x6092: counts, shaft revolutions */
};

static double mm_per_revolution(const struct axis_motion *axis)
{
    return 6.283185307179586476925 * axis->config.plant.screw_mm_rad;
}

double scaling_own_feed(const struct axis_motion *axis)
{
    return mm_per_revolution(axis) * (double)axis->config.counts_per_mm;
}

/* Counts per mm; 0: those of the configuration. */
static double counts_per_mm(const struct axis_motion *axis, const struct ratios *r)
{
    const uint64_t own_feed = (uint64_t)(scaling_own_feed(axis) + 0.5);
    if (r->gear[0] == r->gear[1] && r->feed[0] == own_feed * r->feed[1]) {
        return 0.0;
    }
    const double shaft = (double)r->gear[1] / (double)r->gear[0];
    return (double)r->feed[0] / (double)r->feed[1] * shaft / mm_per_revolution(axis);
}

uint32_t scaling_write_encoder(const struct axis_motion *axis, uint8_t sub, uint32_t value)
{
    const uint32_t own = sub == 1 ? axis->config.encoder_counts_per_rev : 1u;
    return value == own ? SDO_OK : SDO_ABORT_VALUE;
}

static struct ratios present(const struct od_drive *values)
{
    return (struct ratios){.gear = {values->gear_ratio[0], values->gear_ratio[1]},
                           .feed = {values->feed_constant[0], values->feed_constant[1]}};
}

/* `changed` is one of the ratios. */
static uint32_t change(struct axis_motion *axis, const struct ratios *ratios, uint32_t *changed,
                       uint32_t value, bool permitted)
{
    if (*changed == value) {
        return SDO_OK;
    }
    if (!permitted || !axis_motion_at_standstill(axis)) {
        return SDO_ABORT_STATE;
    }
    *changed = value;
    return axis_motion_set_scale(axis, counts_per_mm(axis, ratios)) ? SDO_OK : SDO_ABORT_VALUE;
}

uint32_t scaling_write_gear(struct axis_motion *axis, const struct od_drive *values, uint8_t sub,
                            uint32_t value, bool permitted)
{
    struct ratios ratios = present(values);
    return change(axis, &ratios, &ratios.gear[sub == 2 ? 1 : 0], value, permitted);
}

uint32_t scaling_write_feed(struct axis_motion *axis, const struct od_drive *values, uint8_t sub,
                            uint32_t value, bool permitted)
{
    struct ratios ratios = present(values);
    return change(axis, &ratios, &ratios.feed[sub == 2 ? 1 : 0], value, permitted);
}
