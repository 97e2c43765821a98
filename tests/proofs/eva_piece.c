/* SPDX-License-Identifier: MIT */
/*
 * The checks of feed pieces and their joints, for every image of four pieces (the third and all later ones are met in
 * the same state) and any limits: nothing overflows, every index and shift is in range. Analysed by Eva in
 * `make proofs` (tools/analysis/prove.py explains the keywords); never executed, touches nothing.
 *
 * prover: eva
 * options: -eva-domains equality,symbolic-locations -eva-slevel 8000
 * assumes: qmath_div_u64 feed_bounds_start feed_bounds_end feed_bounds_contained feed_bounds_within
 * shows: piece_check_all program_piece_get program_piece_duration program_piece_start program_piece_override
 * mutant: core/piece_check.c: COEFFICIENT_LIMIT_Q40 ((int64_t)1 << 54) => COEFFICIENT_LIMIT_Q40 ((int64_t)1 << 57)
 * mutant: core/piece_check.c: ((int64_t)1 << 50) => ((int64_t)1 << 61)
 */
#include "piece_bounds.h"
#include "proof.h"

/*@ requires b != 0;
    assigns \result \from a, b;
    ensures \result <= a; */
uint64_t qmath_div_u64(uint64_t a, uint64_t b);

/* What eva_interpolator.c, eva_segment_length.c and eva_ramp.c take for granted of pieces */
/*@ ensures \result < 0 || (\result == 0 && in_range(c) && 0 <= c->start_q40_mm < (1 << 62)); */
static int check_ranges(const struct program_piece *c);

/*@ ensures \result < 0 || (\result == 0 && 0x1000000 <= c->override_factor_q24 <= 0x2000000); */
static int check_override(const struct program_piece *c);

#include "core/piece_check.c"
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
    static uint8_t image[128 + 4 * 88];
    struct program p;
    struct program_limits limits;
    uint32_t index;
    Frama_C_make_unknown((char *)image, sizeof image);
    Frama_C_make_unknown((char *)&limits, sizeof limits);
    limits.attend = 0; /* what it calls has no part in the check */
    Frama_C_make_unknown((char *)&p.header, sizeof p.header);
    p.image = image;
    p.size = sizeof image;
    p.header.header_size = PROGRAM_HEADER_SIZE;
    p.header.axis_count = PROGRAM_PLANE; /* of more axes, pieces begin elsewhere: cbmc_record.c */
    p.header.segment_count = 0;
    p.header.piece_count = 4;
    p.header.period_us = (uint32_t)any_between(1000, 8000);
    p.header.length_q40_mm = any_between(1, POWER(62) - 1);
    if (piece_check_all(&p, &limits, &index) == 0) {
        reached();
    }
    return 0;
}
