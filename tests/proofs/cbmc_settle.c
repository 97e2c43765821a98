/* SPDX-License-Identifier: MIT */
/*
 * The release phase of a brake (docs/theory/proofs.md section 15.6): as long as the jerks are not negative the speed
 * does not rise in a tick, it takes as many ticks as it began with, and speed and acceleration are 0 at its end.
 * Analysed by CBMC in `make proofs` (tools/analysis/prove.py explains the keywords); never executed, touches nothing.
 *
 * prover: cbmc
 * options: --unwind 11 --unwinding-assertions --signed-overflow-check
 * replaces: qmath_div_up_u64:some_ticks qmath_div_u64:some_quotient
 * shows: path_brake_ended
 * mutant: core/path_brake.c: 3 * (int64_t)(q * n * (n - 1u)) - steady => 3 * (int64_t)(q * n * (n + 1u)) - steady
 * mutant: core/path_brake.c: q * (n * (n - 1u) / 2u * (4u * n + 1u))); => q * (n * (n - 1u) / 2u * (4u * n - 1u)));
 * mutant: core/path_brake.c: if (brake->settle_ticks == 0) { => if (brake->settle_ticks <= 1) {
 * mutant: core/path_brake.c: at->speed_q56 += a + 3 * sixth_q56; => at->speed_q56 += a + 2 * sixth_q56;
 * mutant: core/path_brake.c: return brake->phase == RESTING; => return brake->phase >= SETTLING;
 */
#include "brake_contracts.h"
#include "proof.h"

#include "core/path_brake.c"

static uint64_t ticks;
static uint64_t quotients[2];
static int asked;

uint64_t some_ticks(uint64_t a, uint64_t b)
{
    (void)a;
    prove(b != 0);
    return ticks;
}

uint64_t some_quotient(uint64_t a, uint64_t b)
{
    (void)a;
    prove(b != 0);
    return quotients[asked++];
}

/* Rests exactly. The remainder at the end is linear in p and in q, and of the third degree in n: 0 for both, one by one, and
 * for more than four n, it is 0 for all. */
static void rest(uint64_t n, uint64_t p, uint64_t q)
{
    struct path_brake brake = {.at = {.speed_q56 = 1, .acceleration_q56 = -1}, .phase = READY};
    ticks = n;
    quotients[0] = q;
    quotients[1] = p;
    asked = 0;
    for (uint64_t i = 0; i < n; i++) {
        prove(!path_brake_ended(&brake));
        path_brake_step(&brake);
    }
    prove(path_brake_ended(&brake));
    prove(brake.at.speed_q56 == 0 && brake.at.acceleration_q56 == 0);
    path_brake_step(&brake);
    prove(brake.at.speed_q56 == 0 && brake.at.acceleration_q56 == 0);
}

/* A tick with a jerk that is not negative, as all later ones are: they bring the acceleration to 0. */
static void settle_one(void)
{
    struct path_brake brake;
    brake.at.arc_length_q40_mm = any_between(-POWER(62), POWER(62));
    brake.at.fine_q56_mm = nondet_uint32() & 65535u;
    brake.at.speed_q56 = any_between(0, BRAKE_MOST_RISING);
    const int64_t behind = any_between(0, BRAKE_MOST / 12);
    brake.rise_q56 = any_between(0, BRAKE_MOST / 12);
    brake.at.acceleration_q56 = -6 * (brake.rise_q56 + behind);
    brake.rise_less_q56 = any_between(0, BRAKE_MOST / 12);
    brake.phase = SETTLING;
    assume(brake.settle_ticks > 0);
    const struct path_brake before = brake;
    path_brake_step(&brake);
    prove(brake.at.speed_q56 <= before.at.speed_q56);
    prove(brake.at.acceleration_q56 == -6 * behind);
    prove(brake.settle_ticks == before.settle_ticks - 1u);
    prove(path_brake_ended(&brake) == (brake.settle_ticks == 0));
}

void harness(void)
{
    settle_one();
    for (uint64_t n = 2; n < 9; n++) {
        rest(n, 1, 0);
        rest(n, 0, 1);
    }
    reached();
}
