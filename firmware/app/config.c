/* SPDX-License-Identifier: MIT */
#include "app/config.h"

#include "core/qmath.h"

static uint64_t number(const struct od *od, uint16_t index, uint8_t sub)
{
    const struct od_entry *entry = od_find(od, index, sub);
    return entry != NULL ? od_number(od, entry) : 0u;
}

void config_read(struct config *config, const struct od *od)
{
    config->period_us = (uint32_t)number(od, 0x1006, 0);
    config->axis_count = (uint8_t)number(od, 0x2004, 1);
    config->feed_limit_um_s = (uint32_t)number(od, 0x2004, 2);
    config->acceleration_limit_um_s2 = (uint32_t)number(od, 0x2004, 3);
    config->jerk_limit_mm_s3 = (uint32_t)number(od, 0x2004, 4);
    config->kernel = (uint8_t)number(od, 0x2004, 5);
    config->start_tolerance_counts = (uint32_t)number(od, 0x2004, 6);
    config->counts_per_mm = (uint32_t)number(od, 0x2004, 7);
    for (uint8_t i = 0; i < AXES_MAX; ++i) {
        const uint8_t sub = (uint8_t)(i + 1u);
        config->node[i] = (uint8_t)number(od, 0x2005, sub);
        config->travel_min_counts[i] = (int32_t)(uint32_t)number(od, 0x2006, sub);
        config->travel_max_counts[i] = (int32_t)(uint32_t)number(od, 0x2007, sub);
    }
}

bool config_value_allowed(uint16_t index, uint8_t sub, uint64_t value)
{
    if (index == 0x1006) {
        return value == 1000u || value == 2000u || value == 4000u || value == 8000u;
    }
    if (index == 0x2004 && sub == 7) {
        return value >= 1u && value <= CONFIG_COUNTS_PER_MM_MAX;
    }
    return true;
}

bool config_concerns_drives(uint16_t index, uint8_t sub)
{
    return index != 0x2004 || sub == 1;
}

bool config_contains(uint16_t index)
{
    return index == 0x1006 || (index >= 0x2004 && index <= 0x2007);
}

/* magnitude * 2^40 / counts_per_mm; rest < counts_per_mm <= 2^23 keeps the shift inside. */
static uint64_t q40_from_magnitude(uint32_t magnitude, uint32_t counts_per_mm, bool round_up)
{
    const uint64_t whole = magnitude / counts_per_mm;
    const uint64_t rest = magnitude % counts_per_mm;
    const uint64_t bias = round_up ? counts_per_mm - 1u : 0u;
    return (whole << 40) + qmath_div_u64((rest << 40) + bias, counts_per_mm);
}

static int64_t q40_from_counts(int32_t counts, uint32_t counts_per_mm, bool upwards)
{
    const bool negative = counts < 0;
    const uint32_t magnitude = negative ? 0u - (uint32_t)counts : (uint32_t)counts;
    const uint64_t q40 = q40_from_magnitude(magnitude, counts_per_mm, upwards != negative);
    return negative ? -(int64_t)q40 : (int64_t)q40;
}

void config_limits(const struct config *config, struct program_limits *limits)
{
    limits->period_us = config->period_us;
    limits->feed_um_s = config->feed_limit_um_s;
    limits->acceleration_um_s2 = config->acceleration_limit_um_s2;
    limits->jerk_mm_s3 = config->jerk_limit_mm_s3;
    for (uint8_t i = 0; i < PLANE_AXES; ++i) {
        limits->min_q40_mm[i] =
            q40_from_counts(config->travel_min_counts[i], config->counts_per_mm, true);
        limits->max_q40_mm[i] =
            q40_from_counts(config->travel_max_counts[i], config->counts_per_mm, false);
    }
}
