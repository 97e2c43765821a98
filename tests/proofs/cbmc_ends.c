/* SPDX-License-Identifier: MIT */
/*
 * The program clock searches its piece, in a program of any three pieces of which any first ones have records, from any
 * of these and at any time: it never reads a record after the last, stops at the first piece that ends after the time,
 * and is at the duration in no other than the last state of the program. Analysed by CBMC in `make proofs`
 * (tools/analysis/prove.py explains the keywords); never executed, touches nothing.
 *
 * prover: cbmc
 * options: --unwind 6 --pointer-check --bounds-check
 * shows: program_clock_find_piece
 * mutant: core/program_clock.h: clock->piece = record->number => clock->piece = record->number + 1u
 * mutant: core/program_clock.h: record = coefficients_piece_next(record); => record++;
 * mutant: core/program_clock.h: if (time_q42_s >= clock->duration_q42_s) { => if (time_q42_s > clock->duration_q42_s) {
 * mutant: core/program_clock.h: while (time_q42_s >= record->end_q42_s && left > 0) => while (time_q42_s <= record->end_q42_s && left > 0)
 */
#include "proof.h"

#include "core/program_clock.c"

#define COUNT 3u

static struct coefficients_piece records[COUNT];
static struct program program;

/* In piece i, whose end has been reached. */
static void place(struct program_clock *clock, uint32_t i)
{
    clock->program = &program;
    clock->duration_q42_s = qmath_q42_of_q32(program.header.duration_q32_s);
    clock->time_q42_s = (uint64_t)any_between(0, INT64_MAX);
    clock->remainder = (uint32_t)any_between(0, PROGRAM_CLOCK_REMAINDER_UNIT - 1);
    clock->fine = (uint32_t)any_between(0, (1 << PROGRAM_CLOCK_FINE_BITS) - 1);
    clock->piece = i;
    clock->record = &records[i];
}

void harness(void)
{
    struct program_clock clock;
    program.header.piece_count = COUNT;
    program.header.duration_q32_s = (uint64_t)any_between(1, INT64_MAX >> 10);
    const uint32_t last = nondet_uint32();
    __CPROVER_assume(last < COUNT);
    for (uint32_t k = 0; k < COUNT; k++) {
        records[k].number = k;
        records[k].next = k < last ? (int32_t)sizeof records[0] : 0;
        records[k].end_q42_s = k + 1u == COUNT
                                   ? qmath_q42_of_q32(program.header.duration_q32_s)
                                   : nondet_uint64();
    }
    uint32_t i = nondet_uint32();
    __CPROVER_assume(i <= last);
    place(&clock, i);
    const uint64_t time_q42_s = program_clock_time_q42(&clock);
    if (time_q42_s >= clock.record->end_q42_s) {
        const uint64_t passed_q42_s = program_clock_pass_end(&clock, time_q42_s);
        prove(passed_q42_s <= clock.duration_q42_s);
        prove(passed_q42_s < clock.duration_q42_s ||
              (clock.time_q42_s == passed_q42_s && clock.remainder == 0u && clock.fine == 0u));
        prove(passed_q42_s == clock.duration_q42_s || i == last ||
              time_q42_s >= records[i + 1u].end_q42_s || clock.piece == i + 1u);
    }
    prove(clock.piece <= last);
    prove(clock.record == &records[clock.piece]);
    reached();
}
