/* SPDX-License-Identifier: MIT */
/*
 * What check_speed lets through of a planar program is bounded as segment_bounds.h says: the five coefficients of sigma
 * are positive, the greatest is at most twice the least and a fifteenth of their sum at most 32, so each of them is at
 * most 3 * 64. The products stand for what eva_product.c shows of them. Analysed by CBMC in `make proofs`
 * (tools/analysis/prove.py explains the keywords); never executed, touches nothing.
 *
 * prover: cbmc
 * options: --unwind 10
 * replaces: qwide_add_product:some_product
 * shows: check_speed
 * mutant: core/segment_check.c: qwide_add(least, least) => qwide_add(greatest, least)
 * mutant: core/segment_check.c: LONGEST_MM      32 => LONGEST_MM      64
 */
#include "proof.h"
#include "segment_bounds.h"

#include "core/ph_segment.c"
#include "core/program.c"
#include "core/qmath.c"
#include "core/qwide.c"
#include "core/segment_check.c"

uint32_t crc32_update(uint32_t crc, const uint8_t *bytes, uint32_t size)
{
    (void)bytes;
    (void)size;
    return crc;
}

static int64_t size_of(int64_t a)
{
    return a < 0 ? -a : a;
}

/* Contract: eva_product.c. In q38: 65 and 162 are below the squares of END_MOST and MIDDLE_MOST. */
struct qwide some_product(struct qwide sum, int64_t a, int64_t b, int64_t weight)
{
    prove(size_of(a) < POWER(50) && size_of(b) < POWER(50) && weight > 0 && weight <= 3);
    int64_t rise = any_between(-POWER(54), POWER(54));
    if (a == b) {
        __CPROVER_assume(rise >= -weight * POWER(30));
        __CPROVER_assume(size_of(a) <= END_MOST || rise >= weight * (65 * POWER(38) - POWER(28)));
        __CPROVER_assume(size_of(a) <= MIDDLE_MOST || rise >= weight * (162 * POWER(38)));
    }
    if (size_of(a) <= END_MOST && size_of(b) <= END_MOST) {
        __CPROVER_assume(size_of(rise) <= weight * (65 * POWER(38) + POWER(31)));
    }
    struct qwide result = {sum.high + rise, any_between(0, POWER(50) - 1)};
    return result;
}

void harness(void)
{
    struct program_segment g;
    const int64_t *u = g.a_q44[PROGRAM_U];
    const int64_t *q = g.a_q44[PROGRAM_Q];
    g.axis_count = PROGRAM_PLANE;
    for (int k = 0; k < 3; k++) {
        g.a_q44[PROGRAM_U][k] = any_between(-W_MOST_Q44, W_MOST_Q44);
        g.a_q44[PROGRAM_Q][k] = any_between(-W_MOST_Q44, W_MOST_Q44);
    }
    if (check_speed(&g) == 0) {
        prove(size_of(u[0]) <= END_MOST && size_of(q[0]) <= END_MOST);
        prove(size_of(u[2]) <= END_MOST && size_of(q[2]) <= END_MOST);
        prove(size_of(u[1]) <= MIDDLE_MOST && size_of(q[1]) <= MIDDLE_MOST);
        reached();
    }
}
