/* SPDX-License-Identifier: MIT */
/*
 * The brake along the path, for every code of the stop table, every state that it may begin from, and every state of a
 * tick: nothing overflows, no shift is out of range, no division by 0. What comes out of the table and of the begin is
 * in the ranges that the ticks start from. The release phase by ranges of its number of ticks. Analysed by Eva in
 * `make proofs` (tools/analysis/prove.py explains the keywords); never executed, touches nothing.
 *
 * prover: eva
 * options: -eva-slevel 5000
 * instead: core/qmath.h: uint32_t high = (uint32_t)((uint64_t)a >> 32); => if (1) return (a >> 32) * (int64_t)b + (int64_t)(((uint64_t)(uint32_t)a * b) >> 32); uint32_t high = 0;
 * instead: core/path_brake.c: (uint32_t)((uint64_t)a << zeros >> 33), 33 - zeros => some_mantissa(a), (int)any_between(0 * zeros - 30, 32)
 * instead: core/path_brake.c: rough_of(speed_q56 - fall_q56) => rough_of(any_between(1, speed_q56))
 * instead: core/path_brake.c: rise <= MOST_Q56 && => from->acceleration_q56 <= MOST_Q56 && rise <= MOST_Q56 &&
 * instead: core/path_brake.c: a >> FITS_BITS > 0 || -a >> FITS_BITS > 0 => a >= (int64_t)1 << FITS_BITS || a <= -((int64_t)1 << FITS_BITS)
 * instead: core/path_brake.c: (early | late) >> 60 != 0 => early < 0 || early >= MOST_Q56 || late < 0 || late >= MOST_Q56
 * instead: core/path_brake.c: qmath_shift_clamp(ratio_q15, a.exponent => some_shift(ratio_q15, a.exponent
 * instead: core/path_brake.c: qmath_div_up_u64(2u * speed, fall) => ticks_of(2u * speed, fall)
 * instead: core/path_brake.c: n * fall - 2u * speed => (uint64_t)any_between(0, (int64_t)fall - 1)
 * assumes: qmath_clz64 qmath_div_u64 qmath_third depth
 * shows: path_brake_numbers_of path_brake_begin path_brake_fits path_brake_first path_brake_step within
 * mutant: core/path_brake.c: up > 12 ? => up > 14 ?
 * mutant: core/path_brake.c: mantissa[code & 7u] => mantissa[code & 15u]
 * mutant: core/path_brake.c: from->speed_q56 <= PATH_BRAKE_MOST_SPEED && =>
 * mutant: core/path_brake.c: from->acceleration_q56 >= -MOST_Q56 && =>
 * mutant: core/path_brake.c: left_q40_mm <= 0 || => left_q40_mm <= -POWER(60) ||
 * mutant: core/path_brake.c: if (speed_q56 <= fall_q56) => if (fall_q56 < 0)
 * mutant: core/path_brake.c: 6 * sixth_q56; => 60 * sixth_q56;
 * mutant: core/path_brake.c: brake->settle_ticks--; => brake->settle_ticks -= 2u;
 * mutant: core/path_brake.c: 3u * n * n) => 3u * n * (n - 2u))
 * mutant: core/path_brake.c: n * (n * n - 1u) => n * (n * n - 4u)
 */
#include "proof.h"
#include "brake_contracts.h"
#include "clz_contract.h"
#include "thirds_contract.h"

/*@ requires b != 0;
    assigns \result \from a, b;
    ensures \result == a / b; */
uint64_t qmath_div_u64(uint64_t a, uint64_t b);

static uint64_t ticks_of(uint64_t way, uint64_t fall);

/* eva_depth.c */
static uint32_t some_mantissa(int64_t a)
{
    prove(a >= 0);
    return a > 0 ? (uint32_t)any_between(POWER(30), POWER(31) - 1) : 0u;
}

/* eva_qmath.c */
static int64_t some_shift(int64_t a, int shift)
{
    (void)a;
    (void)shift;
    return any_between(1 - POWER(62), POWER(62) - 1);
}

#include "core/path_brake.c"
#include "core/qmath.c"

#define MOST_ARC POWER(62)

static struct path_brake_numbers any_numbers(void)
{
    const struct path_brake_numbers n = {any_between(BRAKE_LEAST, BRAKE_MOST),
                                         any_between(BRAKE_LEAST, BRAKE_MOST),
                                         any_between(BRAKE_LEAST, BRAKE_MOST)};
    return n;
}

static struct path_state any_state(int64_t most_speed, int64_t least, int64_t most)
{
    const struct path_state at = {any_between(-MOST_ARC, MOST_ARC), (uint32_t)any_between(0, 65535),
                                  any_between(0, most_speed), any_between(least, most)};
    return at;
}

static void table(void)
{
    struct program_stop stop;
    struct path_brake_numbers n;
    Frama_C_make_unknown((char *)&stop, sizeof stop);
    //@ loop unroll 4;
    for (uint32_t p = 0; p < 4; p++) {
        if (path_brake_numbers_of(&n, &stop, (uint32_t)1000 << p)) {
            prove(IS_NUMBERS(&n));
        }
    }
}

/* From any state, also one that a broken plan would have; and the first tick. */
static void begin(void)
{
    const struct path_brake_numbers n = any_numbers();
    struct path_state from;
    struct path_brake brake;
    from.arc_length_q40_mm = any_between(-MOST_ARC, MOST_ARC);
    from.fine_q56_mm = (uint32_t)any_between(0, 65535);
    from.speed_q56 = any_between(INT64_MIN, INT64_MAX);
    from.acceleration_q56 = any_between(INT64_MIN, INT64_MAX);
    (void)path_brake_fits(&from, &n, any_between(-MOST_ARC, MOST_ARC));
    if (path_brake_begin(&brake, &from, &n)) {
        const struct path_state at = brake.at;
        prove(at.speed_q56 >= PATH_BRAKE_NO_SPEED && at.speed_q56 <= PATH_BRAKE_MOST_SPEED);
        prove(at.acceleration_q56 >= -BRAKE_MOST && at.acceleration_q56 <= BRAKE_MOST);
        path_brake_first(&brake);
        prove(brake.at.fine_q56_mm < 65536);
    }
}

/* Speeds above twice the deceleration: cbmc_brake.c. */
static void fall(int64_t least_speed, int64_t least, int64_t most)
{
    struct path_brake brake;
    brake.numbers = any_numbers();
    brake.at = any_state(0, least, most);
    brake.at.speed_q56 = any_between(least_speed, BRAKE_MOST_RISING - BRAKE_MOST / 2 - 1);
    brake.phase = FALLING;
    path_brake_step(&brake);
    prove(brake.at.fine_q56_mm < 65536);
}

/* --- The release phase --- */

static int64_t least_ticks;
static int64_t most_ticks;

static uint64_t ticks_of(uint64_t way, uint64_t fall)
{
    prove(fall > 0 && fall <= (uint64_t)BRAKE_MOST && way <= (uint64_t)1 << 62);
    return (uint64_t)any_between(least_ticks, most_ticks);
}

/* For least ... most ticks: 2 v / b is that. */
static void rest_in(int64_t least, int64_t most)
{
    struct path_brake brake;
    least_ticks = least;
    most_ticks = most;
    brake.numbers = any_numbers();
    brake.at = any_state(most < 4 ? most * POWER(59) : BRAKE_MOST_RISING, -BRAKE_MOST, -1);
    brake.phase = READY;
    settle(&brake);
    prove(brake.rise_q56 >= 0 && brake.rise_q56 <= BRAKE_MOST);
    prove(brake.rise_less_q56 >= 0 && brake.rise_less_q56 <= BRAKE_MOST);
    prove(brake.settle_ticks > 0 && brake.settle_ticks <= BRAKE_MOST_SETTLE);
}

static void settle_ticks(void)
{
    struct path_brake brake;
    brake.numbers = any_numbers();
    brake.at = any_state(BRAKE_MOST_RISING, -BRAKE_MOST_RISING, 0);
    brake.rise_q56 = any_between(0, BRAKE_MOST);
    brake.rise_less_q56 = any_between(0, BRAKE_MOST);
    brake.settle_ticks = (uint32_t)any_between(1, BRAKE_MOST_SETTLE);
    brake.phase = SETTLING;
    path_brake_step(&brake);
    prove(brake.phase == RESTING || brake.settle_ticks > 0);
    prove(brake.settle_ticks < BRAKE_MOST_SETTLE);
    prove(path_brake_ended(&brake) == 0 || brake.settle_ticks == 0);
}

int main(void)
{
    table();
    begin();
    fall(PATH_BRAKE_NO_SPEED, 0, BRAKE_MOST);
    //@ loop unroll 60;
    for (int bits = 0; bits < 60; bits++) {
        fall(2 * POWER(bits) + 1, 1 - 2 * POWER(bits), -POWER(bits));
    }
    int64_t ticks = 2;
    //@ loop unroll 100;
    while (ticks <= BRAKE_MOST_SETTLE) {
        const int64_t last = ticks + ticks / 8;
        rest_in(ticks, last < BRAKE_MOST_SETTLE ? last : BRAKE_MOST_SETTLE);
        ticks += ticks / 8 + 1;
    }
    settle_ticks();
    reached();
    return 0;
}
