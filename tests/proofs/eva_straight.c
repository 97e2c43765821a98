/* SPDX-License-Identifier: MIT */
/*
 * The fixed kernel on a segment below all resolution, whose arc length is replaced, in the plane and in space: as
 * eva_fixed.c, with nothing taken for granted. Analysed by Eva in `make proofs` (tools/analysis/prove.py explains the
 * keywords); never executed, touches nothing.
 *
 * prover: eva
 * options: -eva-slevel 20 -warn-signed-downcast
 * instead: core/qmath.h: uint32_t high = (uint32_t)((uint64_t)a >> 32); => if (1) return (a >> 32) * (int64_t)b + (int64_t)(((uint64_t)(uint32_t)a * b) >> 32); uint32_t high = 0;
 * instead: core/qmath.h: (int64_t)((uint64_t)a << (shift & 63)) => a * ((int64_t)1 << shift)
 * instead: core/qmath.h: int32_t low = (int32_t)a; => if (1) return a < INT32_MIN ? INT32_MIN : a > INT32_MAX ? INT32_MAX : (int32_t)a; int32_t low = 0;
 * mutant: core/ph_segment.c: (48 + PH_LEAST_EXPONENT - 1) => (48 + PH_LEAST_EXPONENT - 4)
 * mutant: core/ph_segment.c: ph->sigma_q50_mm[k] = sigma_q48 * 4; => ph->sigma_q50_mm[k] = 0;
 * mutant: core/ph_segment.c: ph->exponent = PH_LEAST_EXPONENT; => ph->exponent = PH_LEAST_EXPONENT - 4;
 */
#include "proof.h"

#include "core/ph_segment.c"
#include "core/qmath.c"
#include "core/kernel_fixed.c"

int main(void)
{
    struct ph_segment ph;
    struct kernel_fixed_segment k;
    struct kernel_fixed_space in_space;
    int64_t point[PROGRAM_SPACE];
    int64_t most = POWER(50 + PH_LEAST_EXPONENT);
    for (int axis = PH_S; axis < PH_AXES; axis++) {
        ph.origin_q40_mm[axis] = axis == PH_S ? 0 : any_between(-POWER(52), POWER(52));
        for (int i = 0; i < 6; i++) {
            ph.c_q48_mm[axis][i] = any_between(-most, most);
        }
    }
    make_straight(&ph);
    ph.axis_count = PROGRAM_PLANE;
    kernel_fixed_segment_set(&k, &ph);
    ph.axis_count = PROGRAM_SPACE;
    kernel_fixed_space_set(&in_space, &ph);
    //@ loop unroll 40;
    for (int64_t at = -POWER(7); at <= POWER(7) + POWER(5); at += 16) { /* it is 2^5 long */
        kernel_fixed_segment_at(&k, point, any_between(at, at + 15));
        kernel_fixed_space_at(&in_space, point, any_between(at, at + 15));
    }
    reached();
    return 0;
}
