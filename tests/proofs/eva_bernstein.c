/* SPDX-License-Identifier: MIT */
/*
 * The Bernstein form: halving any coefficients of any degree, and reading them, keeps inside the arrays and overflows
 * nowhere. Its search through the halves: docs/theory/proofs.md section 15.2. Analysed by Eva in `make proofs`
 * (tools/analysis/prove.py explains the keywords); never executed, touches nothing.
 *
 * prover: eva
 * shows: bernstein_within bernstein_halve
 * mutant: core/bernstein.c: return (a >> 1) + (b >> 1) + (a & b & 1); => return (a + b) >> 1;
 * mutant: core/bernstein.c: right[degree - step] => right[degree + step]
 */
#include "proof.h"

#include "core/bernstein.c"

int main(void)
{
    int64_t b[8];
    int64_t right[8];
    int degree = (int)any_between(4, 7);
    //@ split degree;
    for (int k = 0; k <= degree; k++) {
        b[k] = any_between(INT64_MIN, INT64_MAX);
    }
    bernstein_halve(b, right, degree);
    all_within(b, degree, right[0], right[degree]);
    reached();
    return 0;
}
