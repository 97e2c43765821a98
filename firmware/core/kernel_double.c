/* SPDX-License-Identifier: MIT */
/* Implements core/kernel_double.h (see there): the double kernel, the host's reference. Used by core/coefficients;
 * called through struct kernel (core/kernel.h). Pure; the functions named *_set in the main loop, the others in the
 * tick. */
#include "core/kernel_double.h"

#include "core/kernel.h"

#define Q40   1099511627776.0 /* 2^40 */
#define Q45   35184372088832.0
#define Q48   281474976710656.0
#define Q50   1125899906842624.0
#define STEPS 3 /* of Newton's method */

/* A feed without limit (docs/reference/protocol.md 1.1: 0) can be beyond what 64 bits hold. */
#define MOST 4611686018427387904.0 /* 2^62 */

static double power_of_two(int n)
{
    double p = 1.0;
    for (; n > 0; n--) {
        p *= 2.0;
    }
    for (; n < 0; n++) {
        p *= 0.5;
    }
    return p;
}

/* To nearest, halves away from zero, held within 2^62: without libm, the same everywhere. */
static int64_t round_scaled(double a, double scale)
{
    double b = a * scale;
    b = b > MOST ? MOST : b < -MOST ? -MOST : b;
    return (int64_t)(b < 0.0 ? b - 0.5 : b + 0.5);
}

void kernel_double_piece_set(void *piece, const struct program_piece *from)
{
    struct kernel_double_piece *k = piece;
    int e = program_piece_exponent(from->duration_q32_s);
    k->start_q40_mm = from->start_q40_mm;
    for (int i = 0; i < 7; i++) {
        k->c_mm[i] = (double)from->c_q40_mm[i] / Q40;
    }
    k->tau_per_q42 = power_of_two(-42 - e);
    k->per_s = power_of_two(-e);
}

void kernel_double_piece_at(const void *piece, struct feed_point *out, uint64_t t_q42_s)
{
    const struct kernel_double_piece *k = piece;
    double tau = (double)t_q42_s * k->tau_per_q42;
    double arc = k->c_mm[6];
    double slope = arc;
    for (int i = 5; i >= 0; i--) {
        arc = arc * tau + k->c_mm[i];
        slope = slope * tau + arc;
    }
    out->arc_length_q40_mm = k->start_q40_mm + round_scaled(arc * tau, Q40);
    out->feed_q32_mm_s = round_scaled(slope * k->per_s, 4294967296.0);
}

int64_t kernel_double_piece_acceleration(const void *piece, uint64_t t_q42_s)
{
    const struct kernel_double_piece *k = piece;
    const double tau = (double)t_q42_s * k->tau_per_q42;
    double sum = 0.0;
    for (int i = 6; i > 0; i--) {
        sum = sum * tau + (double)(i * (i + 1)) * k->c_mm[i];
    }
    return round_scaled(sum * k->per_s * k->per_s, Q40);
}

/* Cubic with z(0) = 0, z(1) = 1 and the slopes of the inverse of s(z) there; numerics.md
 * section 12. */
static void set_inverse(double g[4], double half, double sigma_middle, double sigma_end)
{
    double first = 2.0 * half / sigma_middle;
    double last = 2.0 * half / sigma_end;
    g[0] = 1.0 / half;
    g[1] = first;
    g[2] = 3.0 - 2.0 * first - last;
    g[3] = first + last - 2.0;
}

static void set_arc(struct kernel_double_arc *k, const struct ph_segment *ph)
{
    k->origin_q40_mm = ph->origin_q40_mm[PH_S];
    for (int i = 0; i < 6; i++) {
        k->c_mm[i] = (double)ph->c_q48_mm[PH_S][i] / Q48;
    }
    int64_t end_q48[PH_AXES];
    ph_segment_end(ph, end_q48);
    double before = k->c_mm[0];
    double after = (double)end_q48[PH_S] / Q48 - before;
    double sigma[3];
    for (int i = 0; i < 3; i++) {
        sigma[i] = (double)ph->sigma_q50_mm[i] / Q50;
    }
    set_inverse(k->inverse[0], before, sigma[1], sigma[0]);
    set_inverse(k->inverse[1], after, sigma[1], sigma[2]);
}

static void set_axis(struct kernel_double_axis *k, const struct ph_segment *ph, int axis)
{
    k->origin_q40_mm = ph->origin_q40_mm[axis];
    for (int i = 0; i < 6; i++) {
        k->c_mm[i] = (double)ph->c_q48_mm[axis][i] / Q48;
    }
}

void kernel_double_segment_set(void *segment, const struct ph_segment *ph)
{
    struct kernel_double_segment *k = segment;
    set_arc(&k->arc, ph);
    set_axis(&k->axes[0], ph, PH_X);
    set_axis(&k->axes[1], ph, PH_Y);
}

static double first_guess(const struct kernel_double_arc *k, double from_middle)
{
    const double *g = from_middle < 0.0 ? k->inverse[0] : k->inverse[1];
    double sign = from_middle < 0.0 ? -1.0 : 1.0;
    double t = sign * from_middle * g[0];
    t = t > 1.0 ? 1.0 : t;
    return sign * t * (g[1] + t * (g[2] + t * g[3]));
}

static double newton_step(const double c[6], double s, double z)
{
    double value = c[5];
    double slope = value;
    for (int i = 4; i >= 1; i--) {
        value = value * z + c[i];
        slope = slope * z + value;
    }
    return z - (value * z + c[0] - s) / slope;
}

static double horner(const double c[6], double z)
{
    return ((((c[5] * z + c[4]) * z + c[3]) * z + c[2]) * z + c[1]) * z + c[0];
}

static double find(const struct kernel_double_arc *k, int64_t arc_length_q40_mm)
{
    double s = (double)(arc_length_q40_mm - k->origin_q40_mm) / Q40;
    double z = first_guess(k, s - k->c_mm[0]);
    for (int i = 0; i < STEPS; i++) {
        z = newton_step(k->c_mm, s, z);
    }
    return z;
}

static int64_t coordinate_q40(const struct kernel_double_axis *k, double z)
{
    return k->origin_q40_mm + round_scaled(horner(k->c_mm, z), Q40);
}

void kernel_double_segment_at(const void *segment, int64_t position_q40[],
                              int64_t arc_length_q40_mm)
{
    const struct kernel_double_segment *k = segment;
    double z = find(&k->arc, arc_length_q40_mm);
    for (uint32_t axis = 0; axis < PROGRAM_PLANE; axis++) {
        position_q40[axis] = coordinate_q40(&k->axes[axis], z);
    }
}

void kernel_double_space_set(void *segment, const struct ph_segment *ph)
{
    struct kernel_double_space *k = segment;
    set_arc(&k->arc, ph);
    for (int axis = 0; axis < (int)PROGRAM_SPACE; axis++) {
        set_axis(&k->axes[axis], ph, PH_X + axis);
    }
    k->extras = program_extra_axes(ph->axis_count);
    for (uint32_t i = 0; i < k->extras; i++) {
        for (int power = 0; power < 6; power++) {
            k->extra[i].c[power] = (double)ph->extra[i].c_q45[power] / Q45;
        }
    }
}

void kernel_double_space_at(const void *segment, int64_t position_q40[], int64_t arc_length_q40_mm)
{
    const struct kernel_double_space *k = segment;
    double z = find(&k->arc, arc_length_q40_mm);
    for (uint32_t axis = 0; axis < PROGRAM_SPACE; axis++) {
        position_q40[axis] = coordinate_q40(&k->axes[axis], z);
    }
    for (uint32_t i = 0; i < k->extras; i++) {
        position_q40[PROGRAM_SPACE + i] = round_scaled(horner(k->extra[i].c, z), Q40);
    }
}

const struct kernel kernel_double = {
    .piece_size = sizeof(struct kernel_double_piece),
    .piece_set = kernel_double_piece_set,
    .piece_at = kernel_double_piece_at,
    .piece_acceleration = kernel_double_piece_acceleration,
    .plane = {.segment_size = sizeof(struct kernel_double_segment),
              .segment_set = kernel_double_segment_set,
              .segment_at = kernel_double_segment_at},
    .space = {.segment_size = offsetof(struct kernel_double_space, extra),
              .extra_size = sizeof(struct kernel_double_extra),
              .segment_set = kernel_double_space_set,
              .segment_at = kernel_double_space_at},
};
