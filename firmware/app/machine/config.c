/* SPDX-License-Identifier: MIT */
/* Implements app/machine/config.h (see there): the configuration of the host as one value. Used by firmware/app. Main
 * loop: reads the dictionary and writes its results only. The tick works with a copy (machine.config), which the main
 * loop replaces under the port's lock at standstill. */
#include "app/machine/config.h"

#include <stddef.h>
#include <string.h>

#include "canopen/cob.h"
#include "core/crc32.h"
#include "core/kernel.h"
#include "core/qmath.h"

/* Objects of the configuration, in addition to those in the table of axis fields. */
enum {
    PERIOD = 0x1006,
    CONFIGURATION = 0x2004,
    NODE = 0x2005,
    TRAVEL_MIN = 0x2006,
    TRAVEL_MAX = 0x2007,
    COUNTS_PER_UNIT = 0x2033,
    HOMING_SEQUENCE = 0x2034,
    OUTPUTS = 0x2035,
};

/* Sub-indices of CONFIGURATION. */
enum {
    SUB_AXIS_COUNT = 1,
    SUB_FEED_LIMIT = 2,
    SUB_ACCELERATION_LIMIT = 3,
    SUB_JERK_LIMIT = 4,
    SUB_KERNEL = 5,
    SUB_START_TOLERANCE = 6,
    SUB_COUNTS_PER_MM = 7,
    SUB_ANSWER_WAIT = 8,
    SUB_MISSED_MAX = 9,
    SUB_SETPOINT_TIMEOUT = 10,
    SUB_FEEDFORWARD = 11,
    SUB_STOP_TIME = 12,
};

/* Sub-indices of OUTPUTS. */
enum {
    SUB_OUTPUT_NODE = 1,
    SUB_DIGITAL_COUNT = 2,
    SUB_ANALOGUE_COUNT = 3,
    SUB_BEHAVIOUR = 4,
    SUB_DELAY = 5,
    SUB_OUTPUT_VENDOR = 6,
    SUB_OUTPUT_PRODUCT = 7,
};

struct axis_field {
    uint16_t index;
    uint16_t offset; /* in struct config_axis */
};

#define AXIS_FIELD(index, name) {index, offsetof(struct config_axis, name)}

static const struct axis_field axis_fields[] = {
    AXIS_FIELD(0x2012, homing_method),
    AXIS_FIELD(0x2013, home_offset_counts),
    AXIS_FIELD(0x2014, homing_speed_towards_counts_s),
    AXIS_FIELD(0x2015, homing_speed_away_counts_s),
    AXIS_FIELD(0x2016, homing_acceleration_counts_s2),
    AXIS_FIELD(0x2018, velocity_permille),
    AXIS_FIELD(0x2019, torque_per_acceleration_q16),
    AXIS_FIELD(0x201A, torque_per_velocity_q16),
    AXIS_FIELD(0x201D, following_window_counts),
    AXIS_FIELD(0x201E, following_timeout_ms),
    AXIS_FIELD(0x201F, quick_stop_counts_s2),
    AXIS_FIELD(0x2020, encoder_increments),
    AXIS_FIELD(0x2021, feed_constant_counts),
    AXIS_FIELD(0x2022, gear_motor_revolutions),
    AXIS_FIELD(0x2023, gear_shaft_revolutions),
    AXIS_FIELD(0x2030, velocity_limit_um_s),
    AXIS_FIELD(0x2031, acceleration_limit_um_s2),
    AXIS_FIELD(0x2032, jerk_limit_mm_s3),
    AXIS_FIELD(COUNTS_PER_UNIT, counts_per_unit),
    AXIS_FIELD(HOMING_SEQUENCE, homing_sequence),
    AXIS_FIELD(0x2051, expected_vendor),
    AXIS_FIELD(0x2052, expected_product),
    AXIS_FIELD(0x2053, expected_revision),
};

#define AXIS_FIELDS (sizeof axis_fields / sizeof axis_fields[0])

/* The value with its sign, if it has one. */
static int64_t number(const struct od *od, uint16_t index, uint8_t sub)
{
    const struct od_entry *entry = od_find(od, index, sub);
    if (entry == NULL) {
        return 0;
    }
    const uint64_t raw = od_number(od, entry);
    const bool is_signed = entry->type >= OD_INTEGER8 && entry->type <= OD_INTEGER32;
    return is_signed ? cob_signed(raw, entry->size) : (int64_t)raw;
}

static void read_axis(struct config_axis *axis, const struct od *od, uint8_t sub)
{
    for (size_t i = 0; i < AXIS_FIELDS; ++i) {
        const uint32_t value = (uint32_t)(uint64_t)number(od, axis_fields[i].index, sub);
        memcpy((uint8_t *)axis + axis_fields[i].offset, &value, sizeof value);
    }
}

static bool is_axis_field(uint16_t index)
{
    for (size_t i = 0; i < AXIS_FIELDS; ++i) {
        if (axis_fields[i].index == index) {
            return true;
        }
    }
    return false;
}

static bool is_by_axis(uint16_t index)
{
    return index == NODE || index == TRAVEL_MIN || index == TRAVEL_MAX || is_axis_field(index);
}

/* Values of axes beyond the last one may be those of another machine: they are ignored. */
static bool counts(const struct od_entry *entry, uint8_t axis_count)
{
    return (entry->access & OD_WRITE) != 0u && config_contains(entry->index) &&
           !(is_by_axis(entry->index) && entry->sub > axis_count);
}

static uint32_t crc_of(const struct od *od, uint8_t axis_count)
{
    uint32_t crc = 0;
    for (uint16_t i = 0; i < od->table->entry_count; ++i) {
        const struct od_entry *entry = &od->table->entries[i];
        if (counts(entry, axis_count)) {
            uint8_t bytes[3u + 8u];
            cob_put16(bytes, entry->index);
            bytes[2] = entry->sub;
            cob_put(bytes + 3, od_number(od, entry), entry->size);
            crc = crc32_update(crc, bytes, 3u + entry->size);
        }
    }
    return crc;
}

static uint32_t at_most_u32(uint64_t value)
{
    return value < UINT32_MAX ? (uint32_t)value : UINT32_MAX;
}

/* speed * time * scale, in 32-bit steps that hold the largest result at UINT32_MAX. */
static uint32_t window_counts(const struct config *config, uint8_t axis)
{
    const struct config_axis *own = &config->axis[axis];
    const bool is_rotary = own->counts_per_unit != 0u;
    const uint64_t lag_nm =
        (uint64_t)(is_rotary ? own->velocity_limit_um_s : config->feed_limit_um_s) *
        CONFIG_WINDOW_MS; /* um/s * ms */
    if (lag_nm == 0u || lag_nm > UINT32_MAX) {
        return UINT32_MAX;
    }
    return at_most_u32(qmath_div_u64(lag_nm * config_counts_per_unit(config, axis), 1000000u));
}

static uint32_t rotary_tolerance_counts(const struct config *config, uint8_t axis)
{
    const uint64_t scaled =
        (uint64_t)config->start_tolerance_counts * config->axis[axis].counts_per_unit;
    return at_most_u32(qmath_div_u64(scaled, config->counts_per_mm));
}

static void read_window(struct config *config, uint8_t axis)
{
    const struct config_axis *own = &config->axis[axis];
    const bool set = own->following_window_counts != UINT32_MAX;
    const uint32_t timeout_us = own->following_timeout_ms * 1000u;
    config->deviation_counts[axis] =
        set ? own->following_window_counts : window_counts(config, axis);
    config->deviation_syncs[axis] =
        (set ? timeout_us / config->period_us : 0u) + CONFIG_DEVIATION_SYNCS;
}

static void read_outputs(struct config_outputs *outputs, const struct od *od)
{
    outputs->node = (uint8_t)number(od, OUTPUTS, SUB_OUTPUT_NODE);
    outputs->digital_count = (uint8_t)number(od, OUTPUTS, SUB_DIGITAL_COUNT);
    outputs->analogue_count = (uint8_t)number(od, OUTPUTS, SUB_ANALOGUE_COUNT);
    outputs->behaviour = (uint8_t)number(od, OUTPUTS, SUB_BEHAVIOUR);
    outputs->delay_ticks = (uint8_t)number(od, OUTPUTS, SUB_DELAY);
    outputs->vendor = (uint32_t)number(od, OUTPUTS, SUB_OUTPUT_VENDOR);
    outputs->product = (uint32_t)number(od, OUTPUTS, SUB_OUTPUT_PRODUCT);
}

void config_read(struct config *config, const struct od *od)
{
    config->period_us = (uint32_t)number(od, PERIOD, 0);
    config->own_node = (uint8_t)(number(od, 0x1200, 1) & NODE_ID_MAX);
    config->axis_count = (uint8_t)number(od, CONFIGURATION, SUB_AXIS_COUNT);
    config->feed_limit_um_s = (uint32_t)number(od, CONFIGURATION, SUB_FEED_LIMIT);
    config->acceleration_limit_um_s2 = (uint32_t)number(od, CONFIGURATION, SUB_ACCELERATION_LIMIT);
    config->jerk_limit_mm_s3 = (uint32_t)number(od, CONFIGURATION, SUB_JERK_LIMIT);
    config->kernel = (uint8_t)number(od, CONFIGURATION, SUB_KERNEL);
    config->start_tolerance_counts = (uint32_t)number(od, CONFIGURATION, SUB_START_TOLERANCE);
    config->counts_per_mm = (uint32_t)number(od, CONFIGURATION, SUB_COUNTS_PER_MM);
    config->answer_wait_ms = (uint16_t)number(od, CONFIGURATION, SUB_ANSWER_WAIT);
    config->missed_max = (uint8_t)number(od, CONFIGURATION, SUB_MISSED_MAX);
    config->setpoint_timeout_ms = (uint16_t)number(od, CONFIGURATION, SUB_SETPOINT_TIMEOUT);
    config->feedforward = (uint8_t)number(od, CONFIGURATION, SUB_FEEDFORWARD);
    config->stop_time_ms = (uint16_t)number(od, CONFIGURATION, SUB_STOP_TIME);
    for (uint8_t i = 0; i < AXES_MAX; ++i) {
        const uint8_t sub = (uint8_t)(i + 1u);
        config->node[i] = (uint8_t)number(od, NODE, sub);
        config->travel[i].min_counts = (int32_t)number(od, TRAVEL_MIN, sub);
        config->travel[i].max_counts = (int32_t)number(od, TRAVEL_MAX, sub);
        read_axis(&config->axis[i], od, sub);
        read_window(config, i);
        config->rotary_tolerance_counts[i] = rotary_tolerance_counts(config, i);
    }
    read_outputs(&config->outputs, od);
    config->crc32 = crc_of(od, config->axis_count);
}

bool config_value_allowed(uint16_t index, uint8_t sub, uint64_t value)
{
    if (index == PERIOD) {
        return value == 1000u || value == 2000u || value == 4000u || value == 8000u;
    }
    if (index == CONFIGURATION && sub == SUB_KERNEL) {
        return kernel_find((uint32_t)value) != NULL;
    }
    if (index == CONFIGURATION && sub == SUB_COUNTS_PER_MM) {
        return value >= 1u && value <= CONFIG_COUNTS_PER_MM_MAX;
    }
    if (index == OUTPUTS && sub == SUB_DIGITAL_COUNT) {
        return value % 8u == 0u && value <= PROGRAM_DIGITALS;
    }
    if (index == COUNTS_PER_UNIT) {
        return value <= CONFIG_COUNTS_PER_MM_MAX;
    }
    return true;
}

bool config_concerns_drives(uint16_t index, uint8_t sub)
{
    if (index == CONFIGURATION) {
        return sub == SUB_AXIS_COUNT || sub == SUB_SETPOINT_TIMEOUT || sub == SUB_FEEDFORWARD;
    }
    if (index == OUTPUTS) {
        return sub != SUB_BEHAVIOUR && sub != SUB_DELAY;
    }
    const bool is_feedforward = index >= 0x2018 && index <= 0x201A;
    const bool is_limit = index >= 0x2030 && index <= 0x2032;
    return !is_feedforward && !is_limit && index != HOMING_SEQUENCE;
}

bool config_contains(uint16_t index)
{
    return index == PERIOD || index == CONFIGURATION || index == OUTPUTS || is_by_axis(index);
}

bool config_same_zero(const struct config *first, const struct config *second, uint8_t axis)
{
    const struct config_axis *a = &first->axis[axis];
    const struct config_axis *b = &second->axis[axis];
    return first->node[axis] == second->node[axis] &&
           config_counts_per_unit(first, axis) == config_counts_per_unit(second, axis) &&
           a->homing_method == b->homing_method && a->home_offset_counts == b->home_offset_counts &&
           a->encoder_increments == b->encoder_increments &&
           a->feed_constant_counts == b->feed_constant_counts &&
           a->gear_motor_revolutions == b->gear_motor_revolutions &&
           a->gear_shaft_revolutions == b->gear_shaft_revolutions;
}

/* magnitude * 2^40 / counts_per_mm; remainder < counts_per_mm <= 2^23, so the shift stays inside 64 bits. */
static uint64_t q40_from_magnitude(uint32_t magnitude, uint32_t counts_per_mm, bool round_up)
{
    const uint64_t whole = magnitude / counts_per_mm;
    const uint64_t remainder = magnitude % counts_per_mm;
    const uint64_t bias = round_up ? counts_per_mm - 1u : 0u;
    return (whole << 40) + qmath_div_u64((remainder << 40) + bias, counts_per_mm);
}

static int64_t q40_from_counts(int32_t counts, uint32_t counts_per_mm, bool upwards)
{
    const bool negative = counts < 0;
    const uint32_t magnitude = negative ? 0u - (uint32_t)counts : (uint32_t)counts;
    const uint64_t q40 = q40_from_magnitude(magnitude, counts_per_mm, upwards != negative);
    return negative ? -(int64_t)q40 : (int64_t)q40;
}

static void limits_of_axis(const struct config *config, uint32_t axis, uint32_t i,
                           struct program_limits *limits)
{
    const uint32_t counts_per_unit = config_counts_per_unit(config, axis);
    limits->min_q40_mm[i] = q40_from_counts(config->travel[axis].min_counts, counts_per_unit, true);
    limits->max_q40_mm[i] =
        q40_from_counts(config->travel[axis].max_counts, counts_per_unit, false);
    limits->axis_velocity_um_s[i] = config->axis[axis].velocity_limit_um_s;
    limits->axis_acceleration_um_s2[i] = config->axis[axis].acceleration_limit_um_s2;
    limits->axis_jerk_mm_s3[i] = config->axis[axis].jerk_limit_mm_s3;
}

void config_limits(const struct config *config, uint32_t first_axis, struct program_limits *limits)
{
    limits->axis_count = 0; /* any: those that the program does not move hold their position */
    limits->period_us = config->period_us;
    limits->feed_um_s = config->feed_limit_um_s;
    limits->acceleration_um_s2 = config->acceleration_limit_um_s2;
    limits->jerk_mm_s3 = config->jerk_limit_mm_s3;
    limits->stop_time_ms = config->stop_time_ms;
    limits->chunk = 0;
    for (uint32_t i = 0; i < AXES_MAX; ++i) {
        if (first_axis + i < AXES_MAX) {
            limits_of_axis(config, first_axis + i, i, limits);
        } else {
            limits->min_q40_mm[i] = 0;
            limits->max_q40_mm[i] = 0;
            limits->axis_velocity_um_s[i] = 0;
            limits->axis_acceleration_um_s2[i] = 0;
            limits->axis_jerk_mm_s3[i] = 0;
        }
    }
}
