/* SPDX-License-Identifier: MIT */
/*
 * The check of the stop table, for every image of ten pieces whose pieces have passed their own check (more than the
 * walk remembers; all later ones are met in the same state) and any limits: it reads the table inside the image,
 * nothing overflows, also no unsigned number, so that no bound is shortened by a wrap, no division by 0, and it ends.
 * Analysed by Eva in `make proofs` (tools/analysis/prove.py explains the keywords); never executed, touches nothing.
 *
 * prover: eva
 * options: -eva-slevel 0 -warn-unsigned-overflow
 * assumes: qmath_clz64 qmath_div_u64 qmath_root stop_curve feed_bounds_parts program_piece_get program_piece_duration program_piece_start program_piece_override
 * shows: stop_check_all
 * mutant: core/program.c: (size_t)i * stop_size => (size_t)(i + 1u) * stop_size
 * mutant: core/stop_check.c: stop_walk_back(&walk, i - 1u) => stop_walk_back(&walk, i)
 * mutant: core/stop_check.c: walk->count < STOP_WINDOW ? 1u => walk->count <= STOP_WINDOW ? 1u
 * mutant: core/stop_check.c: value >= (int64_t)1 << 52 ? => value >= (int64_t)1 << 56 ?
 * mutant: core/stop_check.c: q >= (uint64_t)1 << 43 ? => q >= (uint64_t)1 << 46 ?
 * mutant: core/stop_check.c: from.cut_us >= (uint64_t)1 << 28 => from.cut_us >= (uint64_t)1 << 48
 */
#include "piece_bounds.h"
#include "proof.h"
#include "stop_contracts.h"

/*@ requires i < p->header.piece_count;
    assigns *out \from i;
    ensures \initialized(out) && in_range(out) && 0 <= out->start_q40_mm < (1 << 62);
    ensures 0x1000000 <= out->override_factor_q24 <= 0x2000000; */
void program_piece_get(const struct program *p, uint32_t i, struct program_piece *out);

/*@ requires i < p->header.piece_count;
    assigns \result \from i;
    ensures 0 < \result <= (1 << 54); */
uint64_t program_piece_duration(const struct program *p, uint32_t i);

/*@ requires i < p->header.piece_count;
    assigns \result \from i;
    ensures 0 <= \result < (1 << 62); */
int64_t program_piece_start(const struct program *p, uint32_t i);

/*@ requires i < p->header.piece_count;
    assigns *out \from i;
    ensures \initialized(out) && 0x4000 <= out->factor_q14 <= 0x8000; */
void program_piece_override(const struct program *p, uint32_t i, struct program_override *out);

#include "core/program.c"
#include "core/qmath.c"
#include "core/stop_check.c"

uint32_t crc32_update(uint32_t crc, const uint8_t *bytes, uint32_t size)
{
    (void)bytes;
    (void)size;
    return crc;
}

#define COUNT 10u

int main(void)
{
    static uint8_t image[PROGRAM_HEADER_SIZE + COUNT * (PROGRAM_PIECE_SIZE + PROGRAM_STOP_SIZE)];
    struct program p;
    struct program_limits limits;
    uint32_t index;
    Frama_C_make_unknown((char *)image, sizeof image);
    Frama_C_make_unknown((char *)&limits, sizeof limits);
    limits.attend = NULL;
    Frama_C_make_unknown((char *)&p.header, sizeof p.header);
    p.image = image;
    p.size = sizeof image;
    p.header.header_size = PROGRAM_HEADER_SIZE;
    p.header.axis_count = (uint16_t)any_between(PROGRAM_PLANE, PROGRAM_AXES);
    p.header.segment_count = 0;
    p.header.piece_count = COUNT;
    p.header.period_us = (uint32_t)any_between(1000, 8000);
    p.header.length_q40_mm = any_between(1, POWER(62) - 1);
    if (stop_check_all(&p, &limits, &index) == 0) {
        reached();
    }
    return 0;
}
