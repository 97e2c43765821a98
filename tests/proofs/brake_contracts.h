/* SPDX-License-Identifier: MIT */
/*
 * What the parts of a brake promise each other (docs/theory/numerics.md section 12, "Path stop"; docs/theory/proofs.md
 * 15.5 and 15.6); for eva_brake.c, eva_depth.c and cbmc_brake.c. Included by cbmc_brake.c, cbmc_settle.c, eva_brake.c
 * and override_contracts.h; never executed, touches nothing.
 */
#ifndef HODOGRAPH_BRAKE_CONTRACTS_H
#define HODOGRAPH_BRAKE_CONTRACTS_H

#include "core/path_brake.h"

#define BRAKE_LEAST       ((int64_t)1 << 22) /* of a jerk and of a deceleration */
#define BRAKE_MOST        ((int64_t)1 << 60)
#define BRAKE_MOST_RISING ((int64_t)1 << 61) /* above the speed that one rises to */
#define BRAKE_MOST_SETTLE 16384              /* ticks of the release phase */

#define IS_NUMBER(a) (BRAKE_LEAST <= (a) && (a) <= BRAKE_MOST)
#define IS_NUMBERS(n)                                                                              \
    (IS_NUMBER((n)->jerk_down_q56) && IS_NUMBER((n)->deceleration_q56) &&                          \
     IS_NUMBER((n)->jerk_up_q56))

#if defined(__FRAMAC__)

/*@ requires 0 < w_q56 < BRAKE_MOST_RISING && IS_NUMBER(jerk_q56);
    assigns \result \from w_q56, jerk_q56;
    ensures 0 <= \result <= (1 << 62); */
static int64_t depth(int64_t w_q56, int64_t jerk_q56);

#endif

#endif
