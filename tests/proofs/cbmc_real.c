/* SPDX-License-Identifier: MIT */
/*
 * The numbers of core/real.h, from any normal ones or 0: nothing overflows, every shift is in range, and what comes out
 * is normal or 0, with an exponent as real_contracts.h says. Quotients of mantissas are left open; none is by 0.
 * Analysed by CBMC in `make proofs` (tools/analysis/prove.py explains the keywords); never executed, touches nothing.
 *
 * prover: cbmc
 * options: --unwind 4
 * replaces: qmath_div_u64:some_quotient
 * shows: real_make real_add real_mul
 * mutant: core/real.c: bits > MANTISSA_BITS ? (uint32_t) => bits > MANTISSA_BITS + 1 ? (uint32_t)
 * mutant: core/real.c: above == 0 ? size >> 1 => above == 1 ? size >> 1
 * mutant: core/real.c: apart >= MANTISSA_BITS ? high => apart >= 2 * MANTISSA_BITS ? high
 * mutant: core/real.c: (int32_t)(size >> 61) => (int32_t)(size >> 60)
 */
#include "proof.h"
#include "real_contracts.h"

#include "core/qmath.c"
#include "core/real.c"

uint64_t some_quotient(uint64_t a, uint64_t b)
{
    prove(b != 0);
    uint64_t quotient = nondet_uint64();
    __CPROVER_assume(quotient <= a);
    return quotient;
}

static int64_t size_of(int64_t a)
{
    return a < 0 ? -a : a;
}

static struct real any_real(void)
{
    struct real a = {(int32_t)any_between(-INT32_MAX, INT32_MAX),
                     (int32_t)any_between(-REAL_MOST_EXPONENT, REAL_MOST_EXPONENT)};
    __CPROVER_assume(a.m == 0 || size_of(a.m) >= POWER(30));
    return a;
}

static int is_normal(struct real a)
{
    return a.m == 0 || (size_of(a.m) >= POWER(30) && size_of(a.m) < POWER(31));
}

static int is_apart(int32_t e, int32_t from, int32_t low, int32_t high)
{
    return e >= from + low && e <= from + high;
}

void harness(void)
{
    const struct real a = any_real();
    const struct real b = any_real();
    const int32_t e = (int32_t)any_between(-REAL_MOST_EXPONENT, REAL_MOST_EXPONENT);
    const struct real made = real_make(nondet_int64(), e);
    prove(is_normal(made) && (made.e == 0 || is_apart(made.e, e, -30, 33)));
    const struct real sum = real_add(a, b);
    prove(is_normal(sum));
    prove(sum.e == 0 || is_apart(sum.e, a.e, -31, 1) || is_apart(sum.e, b.e, -31, 1));
    const struct real product = real_mul(a, b);
    prove(is_normal(product) && (product.e == 0 || is_apart(product.e, a.e + b.e, 30, 31)));
    if (b.m != 0) {
        prove(is_normal(real_div(a, b)));
    }
    reached();
}
