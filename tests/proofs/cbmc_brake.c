/* SPDX-License-Identifier: MIT */
/*
 * A brake goes one way (docs/theory/proofs.md section 15.6). From every state that a falling tick can find, whatever
 * the products are that it compares: once the acceleration is not above 0 it stays so, and the speed does not rise; the
 * remainder is a state of the same kind, or one from which the release phase takes two ticks or more (cbmc_settle.c).
 * Analysed by CBMC in `make proofs` (tools/analysis/prove.py explains the keywords); never executed, touches nothing.
 *
 * prover: cbmc
 * options: --signed-overflow-check
 * replaces: within:some_answer depth:some_depth sixth_of:some_sixth
 * mutant: core/path_brake.c: if (may_fall(&next, n->jerk_up_q56)) { => if (next.speed_q56 > 0) {
 * mutant: core/path_brake.c: if (speed_q56 <= fall_q56) { => if (speed_q56 < 0) {
 * mutant: core/path_brake.c: at->speed_q56 += a + 3 * sixth_q56; => at->speed_q56 += a - 3 * sixth_q56;
 * mutant: core/path_brake.c: if (!may_fall(&next, numbers->jerk_up_q56)) { => if (next.speed_q56 < 0) {
 */
#include "brake_contracts.h"
#include "proof.h"

#include "core/path_brake.c"

int some_answer(uint64_t need, struct rough a, struct rough b, int up)
{
    (void)need;
    (void)a;
    (void)b;
    (void)up;
    return nondet_uint32() & 1u;
}

/* At most half of the speed; above two ticks of jerk more than half a jerk, and than 2^-16 of the speed. */
int64_t some_depth(int64_t w_q56, int64_t jerk_q56)
{
    prove(w_q56 > 0 && IS_NUMBER(jerk_q56));
    const int64_t b = any_between(0, w_q56 >> 1);
    assume(w_q56 >> 1 <= jerk_q56 ? b == w_q56 >> 1 : b > jerk_q56 >> 1 && b > w_q56 >> 16);
    return b;
}

static int64_t sixth_asked;
static int64_t sixth_said;

/* A sixth, less by 2^-30 of it and a unit at most, towards 0; of the same number the same. */
int64_t some_sixth(int64_t a)
{
    const int64_t whole = qmath_magnitude(a);
    const int64_t size = any_between(0, BRAKE_MOST);
    prove(whole <= 2 * BRAKE_MOST);
    assume(6 * size <= whole && whole - 6 * size <= 6 + (whole >> 29));
    assume(a != sixth_asked || size == sixth_said);
    sixth_asked = a;
    sixth_said = size;
    return a < 0 ? -size : size;
}

/* While the acceleration falls. */
static int is_falling(const struct path_state *at)
{
    const int64_t a = at->acceleration_q56;
    return a >= 0 ? at->speed_q56 >= PATH_BRAKE_NO_SPEED : at->speed_q56 > -2 * a;
}

static void any_brake(struct path_brake *brake)
{
    assume(IS_NUMBERS(&brake->numbers));
    brake->at.arc_length_q40_mm = any_between(-POWER(62), POWER(62));
    brake->at.fine_q56_mm = nondet_uint32() & 65535u;
    brake->at.speed_q56 = any_between(0, BRAKE_MOST_RISING - BRAKE_MOST / 2 - 1);
    brake->at.acceleration_q56 = any_between(-BRAKE_MOST, BRAKE_MOST);
}

static void first(void)
{
    struct path_state from;
    struct path_brake brake;
    struct path_brake_numbers n;
    assume(IS_NUMBERS(&n));
    from.arc_length_q40_mm = any_between(-POWER(62), POWER(62));
    from.fine_q56_mm = nondet_uint32() & 65535u;
    if (path_brake_begin(&brake, &from, &n)) {
        prove(is_falling(&brake.at) && brake.phase == FALLING);
        prove(brake.at.speed_q56 > -3 * brake.at.acceleration_q56);
        path_brake_first(&brake);
        prove(is_falling(&brake.at) && brake.phase == FALLING);
    }
}

static void fall(void)
{
    struct path_brake brake;
    any_brake(&brake);
    brake.phase = FALLING;
    assume(is_falling(&brake.at));
    const struct path_state before = brake.at;
    path_brake_step(&brake);
    const int64_t a = brake.at.acceleration_q56;
    prove(brake.phase == FALLING || brake.phase == READY);
    prove(a >= -BRAKE_MOST && a <= BRAKE_MOST);
    if (before.acceleration_q56 <= 0) {
        prove(a <= 0 && brake.at.speed_q56 <= before.speed_q56);
    }
    if (brake.phase == FALLING) {
        prove(is_falling(&brake.at));
    } else {
        prove(a < 0 && 2 * brake.at.speed_q56 > -a);
    }
}

void harness(void)
{
    sixth_asked = 0;
    sixth_said = 0;
    first();
    fall();
    reached();
}
