/* SPDX-License-Identifier: MIT */
/*
 * Minimum segment length, for six segments and six pieces that have passed their own checks: nothing overflows, no
 * division by 0, and no segment or piece is read that the image does not have. Analysed by Eva in `make proofs`
 * (tools/analysis/prove.py explains the keywords); never executed, touches nothing.
 *
 * prover: eva
 * options: -eva-domains equality,symbolic-locations -eva-slevel 2000
 * assumes: program_piece_get program_segment_start feed_bounds_within
 * shows: segment_length_check_all length_exceeds_tick
 * mutant: core/segment_length_check.c: *index + 2u < p->header => *index + 1u < p->header
 * mutant: core/segment_length_check.c: *first + 1 < p->header => *first < p->header
 * mutant: core/segment_length_check.c: (length_q40 >> 16) => length_q40
 */
#include "piece_bounds.h"
#include "proof.h"

/*@ requires i < p->header.piece_count;
    assigns *out \from *p, i;
    ensures \initialized(out) && in_range(out) && 0 <= out->start_q40_mm < (1 << 62); */
void program_piece_get(const struct program *p, uint32_t i, struct program_piece *out);

/*@ requires i < p->header.segment_count;
    assigns \result \from *p, i;
    ensures 0 <= \result < (1 << 62); */
int64_t program_segment_start(const struct program *p, uint32_t i);

#include "core/segment_length_check.c"

static void count_of(uint32_t segments, uint32_t pieces)
{
    struct program p;
    uint32_t index;
    Frama_C_make_unknown((char *)&p.header, sizeof p.header);
    p.header.segment_count = segments;
    p.header.piece_count = pieces;
    p.header.period_us = (uint32_t)any_between(1000, 8000);
    if (segment_length_check_all(&p, &index) == 0) {
        reached();
    }
}

int main(void)
{
    count_of(1, 1);
    count_of(6, 6);
    return 0;
}
