/* SPDX-License-Identifier: MIT */
/*
 * The bound of one brake, from any start and with any codes: nothing overflows, also no unsigned number, so that no
 * bound is shortened by a wrap; no division by 0. What intervals do not follow: docs/theory/proofs.md section 15.2.
 * Analysed by Eva in `make proofs` (tools/analysis/prove.py explains the keywords); never executed, touches nothing.
 *
 * prover: eva
 * options: -eva-slevel 100 -warn-unsigned-overflow
 * instead: core/stop_check.c: from->rising_um + from->slope_um > MOST_CHANGE_UM => from->rising_um > MOST_CHANGE_UM || from->slope_um > MOST_CHANGE_UM || from->rising_um + from->slope_um > MOST_CHANGE_UM
 * instead: core/stop_check.c: if (lead_us >= (uint64_t)1 << 28) { => if (even_lead_us >= (uint64_t)1 << 28 || slope_lead_us >= (uint64_t)1 << 28 || lead_us >= (uint64_t)1 << 28) {
 * instead: core/stop_check.c: slope_lead_us - from->cut_us => (uint64_t)any_between(0, (int64_t)slope_lead_us)
 * instead: core/stop_check.c: greater(qmath_div_u64(2u * down * up, down + up), 1u) => (uint64_t)any_between(1, (int64_t)greater(down, up))
 * instead: core/stop_check.c: (time_us - lead_us) / 2u => (uint64_t)any_between(0, (int64_t)time_us) / 2u
 * instead: core/stop_check.c: qmath_div_u64(first_us - last_us, 6u) => qmath_div_u64((uint64_t)any_between(0, 2 * (int64_t)time_us), 6u)
 * assumes: qmath_div_u64 qmath_root
 * shows: stop_curve
 * mutant: core/stop_check.c: peak_um > 2u * MOST_SPEED_UM => peak_um > 4u * MOST_SPEED_UM
 * mutant: core/stop_check.c: down = greater(down, 1u); =>
 * mutant: core/stop_check.c: time_us >= MOST_TIME_US => time_us >= MOST_TIME_US << 8
 * mutant: core/stop_check.c: number(stop->jerk_up) >> 18, (uint64_t)1 << 29 => number(stop->jerk_up) >> 18, (uint64_t)1 << 30
 */
#include "proof.h"
#include "stop_contracts.h"

#include "core/qmath.c"
#include "core/stop_check.c"

int main(void)
{
    struct stop_start from;
    struct program_stop stop;
    Frama_C_make_unknown((char *)&stop, sizeof stop);
    from.speed_um = (uint64_t)any_between(0, INT64_MAX);
    from.rising_um = (uint64_t)any_between(0, STOP_MOST_RISE);
    from.slope_um = (uint64_t)any_between(0, STOP_MOST_RISE);
    from.cut_us = (uint64_t)any_between(0, INT64_MAX);
    struct stop_bound bound = stop_curve(&from, &stop);
    if (bound.distance_um != NO_BOUND) {
        reached();
    }
    return 0;
}
