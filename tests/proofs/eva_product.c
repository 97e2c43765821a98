/* SPDX-License-Identifier: MIT */
/*
 * How much a product adds to a sum, as cbmc_speed.c takes it: a square is not negative, to rounding, and is large where
 * its factor is, and a product of small factors is small. The sum is 0 here; qwide_add_product only adds to it.
 * Analysed by Eva in `make proofs` (tools/analysis/prove.py explains the keywords); never executed, touches nothing.
 *
 * prover: eva
 * shows: qwide_add_product
 * mutant: core/qwide.c: int64_t high = a1 * b1 => int64_t high = a1 * b1 / 2
 * mutant: core/qwide.c: weight * high => high
 * mutant: core/qwide.c: a >> 25 => a >> 23
 */
#include "proof.h"
#include "segment_bounds.h"

#include "core/qwide.c"

static const struct qwide nothing = {0, 0};

static void squares(int64_t weight, int64_t from, int64_t to, int64_t least)
{
    int64_t a = any_between(from, to);
    prove(qwide_add_product(nothing, a, a, weight).high >= weight * least);
    a = any_between(-to, -from);
    prove(qwide_add_product(nothing, a, a, weight).high >= weight * least);
}

static void of_weight(int64_t weight)
{
    int64_t all = W_MOST_Q44;
    squares(weight, 0, all, -POWER(30));
    squares(weight, END_MOST + 1, 9 * POWER(44), 65 * POWER(38) - POWER(28));
    squares(weight, 9 * POWER(44), 16 * POWER(44), 65 * POWER(38));
    squares(weight, 16 * POWER(44), 64 * POWER(44) - 1, 65 * POWER(38));
    squares(weight, MIDDLE_MOST + 1, 13 * POWER(44), 162 * POWER(38));
    squares(weight, 13 * POWER(44), 16 * POWER(44), 162 * POWER(38));
    squares(weight, 16 * POWER(44), 64 * POWER(44) - 1, 162 * POWER(38));
    int64_t a = any_between(-END_MOST, END_MOST);
    int64_t b = any_between(-END_MOST, END_MOST);
    int64_t small = qwide_add_product(nothing, a, b, weight).high;
    prove(small <= weight * (65 * POWER(38) + POWER(31)) &&
          small >= -weight * (65 * POWER(38) + POWER(31)));
    int64_t any =
        qwide_add_product(nothing, any_between(-all, all), any_between(-all, all), weight).high;
    prove(any <= POWER(54) && any >= -POWER(54));
}

int main(void)
{
    of_weight(1);
    of_weight(2);
    of_weight(3);
    reached();
    return 0;
}
