/* SPDX-License-Identifier: MIT */
/*
 * The checks of segments and their joints, and the expansion that they use, for every image of four segments and of two
 * to six path axes: nothing overflows, every index and shift is in range. Four are as good as any number: the third and
 * all later ones are met in the same state. Analysed by Eva in `make proofs` (tools/analysis/prove.py explains the
 * keywords); never executed, touches nothing.
 *
 * prover: eva
 * instead: core/qmath.h: uint32_t high = (uint32_t)((uint64_t)a >> 32); => if (1) return (a >> 32) * (int64_t)b + (int64_t)(((uint64_t)(uint32_t)a * b) >> 32); uint32_t high = 0;
 * options: -eva-domains equality,symbolic-locations
 * assumes: check_speed five_per_speed qmath_clz64 real_make real_add real_mul
 * shows: segment_check_all program_segment_get program_segment_start ph_segment_expand ph_segment_end
 * mutant: core/segment_check.c: target_q40 * 256 => target_q40 * 1024
 * mutant: core/ph_segment.c: 8 * (e3 - e1) => 64 * (e3 - e1)
 * mutant: core/joint_check.c: real_scale(along, -2 * DIRECTION_BITS) => real_scale(along, -2147483647)
 * mutant: core/little_endian.h: (uint64_t)read_u16(b + 4) << 48) >> 16 => (uint64_t)read_u16(b + 4) << 48)
 * mutant: core/segment_check.c: *index < p->header.segment_count => *index <= p->header.segment_count
 */

#include "clz_contract.h"
#include "proof.h"
#include "real_contracts.h"
#include "segment_bounds.h"

/*@ requires in_range(g);
    assigns \result \from *g;
    ensures \result < 0 || (\result == 0 && is_bounded(g)); */
static int check_speed(const struct program_segment *g);

/* The speed is positive where check_speed has passed. */
/*@ requires coefficient == 0 || coefficient == 2;
    requires in_range(g);
    assigns \result \from *g, coefficient;
    ensures -0x7FFFFFFF <= \result.m <= 0x7FFFFFFF && -200 <= \result.e <= 200; */
static struct real five_per_speed(const struct program_segment *g, int coefficient);

/* What eva_interpolator.c and eva_segment_length.c take for granted of segments */
/*@ ensures \result < 0 || (\result == 0 && in_range(g) && 0 <= g->start_q40_mm < (1 << 62) &&
            point_in_range(g)); */
static int check_ranges(const struct program_segment *g);

#include "core/joint_check.c"
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

static uint8_t image[PROGRAM_HEADER_SIZE + 8 * PROGRAM_AXES +
                     4 * (PROGRAM_SPACE_SIZE + PROGRAM_EXTRAS * PROGRAM_EXTRA_SIZE)];
static struct program_limits limits;

static void check(uint32_t axis_count)
{
    struct program p;
    uint32_t index;
    p.image = image;
    p.header.axis_count = (uint16_t)axis_count;
    p.header.header_size = (uint16_t)program_header_size(axis_count);
    p.header.segment_count = 4;
    p.header.length_q40_mm = any_between(1, POWER(62) - 1);
    p.header.flags = (uint16_t)any_between(0, 65535);
    p.size = p.header.header_size + 4 * program_segment_size(axis_count);
    if (segment_check_all(&p, &limits, &index) == 0) {
        reached();
    }
}

int main(void)
{
    Frama_C_make_unknown((char *)image, sizeof image);
    Frama_C_make_unknown((char *)&limits, sizeof limits);
    limits.attend = 0; /* what it calls has no part in the check */
    check(PROGRAM_PLANE);
    check(PROGRAM_SPACE);
    check(PROGRAM_AXES);
    return 0;
}
