/* SPDX-License-Identifier: MIT */
/*
 * A feed piece of the integer kernels, for any coefficients and duration in range and any time: the arc length and the
 * feed overflow nowhere, shifts are in range. That no sum of the slope passes 31 bits: docs/theory/proofs.md 15.3.
 * Analysed by Eva in `make proofs` (tools/analysis/prove.py explains the keywords); never executed, touches nothing.
 *
 * prover: eva
 * options: -eva-slevel 100
 * instead: core/qmath.h: uint32_t high = (uint32_t)((uint64_t)a >> 32); => if (1) return (a >> 32) * (int64_t)b + (int64_t)(((uint64_t)(uint32_t)a * b) >> 32); uint32_t high = 0;
 * instead: core/feed_piece.c: slope = 2 * qmath_mul_hi(slope, tau_q31) + f->slope[k] => slope = (int32_t)any_between(INT32_MIN, INT32_MAX)
 * assumes: qmath_clz64
 * shows: feed_piece_set feed_piece_at
 * mutant: core/feed_piece.c: int shift = 22 - exponent => int shift = 62 - exponent
 * mutant: core/feed_piece.c: from->c_q40_mm[k] * 16 => from->c_q40_mm[k] * 256
 * mutant: core/feed_piece.c: bits > 32 ? bits - 31 : 1 => bits > 32 ? bits : 1
 * mutant: core/feed_piece.c: shift < -31 ? 31 => shift < -31 ? 32
 * mutant: core/feed_piece.c: shift < 31 ? (int32_t)1 => shift < 33 ? (int32_t)1
 */
#include "clz_contract.h"
#include "proof.h"

#include "core/feed_piece.h"

#include "core/feed_piece.c"
#include "core/program.c"
#include "core/qmath.c"

uint32_t crc32_update(uint32_t crc, const uint8_t *bytes, uint32_t size)
{
    (void)bytes;
    (void)size;
    return crc;
}

int main(void)
{
    struct program_piece c;
    struct feed_piece f;
    struct feed_point at;
    Frama_C_make_unknown((char *)&c, sizeof c);
    c.duration_q32_s = (uint64_t)any_between(1, POWER(54));
    c.start_q40_mm = any_between(0, POWER(62) - 1);
    for (int k = 0; k < 7; k++) {
        c.c_q40_mm[k] = any_between(-POWER(54), POWER(54));
    }
    feed_piece_set(&f, &c);
    feed_piece_at(&f, &at, (uint64_t)any_between(INT64_MIN, INT64_MAX));
    prove(at.feed_q32_mm_s < POWER(62) && at.feed_q32_mm_s > -POWER(62));
    reached();
    return 0;
}
