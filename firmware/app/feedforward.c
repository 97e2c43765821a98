/* SPDX-License-Identifier: MIT */
#include "app/feedforward.h"

#include <string.h>

#include "core/qmath.h"

/* Way of one period, and its change, beyond which no machine goes: 32 mm and 1 mm. They keep the
 * products below inside 62 bits. */
#define WAY_MAX_Q40_MM    (INT64_C(1) << 45)
#define CHANGE_MAX_Q40_MM (INT64_C(1) << 40)

static int64_t clamp(int64_t value, int64_t most)
{
    return value > most ? most : value < -most ? -most : value;
}

/* log2 of the period in ms, 0 ... 3: so that dividing by the period is a shift. */
static int period_bits(const struct config *config)
{
    return 31 - qmath_clz32(config->period_us / 1000u);
}

/* The 1000 of periods in ms per second and that of per mille are the same. */
static int32_t velocity_offset(const struct config *config, uint8_t axis, int64_t way_q40_mm)
{
    const int64_t way_q20_counts = (way_q40_mm >> 10) * (int64_t)config->counts_per_mm >> 10;
    const int64_t permille = (int64_t)config->axis[axis].velocity_permille;
    return qmath_clamp32(qmath_round(way_q20_counts * permille, 20 + period_bits(config)));
}

/* mm per ms is m/s; mm per ms^2 is 1000 m/s^2. */
static int16_t torque_offset(const struct config_axis *axis, int bits, int64_t way_q40_mm,
                             int64_t change_q40_mm)
{
    const int64_t velocity_q20_m_s = way_q40_mm >> (20 + bits);
    const int64_t acceleration_q20_m_s2 = change_q40_mm * 1000 >> (20 + 2 * bits);
    const int64_t permille_q36 = velocity_q20_m_s * axis->torque_per_velocity_q16 +
                                 acceleration_q20_m_s2 * axis->torque_per_acceleration_q16;
    return (int16_t)clamp(qmath_round(permille_q36, 36), INT16_MAX);
}

struct feedforward_offset feedforward_offset(const struct config *config, uint8_t axis,
                                             int64_t first_q40_mm, int64_t second_q40_mm)
{
    const int64_t way_q40_mm = clamp(first_q40_mm, WAY_MAX_Q40_MM);
    const int64_t change_q40_mm = clamp(second_q40_mm, CHANGE_MAX_Q40_MM);
    const struct feedforward_offset offset = {
        .velocity_counts_s = velocity_offset(config, axis, way_q40_mm),
        .torque_permille =
            torque_offset(&config->axis[axis], period_bits(config), way_q40_mm, change_q40_mm),
    };
    return offset;
}

void feedforward_init(struct feedforward *feedforward)
{
    memset(feedforward, 0, sizeof *feedforward);
}

/* A motion begins at rest. */
static void begin(struct feedforward *feedforward, const int64_t point_q40_mm[PLANE_AXES])
{
    for (uint8_t i = 0; i < PLANE_AXES; ++i) {
        feedforward->last_q40_mm[i] = point_q40_mm[i];
        feedforward->before_q40_mm[i] = point_q40_mm[i];
    }
}

static void move(struct feedforward *feedforward, const struct config *config,
                 const int64_t point_q40_mm[PLANE_AXES],
                 struct feedforward_offset offset[PLANE_AXES])
{
    for (uint8_t i = 0; i < PLANE_AXES; ++i) {
        const int64_t last_q40_mm = feedforward->last_q40_mm[i];
        const int64_t way_q40_mm = point_q40_mm[i] - last_q40_mm;
        const int64_t way_before_q40_mm = last_q40_mm - feedforward->before_q40_mm[i];
        offset[i] = feedforward_offset(config, i, way_q40_mm, way_q40_mm - way_before_q40_mm);
        feedforward->before_q40_mm[i] = last_q40_mm;
        feedforward->last_q40_mm[i] = point_q40_mm[i];
    }
}

void feedforward_step(struct feedforward *feedforward, const struct config *config,
                      const struct motion *motion, struct feedforward_offset offset[PLANE_AXES])
{
    memset(offset, 0, PLANE_AXES * sizeof offset[0]);
    if (motion == NULL) {
        feedforward->setpoints = 0;
        return;
    }
    if (motion->setpoints == feedforward->setpoints) {
        return;
    }
    const int64_t point_q40_mm[PLANE_AXES] = {motion->point.x_q40_mm, motion->point.y_q40_mm};
    if (feedforward->setpoints == 0u) {
        begin(feedforward, point_q40_mm);
    }
    feedforward->setpoints = motion->setpoints;
    move(feedforward, config, point_q40_mm, offset);
}
