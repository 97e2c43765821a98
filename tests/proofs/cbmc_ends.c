/* SPDX-License-Identifier: MIT */
/*
 * The timebase looks for its piece, in a program of any three pieces, with records and without, from any of them and at
 * any time: it never asks for a piece or a record behind the last.
 *
 * prover: cbmc
 * options: --unwind 6 --pointer-check --bounds-check
 * shows: timebase_find_piece
 * mutant: core/timebase_private.h: tb->piece + 1u == tb->program->header.piece_count => tb->piece + 2u == tb->program->header.piece_count
 * mutant: core/program_clock.c: if (time_q42_s >= tb->duration_q42_s) { => if (time_q42_s > tb->duration_q42_s) {
 * mutant: core/timebase_private.h: while (time_q32_s >= record->end_q32_s && left > 0) => while (time_q32_s <= record->end_q32_s && left > 0)
 */
#include "proof.h"

#include "core/program_clock.c"

#define COUNT 3u

uint64_t program_piece_duration(const struct program *p, uint32_t i)
{
    prove(i < p->header.piece_count);
    uint64_t duration = nondet_uint64();
    __CPROVER_assume(duration > 0 && duration <= (uint64_t)1 << 54);
    return duration;
}

static struct prepared_piece records[COUNT];
static struct program program;
static struct kernel kernel = {.piece_size = sizeof(struct prepared_piece) -
                                             offsetof(struct prepared_piece, feed)};

/* In piece i, whose end has been reached. */
static void place(struct timebase *tb, uint32_t i)
{
    tb->program = &program;
    tb->duration_q42_s = program.header.duration_q32_s << PROGRAM_CLOCK_Q32_TO_Q42;
    tb->time_q42_s = (uint64_t)any_between(0, INT64_MAX);
    tb->rest = (uint32_t)any_between(0, PROGRAM_CLOCK_REST_UNIT - 1);
    tb->fine = (uint32_t)any_between(0, (1 << PROGRAM_CLOCK_FINE_BITS) - 1);
    tb->piece = i;
    tb->piece_end_q42_s = timebase_end_q42_s(tb, nondet_uint64());
    tb->record = program.prepared_for != 0 ? &records[i] : 0;
}

void harness(void)
{
    struct timebase tb;
    program.header.piece_count = COUNT;
    program.header.duration_q32_s = (uint64_t)any_between(1, INT64_MAX >> PROGRAM_CLOCK_Q32_TO_Q42);
    program.prepared_for = nondet_uint32() != 0 ? &kernel : 0;
    for (uint32_t k = 0; k < COUNT; k++) {
        records[k].end_q32_s = k + 1u == COUNT ? program.header.duration_q32_s : nondet_uint64();
    }
    uint32_t i = nondet_uint32();
    __CPROVER_assume(i < COUNT);
    place(&tb, i);
    const uint64_t time_q42_s = timebase_rounded_q42(&tb);
    if (time_q42_s >= tb.piece_end_q42_s) {
        pass_end(&tb, time_q42_s);
    }
    prove(tb.piece < COUNT);
    prove(tb.record == 0 || tb.record == &records[tb.piece]);
    reached();
}
