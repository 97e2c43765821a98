/* SPDX-License-Identifier: MIT */
#include "core/ph_segment.h"

#include "core/qmath.h"

/* w_i w_j and Re(w_i conj w_j): the terms of r' and of sigma, times `weight`, added to out. */
static void add_product(const struct program_segment *g, int i, int j, int64_t weight,
                        int64_t out_q50[3])
{
    int64_t uu = qmath_mul_q44(g->u_q44[i], g->u_q44[j]);
    int64_t vv = qmath_mul_q44(g->v_q44[i], g->v_q44[j]);
    int64_t uv = qmath_mul_q44(g->u_q44[i], g->v_q44[j]);
    int64_t vu = qmath_mul_q44(g->v_q44[i], g->u_q44[j]);
    out_q50[PH_X] += weight * (uu - vv);
    out_q50[PH_Y] += weight * (uv + vu);
    out_q50[PH_S] += weight * (uu + vv);
}

void ph_segment_hodograph(const struct program_segment *segment, int64_t e_q50[5][3])
{
    for (int k = 0; k < 5; k++) {
        e_q50[k][PH_X] = 0;
        e_q50[k][PH_Y] = 0;
        e_q50[k][PH_S] = 0;
    }
    add_product(segment, 0, 0, 1, e_q50[0]);
    add_product(segment, 0, 1, 1, e_q50[1]);
    add_product(segment, 0, 2, 1, e_q50[2]);
    add_product(segment, 1, 1, 2, e_q50[2]);
    add_product(segment, 1, 2, 1, e_q50[3]);
    add_product(segment, 2, 2, 1, e_q50[4]);
}

/* Integral from z = -1 in powers of z, from the Bernstein coefficients of the derivative in xi. */
static void centre(int64_t e[5][3], int axis, int64_t c_q48[6])
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

static int even_exponent(int64_t e_q50[5][3])
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

/* Keeps what divides by sigma away from 0. */
static void make_straight(struct ph_segment *ph)
{
    int64_t sigma_q48 = (int64_t)1 << (48 + PH_LEAST_EXPONENT - 1);
    for (int k = 0; k < 6; k++) {
        ph->c_q48_mm[PH_S][k] = k < 2 ? sigma_q48 / 2 : 0;
    }
    for (int k = 0; k < 3; k++) {
        ph->sigma_q50_mm[k] = sigma_q48 * 4;
        ph->u_q44[k] = 0;
        ph->v_q44[k] = 0;
    }
    ph->exponent = PH_LEAST_EXPONENT;
}

static void expand_w(const int64_t b_q44[3], int64_t w_q44[3])
{
    w_q44[0] = b_q44[0] + 2 * b_q44[1] + b_q44[2];
    w_q44[1] = 2 * (b_q44[2] - b_q44[0]);
    w_q44[2] = b_q44[0] - 2 * b_q44[1] + b_q44[2];
}

void ph_segment_expand(struct ph_segment *ph, const struct program_segment *segment)
{
    int64_t e_q50[5][3];
    ph_segment_hodograph(segment, e_q50);
    for (int axis = PH_X; axis <= PH_S; axis++) {
        centre(e_q50, axis, ph->c_q48_mm[axis]);
    }
    ph->origin_q40_mm[PH_X] = segment->x_q40_mm;
    ph->origin_q40_mm[PH_Y] = segment->y_q40_mm;
    ph->origin_q40_mm[PH_S] = segment->start_q40_mm;
    ph->sigma_q50_mm[0] = e_q50[0][PH_S];
    ph->sigma_q50_mm[1] = ph->c_q48_mm[PH_S][1] * 8;
    ph->sigma_q50_mm[2] = e_q50[4][PH_S];
    ph->exponent = even_exponent(e_q50);
    expand_w(segment->u_q44, ph->u_q44);
    expand_w(segment->v_q44, ph->v_q44);
    if (ph->exponent < PH_LEAST_EXPONENT) {
        make_straight(ph);
    }
}

void ph_segment_end(const struct ph_segment *ph, int64_t end_q48_mm[3])
{
    for (int axis = PH_X; axis <= PH_S; axis++) {
        const int64_t *c = ph->c_q48_mm[axis];
        end_q48_mm[axis] = 2 * (c[1] + c[3] + c[5]);
    }
}
