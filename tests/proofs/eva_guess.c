/* SPDX-License-Identifier: MIT */
/*
 * The contract of first_guess (core/kernel_fixed.c) that eva_fixed.c assumes. The first guess of z has the sign of the
 * arc length s, |z| is at least FAR_Z_Q31 where s is beyond FAR_Q30, and nothing overflows. Shown for all end slopes of
 * the cubic in [0.47, 2.06], the range that a speed ratio of at most 2 permits, with room for rounding; in 6 x 6 ranges
 * of the slopes and 16 ranges of t.
 *
 * Analysed by Eva in `make proofs` (tools/analysis/prove.py explains the keywords); never executed, touches nothing.
 *
 * prover: eva
 * options: -eva-slevel 10
 * instead: core/qmath.h: int32_t low = (int32_t)a; => if (1) return a < INT32_MIN ? INT32_MIN : a > INT32_MAX ? INT32_MAX : (int32_t)a; int32_t low = 0;
 * instead: core/kernel_fixed.c: int32_t first = (int32_t)((half * (int64_t)reciprocal_q16(sigma_middle_q30)) >> 19); => int32_t first = first_q26; (void)half;
 * instead: core/kernel_fixed.c: int32_t last = (int32_t)((half * (int64_t)reciprocal_q16(sigma_end_q30)) >> 19); => int32_t last = last_q26;
 * shows: first_guess
 * mutant: core/kernel_fixed.c: t_q30 < 0x3FFFFFFF ? t_q30 : 0x3FFFFFFF => t_q30
 * mutant: core/kernel_fixed.c: t_q25 < 0x1FFFFFF ? t_q25 * 64 => t_q25 < 0x2FFFFFF ? t_q25 * 64
 * mutant: core/kernel_fixed.c: 3 * one_q26 - 2 * first - last => 2 * one_q26 - 2 * first - last
 */
#include "kernel_bounds.h"
#include "proof.h"

#include <stdint.h>

static int32_t first_q26;
static int32_t last_q26;

#include "core/kernel_fixed.c"

/* first_guess needs t only: with this scale t takes the values of s_q30 / 2. */
static void guess(struct kernel_fixed_arc *k, int64_t from, int64_t to)
{
    int32_t s_q30 = (int32_t)any_between(from, to);
    k->inverse[1].scale_q26 = 1 << 30;
    prove(first_guess(k, s_q30) >= 0);
    k->inverse[0].scale_q26 = 1 << 30;
    int32_t z = first_guess(k, -1 - s_q30);
    prove(z <= 0 && z > INT32_MIN);
}

/* Where s is beyond FAR_Q30, t has its greatest value, because the scale of every segment is at least 2. */
static void guess_far(struct kernel_fixed_arc *k)
{
    int64_t s_q30 = any_between(FAR_Q30, INT32_MAX);
    k->inverse[1].scale_q26 = (int32_t)any_between(POWER(27) - POWER(18), POWER(30));
    prove(first_guess(k, (int32_t)s_q30) >= FAR_Z_Q31);
    k->inverse[0].scale_q26 = k->inverse[1].scale_q26;
    int32_t z = first_guess(k, (int32_t)(-1 - s_q30));
    prove(z <= -FAR_Z_Q31 && z > INT32_MIN);
}

static void cubic(int64_t first, int64_t last, int64_t width)
{
    struct kernel_fixed_arc k;
    first_q26 = (int32_t)any_between(first, first + width);
    last_q26 = (int32_t)any_between(last, last + width);
    set_inverse(&k.inverse[0], 1 << 29, 1 << 29, 1 << 29);
    k.inverse[1] = k.inverse[0];
    //@ loop unroll 40;
    for (int64_t part = 0; part < 16; part++) {
        guess(&k, part << 22, (part + 1) << 22);
    }
    guess(&k, POWER(26), INT32_MAX);
    guess_far(&k);
}

int main(void)
{
    int64_t width = (START_MOST_Q26 - START_LEAST_Q26) / 6;
    //@ loop unroll 40;
    for (int64_t first = START_LEAST_Q26; first < START_MOST_Q26; first += width) {
        //@ loop unroll 40;
        for (int64_t last = START_LEAST_Q26; last < START_MOST_Q26; last += width) {
            cubic(first, last, width);
        }
    }
    reached();
    return 0;
}
