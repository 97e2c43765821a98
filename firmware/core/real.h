/* SPDX-License-Identifier: MIT */
/*
 * real: floating-point numbers in integers, for proofs that need range rather than digits and have to give the same
 * verdict on every target, with or without an FPU. Used by firmware/core: the checks of joints, and the proofs of axis
 * limits and stops.
 *
 * A value is m 2^e with 2^30 <= |m| < 2^31, or zero. A sum is within 2^-29 of the greater of its terms, a product or a
 * quotient within 2^-29 of itself. Exponents are meant to stay within +-2^20, far beyond any quantity of motion;
 * nothing is checked. Pure functions, any context; some 30 to 60 instructions each on a 32-bit target.
 */
#ifndef HODOGRAPH_CORE_REAL_H
#define HODOGRAPH_CORE_REAL_H

#include <stdint.h>

struct real {
    int32_t m;
    int32_t e;
};

/* m 2^e; any m. */
struct real real_make(int64_t m, int32_t e);

struct real real_add(struct real a, struct real b);
struct real real_mul(struct real a, struct real b);

/* b is not zero. */
struct real real_div(struct real a, struct real b);

static inline struct real real_negative(struct real a)
{
    a.m = -a.m;
    return a;
}

static inline struct real real_sub(struct real a, struct real b)
{
    return real_add(a, real_negative(b));
}

static inline struct real real_abs(struct real a)
{
    return a.m < 0 ? real_negative(a) : a;
}

/* a times 2^n. */
static inline struct real real_scale(struct real a, int32_t n)
{
    a.e += n;
    return a;
}

/* a times a small integer. */
static inline struct real real_times(struct real a, int32_t n)
{
    return real_make((int64_t)a.m * n, a.e);
}

/* 1 when a < b. Exact. */
static inline int real_less(struct real a, struct real b)
{
    if ((a.m < 0) != (b.m < 0) || a.m == 0 || b.m == 0 || a.e == b.e) {
        return a.m < b.m ? 1 : 0;
    }
    return (a.e < b.e) == (a.m > 0) ? 1 : 0;
}

static inline struct real real_max(struct real a, struct real b)
{
    return real_less(a, b) != 0 ? b : a;
}

#endif
