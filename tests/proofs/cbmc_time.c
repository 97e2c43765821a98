/* SPDX-License-Identifier: MIT */
/*
 * The time of an arc length, in a program of three pieces of any durations and starts: no piece is requested that there
 * is not, none at a time beyond its end, and the time is never beyond the program's. A round of the bisection, from any
 * state that a round can leave, halves the remainder at least: it ends after 64. Analysed by CBMC in `make proofs`
 * (tools/analysis/prove.py explains the keywords); never executed, touches nothing.
 *
 * prover: cbmc
 * options: --unwind 6 --unwinding-assertions
 * instead: core/program_time.c: while (low < high) { => while (goes_on(&low, &high)) {
 * replaces: program_piece_get:some_piece feed_piece_set:some_feed feed_piece_at:some_point
 * shows: program_time_at_q42
 * mutant: core/program_time.c: i < p->header.piece_count => i <= p->header.piece_count
 * mutant: core/program_time.c: low = middle + 1u => low = middle
 * mutant: core/program_time.c: middle = low + (high - low) / 2u => middle = low + (high - low + 2u) / 2u
 * mutant: core/program_time.c: qmath_q42_of_q32(piece->duration_q32_s) => qmath_q42_of_q32(2u * piece->duration_q32_s)
 */
#include "proof.h"

static int goes_on(uint64_t *low, uint64_t *high);

#include "core/program_time.c"

#define COUNT 3u

static uint64_t duration_q32_s[COUNT];
static uint64_t present_q32_s; /* duration of the piece that is evaluated */

static int rounds;
static uint64_t left; /* before the round */

/* Before the only round: any state; after it: not out of bounds, and half as much remains. */
static int goes_on(uint64_t *low, uint64_t *high)
{
    if (rounds++ == 0) {
        prove(*low == 0 && *high == present_q32_s << 10);
        *low = nondet_uint64();
        *high = nondet_uint64();
        assume(*low <= *high && *high <= present_q32_s << 10);
        left = *high - *low;
        return *low < *high;
    }
    prove(*low <= *high && *high <= present_q32_s << 10);
    prove(left == 0 || *high - *low <= left / 2u);
    return 0;
}

void some_piece(const struct program *p, uint32_t i, struct program_piece *out)
{
    prove(i < p->header.piece_count);
    out->duration_q32_s = duration_q32_s[i];
}

void some_feed(void *piece, const struct program_piece *from)
{
    (void)piece;
    present_q32_s = from->duration_q32_s;
}

void some_point(const void *piece, struct feed_point *out, uint64_t t_q42_s)
{
    (void)piece;
    prove(t_q42_s < present_q32_s << 10);
    out->arc_length_q40_mm = nondet_int64();
}

void harness(void)
{
    struct program p;
    p.header.piece_count = COUNT;
    p.header.duration_q32_s = 0;
    for (uint32_t i = 0; i < COUNT; i++) {
        duration_q32_s[i] = (uint64_t)any_between(1, POWER(52));
        p.header.duration_q32_s += duration_q32_s[i];
    }
    int64_t arc_length_q40_mm = nondet_int64();
    uint64_t time_q42_s = program_time_at_q42(&p, arc_length_q40_mm);
    prove(time_q42_s <= p.header.duration_q32_s << 10);
    prove(arc_length_q40_mm > 0 || time_q42_s == 0);
    reached();
}
