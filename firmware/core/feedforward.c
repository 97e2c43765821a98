/* SPDX-License-Identifier: MIT */
/* Implements core/feedforward.h (see there): velocity and torque offsets (0x60B1, 0x60B2) that go with the setpoints of
 * one axis. Used by app/machine/offsets, app/tick and sim/offline/offline. Changes the struct of the axis only; any
 * context.
 */
#include "core/feedforward.h"

#include "core/qmath.h"

/* The greatest distance in a period, and its greatest change, of any machine: 32 mm and 1 mm. They keep the
 * products below inside 62 bits. */
#define DISTANCE_MAX_Q40_MM (INT64_C(1) << 45)
#define CHANGE_MAX_Q40_MM   (INT64_C(1) << 40) /* 1 mm: greater second differences count as this */

static int64_t clamp(int64_t value, int64_t most)
{
    return value > most ? most : value < -most ? -most : value;
}

/* log2 of the period in ms, 0 ... 3: so that dividing by the period is a shift. */
static int period_bits(const struct feedforward_gains *gains)
{
    return 31 - qmath_clz32(gains->period_us / 1000u);
}

/* The 1000 of periods in ms per second and that of per mille are the same. */
static int32_t velocity_offset(const struct feedforward_gains *gains, int64_t distance_q40_mm)
{
    const int64_t distance_q20_counts =
        (distance_q40_mm >> 10) * (int64_t)gains->counts_per_mm >> 10;
    const int64_t permille = (int64_t)gains->velocity_permille;
    return qmath_clamp32(qmath_round(distance_q20_counts * permille, 20 + period_bits(gains)));
}

/* mm per ms is m/s; mm per ms^2 is 1000 m/s^2. */
static int16_t torque_offset(const struct feedforward_gains *gains, int64_t distance_q40_mm,
                             int64_t change_q40_mm)
{
    const int bits = period_bits(gains);
    const int64_t velocity_q20_m_s = distance_q40_mm >> (20 + bits);
    const int64_t acceleration_q20_m_s2 = change_q40_mm * 1000 >> (20 + 2 * bits);
    const int64_t permille_q36 = velocity_q20_m_s * gains->torque_per_velocity_q16 +
                                 acceleration_q20_m_s2 * gains->torque_per_acceleration_q16;
    return (int16_t)clamp(qmath_round(permille_q36, 36), INT16_MAX);
}

struct feedforward_offset feedforward_offset(const struct feedforward_gains *gains,
                                             int64_t first_q40_mm, int64_t second_q40_mm)
{
    const int64_t distance_q40_mm = clamp(first_q40_mm, DISTANCE_MAX_Q40_MM);
    const int64_t change_q40_mm = clamp(second_q40_mm, CHANGE_MAX_Q40_MM);
    const struct feedforward_offset offset = {
        .velocity_counts_s = velocity_offset(gains, distance_q40_mm),
        .torque_permille = torque_offset(gains, distance_q40_mm, change_q40_mm),
    };
    return offset;
}

void feedforward_begin(struct feedforward *axis, int64_t point_q40_mm)
{
    axis->last_q40_mm = point_q40_mm;
    axis->before_q40_mm = point_q40_mm;
}

struct feedforward_offset feedforward_next(struct feedforward *axis,
                                           const struct feedforward_gains *gains,
                                           int64_t point_q40_mm)
{
    const int64_t distance_q40_mm = point_q40_mm - axis->last_q40_mm;
    const int64_t distance_before_q40_mm = axis->last_q40_mm - axis->before_q40_mm;
    axis->before_q40_mm = axis->last_q40_mm;
    axis->last_q40_mm = point_q40_mm;
    return feedforward_offset(gains, distance_q40_mm, distance_q40_mm - distance_before_q40_mm);
}
