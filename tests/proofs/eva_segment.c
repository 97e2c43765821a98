/* SPDX-License-Identifier: MIT */
/*
 * The checks of segments and their joints, and the expansion that they use, for every image of four segments: nothing
 * overflows, every index and shift is in range. Four are as good as any number: the third and all later ones are met
 * in the same state.
 *
 * prover: eva
 * instead: core/qmath.h: uint32_t high = (uint32_t)((uint64_t)a >> 32); => if (1) return (a >> 32) * (int64_t)b + (int64_t)(((uint64_t)(uint32_t)a * b) >> 32); uint32_t high = 0;
 * options: -eva-domains equality,symbolic-locations
 * assumes: check_speed qmath_clz64
 * shows: segment_check_all program_segment_get program_segment_start ph_segment_expand ph_segment_end
 * mutant: core/segment_check.c: target_q40 * 256 => target_q40 * 1024
 * mutant: core/ph_segment.c: 8 * (e3 - e1) => 64 * (e3 - e1)
 * mutant: core/segment_check.c: *index < p->header.segment_count => *index <= p->header.segment_count
 */

#include "clz_contract.h"
#include "proof.h"
#include "segment_bounds.h"

/*@ requires in_range(g);
    assigns \result \from *g;
    ensures \result < 0 || (\result == 0 && is_bounded(g)); */
static int check_speed(const struct program_segment *g);

/* What eva_interpolator.c and eva_crossing.c take for granted of segments */
/*@ ensures \result < 0 || (\result == 0 && in_range(g) && 0 <= g->start_q40_mm < (1 << 62) &&
            -(1 << 52) < g->x_q40_mm < (1 << 52) && -(1 << 52) < g->y_q40_mm < (1 << 52)); */
static int check_ranges(const struct program_segment *g);

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

int main(void)
{
    static uint8_t image[128 + 4 * 72];
    struct program p;
    struct program_limits limits;
    uint32_t index;
    Frama_C_make_unknown((char *)image, sizeof image);
    Frama_C_make_unknown((char *)&limits, sizeof limits);
    p.image = image;
    p.size = sizeof image;
    p.header.segment_count = 4;
    p.header.length_q40_mm = any_between(1, POWER(62) - 1);
    p.header.flags = (uint16_t)any_between(0, 65535);
    if (segment_check_all(&p, &limits, &index) == 0) {
        reached();
    }
    return 0;
}
