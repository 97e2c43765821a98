/* SPDX-License-Identifier: MIT */
/* Implements core/ph_segment.h (see there): a PH segment expanded for evaluation. Used by firmware/core: the kernels,
 * their coefficient records, and the checks of segments and axis limits. Pure; about 10^3 instructions on a 32-bit
 * target. Main loop or tick. */
#include "core/ph_segment.h"

#include "core/qmath.h"

/* Terms of r' and of sigma from coefficients i and j of the preimage, times `weight`, added to out. */
static void add_planar(const struct program_segment *g, int i, int j, int64_t weight,
                       int64_t out_q50[PH_AXES])
{
    const int64_t *u = g->a_q44[PROGRAM_U];
    const int64_t *q = g->a_q44[PROGRAM_Q];
    int64_t uu = qmath_mul_q44(u[i], u[j]);
    int64_t qq = qmath_mul_q44(q[i], q[j]);
    int64_t uq = qmath_mul_q44(u[i], q[j]);
    int64_t qu = qmath_mul_q44(q[i], u[j]);
    out_q50[PH_X] += weight * (uu - qq);
    out_q50[PH_Y] += weight * (uq + qu);
    out_q50[PH_S] += weight * (uu + qq);
}

/* a_i b_j + a_j b_i. */
static int64_t both(const int64_t a_q44[3], const int64_t b_q44[3], int i, int j)
{
    return qmath_mul_q44(a_q44[i], b_q44[j]) + qmath_mul_q44(b_q44[i], a_q44[j]);
}

static void add_spatial(const struct program_segment *g, int i, int j, int64_t weight,
                        int64_t out_q50[PH_AXES])
{
    const int64_t *u = g->a_q44[PROGRAM_U];
    const int64_t *v = g->a_q44[PROGRAM_V];
    const int64_t *p = g->a_q44[PROGRAM_P];
    const int64_t *q = g->a_q44[PROGRAM_Q];
    int64_t uv = qmath_mul_q44(u[i], u[j]) + qmath_mul_q44(v[i], v[j]);
    int64_t pq = qmath_mul_q44(p[i], p[j]) + qmath_mul_q44(q[i], q[j]);
    out_q50[PH_S] += weight * (uv + pq);
    out_q50[PH_X] += weight * (uv - pq);
    out_q50[PH_Y] += weight * (both(u, q, i, j) + both(v, p, i, j));
    out_q50[PH_Z] += weight * (both(v, q, i, j) - both(u, p, i, j));
}

void ph_segment_hodograph(const struct program_segment *segment, int64_t e_q50[5][PH_AXES])
{
    static const struct {
        int8_t i;
        int8_t j;
        int8_t weight;
        int8_t to;
    } terms[6] = {{0, 0, 1, 0}, {0, 1, 1, 1}, {0, 2, 1, 2},
                  {1, 1, 2, 2}, {1, 2, 1, 3}, {2, 2, 1, 4}};
    for (int k = 0; k < 5; k++) {
        for (int axis = 0; axis < PH_AXES; axis++) {
            e_q50[k][axis] = 0;
        }
    }
    for (int k = 0; k < 6; k++) {
        if (segment->axis_count == PROGRAM_PLANE) {
            add_planar(segment, terms[k].i, terms[k].j, terms[k].weight, e_q50[terms[k].to]);
        } else {
            add_spatial(segment, terms[k].i, terms[k].j, terms[k].weight, e_q50[terms[k].to]);
        }
    }
}

/* Integral from z = -1 in powers of z, from the Bernstein coefficients of the derivative in xi. */
static void centre(int64_t e[5][PH_AXES], int axis, int64_t c_q48[6])
{
    int64_t e0 = e[0][axis];
    int64_t e1 = e[1][axis];
    int64_t e2 = e[2][axis];
    int64_t e3 = e[3][axis];
    int64_t e4 = e[4][axis];
    int64_t p0 = e0 + e4 + 4 * (e1 + e3) + 2 * e2;
    int64_t p1 = 4 * (e4 - e0) + 8 * (e3 - e1);
    int64_t p2 = 6 * (e0 + e4) - 4 * e2;
    int64_t p3 = 4 * (e4 - e0) - 8 * (e3 - e1);
    int64_t p4 = e0 + e4 - 4 * (e1 + e3) + 2 * e2;
    c_q48[1] = qmath_round(p0, 7);
    c_q48[2] = qmath_round(p1, 8);
    c_q48[3] = qmath_round(qmath_third(p2), 7);
    c_q48[4] = qmath_round(p3, 9);
    c_q48[5] = qmath_round(qmath_fifth(p4), 7);
    c_q48[0] = c_q48[1] - c_q48[2] + c_q48[3] - c_q48[4] + c_q48[5];
}

static int even_exponent(int64_t e_q50[5][PH_AXES])
{
    int64_t greatest = 1;
    for (int k = 0; k < 5; k++) {
        int64_t sigma = e_q50[k][PH_S];
        sigma = k == 2 ? qmath_third(sigma) : sigma;
        greatest = sigma > greatest ? sigma : greatest;
    }
    uint64_t above = (uint64_t)greatest + ((uint64_t)greatest >> PH_MARGIN_BITS) + 2u;
    int bits = 64 - qmath_clz64(above) - 50;
    return bits + (bits & 1);
}

/* Replaces a tiny segment, so that no division by a sigma near 0 follows. */
static void make_straight(struct ph_segment *ph)
{
    int64_t sigma_q48 = (int64_t)1 << (48 + PH_LEAST_EXPONENT - 1);
    for (int k = 0; k < 6; k++) {
        ph->c_q48_mm[PH_S][k] = k < 2 ? sigma_q48 / 2 : 0;
    }
    for (int k = 0; k < 3; k++) {
        ph->sigma_q50_mm[k] = sigma_q48 * 4;
        for (uint32_t component = 0; component < PROGRAM_COMPONENTS; component++) {
            ph->a_q44[component][k] = 0;
        }
    }
    ph->exponent = PH_LEAST_EXPONENT;
}

static void expand_component(const int64_t b_q44[3], int64_t a_q44[3])
{
    a_q44[0] = b_q44[0] + 2 * b_q44[1] + b_q44[2];
    a_q44[1] = 2 * (b_q44[2] - b_q44[0]);
    a_q44[2] = b_q44[0] - 2 * b_q44[1] + b_q44[2];
}

/* From Bezier coefficients in xi to powers of z: 32 e = sum of C(5,k) b_k (1 + z)^k (1 - z)^(5-k). */
static void expand_extra(const struct program_extra *extra, int64_t c_q45[6])
{
    static const int8_t weights[6][6] = {{1, 5, 10, 10, 5, 1},       {-5, -15, -10, 10, 15, 5},
                                         {10, 10, -20, -20, 10, 10}, {-10, 10, 20, -20, -10, 10},
                                         {5, -15, 10, 10, -15, 5},   {-1, 5, -10, 10, -5, 1}};
    for (int i = 0; i < 6; i++) {
        c_q45[i] = i == 0 ? extra->start_q40 * 32 : 0;
        for (int k = 1; k < 6; k++) {
            c_q45[i] += weights[i][k] * extra->b_q40[k - 1];
        }
    }
}

void ph_segment_expand(struct ph_segment *ph, const struct program_segment *segment)
{
    int64_t e_q50[5][PH_AXES];
    const uint32_t step = program_component_step(segment->axis_count);
    const int last = ph_last_axis(segment->axis_count);
    ph_segment_hodograph(segment, e_q50);
    for (int axis = PH_S; axis <= last; axis++) {
        centre(e_q50, axis, ph->c_q48_mm[axis]);
        ph->origin_q40_mm[axis] =
            axis == PH_S ? segment->start_q40_mm : segment->point_q40_mm[axis - PH_X];
    }
    ph->sigma_q50_mm[0] = e_q50[0][PH_S];
    ph->sigma_q50_mm[1] = ph->c_q48_mm[PH_S][1] * 8;
    ph->sigma_q50_mm[2] = e_q50[4][PH_S];
    ph->exponent = even_exponent(e_q50);
    for (uint32_t component = 0; component < PROGRAM_COMPONENTS; component += step) {
        expand_component(segment->a_q44[component], ph->a_q44[component]);
    }
    for (uint32_t k = 0; k < program_extra_axes(segment->axis_count); k++) {
        expand_extra(&segment->extra[k], ph->extra[k].c_q45);
    }
    ph->axis_count = segment->axis_count;
    if (ph->exponent < PH_LEAST_EXPONENT) {
        make_straight(ph);
    }
}

void ph_segment_end(const struct ph_segment *ph, int64_t end_q48_mm[PH_AXES])
{
    for (int axis = PH_S; axis <= ph_last_axis(ph->axis_count); axis++) {
        const int64_t *c = ph->c_q48_mm[axis];
        end_q48_mm[axis] = 2 * (c[1] + c[3] + c[5]);
    }
}
