/* SPDX-License-Identifier: MIT */
/*
 * config: the configuration by the host as one value: objects 0x1006, 0x2004 ... 0x2007, 0x2012 ... 0x2016, 0x2018 ...
 * 0x201A, 0x201D ... 0x2023, 0x2030 ... 0x2035, 0x2051 ... 0x2053.
 *
 * Used by firmware/app. Main loop: reads the dictionary and writes its results only. The tick works with a copy
 * (machine.config), which the main loop replaces under the port's lock at standstill.
 */
#ifndef APP_MACHINE_CONFIG_H
#define APP_MACHINE_CONFIG_H

#include <stdbool.h>
#include <stdint.h>

#include "canopen/od.h"
#include "core/program_rules.h"

/* A program moves the first ones, in the order of its path; the others hold their position. */
#define AXES_MAX PROGRAM_AXES

/* Above it the conversion of travel limits to q40 mm would leave 64 bits. */
#define CONFIG_COUNTS_PER_MM_MAX 8388608u

/* Bits of feedforward. */
#define CONFIG_TORQUE_FEEDFORWARD   1u /* 0x60B2 in RPDO1 */
#define CONFIG_VELOCITY_FEEDFORWARD 2u /* 0x60B1 in RPDO2 */

/* The largest lag of a position loop without feedforward, as a time (a gain of 50 / s). */
#define CONFIG_WINDOW_MS 20u

/* SYNCs beyond the drive's own time, so that a drive that detects the deviation reports it first. */
#define CONFIG_DEVIATION_SYNCS 5u

/* The values of one axis except node and travel. Every field has 32 bits, so that tables can name one by its offset. */
struct config_axis {
    int32_t homing_method;                  /* 0x6098; 0: not homed by the command */
    uint32_t homing_sequence;               /* axes home in this order; of equal numbers by axis */
    int32_t home_offset_counts;             /* 0x607C */
    uint32_t homing_speed_towards_counts_s; /* 0x6099 sub 1 */
    uint32_t homing_speed_away_counts_s;    /* 0x6099 sub 2 */
    uint32_t homing_acceleration_counts_s2; /* 0x609A */
    uint32_t velocity_permille;             /* 0 ... 2000, of the setpoint's velocity */
    int32_t torque_per_acceleration_q16;    /* per mille of the rated torque for 1 m/s^2 */
    int32_t torque_per_velocity_q16;        /* the same for 1 m/s */
    uint32_t following_window_counts;       /* 0x6065; UINT32_MAX: the drive's own stays */
    uint32_t following_timeout_ms;          /* 0x6066 */
    uint32_t quick_stop_counts_s2;          /* 0x6085 */
    uint32_t encoder_increments;            /* 0x608F; 0, here and below: the drive keeps its own */
    uint32_t feed_constant_counts;          /* 0x6092 */
    uint32_t gear_motor_revolutions;        /* 0x6091 sub 1 */
    uint32_t gear_shaft_revolutions;        /* 0x6091 sub 2 */
    uint32_t velocity_limit_um_s; /* of programs, at every override; 0, here and below: none */
    uint32_t acceleration_limit_um_s2;
    uint32_t jerk_limit_mm_s3;
    uint32_t expected_vendor; /* 0x1018 subs 1 ... 3 of the drive; 0: any */
    uint32_t expected_product;
    uint32_t expected_revision;
    /* of a rotary axis: counts per degree; 0: counts_per_mm */
    uint32_t counts_per_unit;
};

/* Bits of struct config_outputs.behaviour: the outputs of the path outside of motion. */
#define CONFIG_OUTPUTS_KEEP_AT_STOP  1u /* stay on at a stop on the path */
#define CONFIG_OUTPUTS_KEEP_AT_FAULT 2u /* the same in a fault, at a quick stop, with drives off */
#define CONFIG_OUTPUTS_OFF_AT_END    4u /* off at the end of a program */
#define CONFIG_OUTPUTS_OFF_IN_HOLD   8u /* off while the path is held, or a chunk is missing */

#define CONFIG_OUTPUTS_DELAY_MAX 8u

/* The I/O module that takes the outputs of the path (object 0x2035). */
struct config_outputs {
    uint32_t vendor; /* 0x1018 subs 1, 2 of the module; 0: any */
    uint32_t product;
    uint8_t node;           /* 0: there is none */
    uint8_t digital_count;  /* mapped: 0, 8 or 16 */
    uint8_t analogue_count; /* 0 ... PROGRAM_ANALOGUES */
    uint8_t behaviour;      /* CONFIG_OUTPUTS_... */
    uint8_t delay_ticks;    /* 0 ... CONFIG_OUTPUTS_DELAY_MAX */
};

/* Travel of an axis. */
struct config_travel {
    int32_t min_counts;
    int32_t max_counts;
};

struct config {
    uint32_t period_us; /* 1000, 2000, 4000 or 8000 */
    uint32_t feed_limit_um_s;
    uint32_t acceleration_limit_um_s2;
    uint32_t jerk_limit_mm_s3;
    uint32_t start_tolerance_counts; /* of axes in mm */
    uint32_t counts_per_mm;
    struct config_travel travel[AXES_MAX];
    struct config_axis axis[AXES_MAX];
    uint16_t answer_wait_ms;      /* wall time before an answer counts as missed */
    uint16_t setpoint_timeout_ms; /* a drive without setpoints for so long stops by itself */
    uint16_t stop_time_ms;        /* a fault stop of a program may take so long; 0: no limit */
    uint8_t node[AXES_MAX];
    uint8_t own_node;    /* the controller itself */
    uint8_t axis_count;  /* 1 ... AXES_MAX */
    uint8_t kernel;      /* enum kernel_number */
    uint8_t missed_max;  /* so many answers in a row may be missed */
    uint8_t feedforward; /* CONFIG_..._FEEDFORWARD */
    struct config_outputs outputs;
    uint32_t crc32; /* of the objects; docs/reference/protocol.md section 3.4 */
    uint32_t rotary_tolerance_counts
        [AXES_MAX]; /* start tolerance of rotary axes: as many degrees as else mm */
    /* Permitted position deviation by axis, and the number of SYNCs in a row for which it may be exceeded: following
     * error window and time if they are set, else the distance of CONFIG_WINDOW_MS at the feed limit, for a rotary axis
     * at its own velocity limit (without one: UINT32_MAX). */
    uint32_t deviation_counts[AXES_MAX];
    uint32_t deviation_syncs[AXES_MAX];
};

/* Copies the present values out of the dictionary. Main loop. */
void config_read(struct config *config, const struct od *od);

/* Whether the configuration allows a value of the object. It refuses values that are inside the ranges of the
 * dictionary: a period that is not 1, 2, 4 or 8 ms; too many counts per mm; a kernel that this image does not have.
 * Pure. */
bool config_value_allowed(uint16_t index, uint8_t sub, uint64_t value);

/* Whether a change of the object concerns the drives, so that they must be configured anew. Pure.
 */
bool config_concerns_drives(uint16_t index, uint8_t sub);

/* True for all objects above. Pure. */
bool config_contains(uint16_t index);

/* Counts per millimetre, or per degree of a rotary axis. Pure. */
static inline uint32_t config_counts_per_unit(const struct config *config, uint32_t axis)
{
    const uint32_t own = config->axis[axis].counts_per_unit;
    return own != 0u ? own : config->counts_per_mm;
}

/* Start tolerance of an axis. Pure. */
static inline uint32_t config_tolerance_counts(const struct config *config, uint32_t axis)
{
    const bool is_rotary = config->axis[axis].counts_per_unit != 0u;
    return is_rotary ? config->rotary_tolerance_counts[axis] : config->start_tolerance_counts;
}

/* Whether positions of an axis mean the same in both: the zero that homing found under one still holds under the
 * other. Pure. */
bool config_same_zero(const struct config *first, const struct config *second, uint8_t axis);

/* The limits in the form that program_check takes, for a program whose axes begin at this one of the machine
 * (core/first_axis.h); travel is rounded inwards. Axes beyond the last one have no travel. It is no chunk; attend and
 * self are left as they are. Main loop. */
void config_limits(const struct config *config, uint32_t first_axis, struct program_limits *limits);

#endif
