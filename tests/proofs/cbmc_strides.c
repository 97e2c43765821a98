/* SPDX-License-Identifier: MIT */
/*
 * Segments, pieces, stops and events follow each other, with and without compact records: each begins where
 * cbmc_record.c and cbmc_compact.c say. Shown of the first ones, since a place is linear in the number of its record
 * and in the counts. The reader of stops stays inside its record: the last one, in an image that ends with it. Analysed
 * by CBMC in `make proofs` (tools/analysis/prove.py explains the keywords); never executed, touches nothing.
 *
 * prover: cbmc
 * options: --unwind 40
 * shows: segment_bytes piece_bytes stop_bytes event_bytes program_stop_get read_u24
 * mutant: core/program.c: (size_t)i * segment_size(&p->header) => (size_t)i * program_segment_size(p->header.axis_count)
 * mutant: core/program.c: (size_t)i * piece_size(&p->header) => (size_t)i * PROGRAM_PIECE_SIZE
 * mutant: core/program.c: (size_t)i * stop_size(&p->header) => (size_t)i * PROGRAM_STOP_SIZE
 * mutant: core/program.c: (size_t)i * PROGRAM_EVENT_SIZE => (size_t)i * PROGRAM_STOP_SIZE + i
 * mutant: core/program.c: b + COMPACT_BOUNDS; => b + 8;
 * mutant: core/program.c: b + 12 : b + 8 => b + 14 : b + 8
 */
#include "core/program.c"
#include "proof.h"

#define FEW 3 /* records of each kind */

uint32_t crc32_update(uint32_t crc, const uint8_t *bytes, uint32_t size)
{
    (void)bytes;
    (void)size;
    return crc;
}

/* Where the records begin, in an image with few of them. */
static void strides(uint16_t flags, uint32_t axis_count, size_t segment, size_t piece, size_t stop)
{
    static const uint8_t image[1u << 12];
    struct program p;
    const uint32_t i = (uint32_t)any_between(0, FEW);
    const uint32_t segments = (uint32_t)any_between(0, FEW);
    const uint32_t pieces = (uint32_t)any_between(0, FEW);
    p.image = image;
    p.header.flags = flags;
    p.header.axis_count = (uint16_t)axis_count;
    p.header.header_size = (uint16_t)program_header_size(axis_count);
    p.header.segment_count = segments;
    p.header.piece_count = pieces;
    const uint8_t *first_piece = image + p.header.header_size + segments * segment;
    const uint8_t *first_stop = first_piece + pieces * piece;
    const uint8_t *first_event = first_stop + pieces * stop;
    prove(segment_bytes(&p, i) == image + p.header.header_size + i * segment);
    prove(piece_bytes(&p, i) == first_piece + i * piece);
    prove(stop_bytes(&p, i) == first_stop + i * stop);
    prove(event_bytes(&p, i) == first_event + (size_t)i * PROGRAM_EVENT_SIZE);
    reached();
}

static void last_stop(uint16_t flags, size_t piece, size_t stop)
{
    struct program p;
    struct program_stop out;
    p.image = __CPROVER_allocate(FEW * (piece + stop), 0);
    p.header.flags = flags;
    p.header.axis_count = PROGRAM_PLANE;
    p.header.header_size = 0;
    p.header.segment_count = 0;
    p.header.piece_count = FEW;
    program_stop_get(&p, FEW - 1u, PROGRAM_STOP_HOLD, &out);
    program_stop_get(&p, FEW - 1u, PROGRAM_STOP_FAULT, &out);
}

void harness(void)
{
    last_stop(0, 88, 16);
    last_stop(PROGRAM_FLAG_COMPACT, 69, 12);
    strides(0, PROGRAM_PLANE, 72, 88, 16);
    strides(PROGRAM_FLAG_COMPACT, PROGRAM_PLANE, 57, 69, 12);
    for (uint32_t extra = 0; extra <= PROGRAM_AXES - PROGRAM_SPACE; extra++) {
        strides(0, PROGRAM_SPACE + extra, 104u + 38u * extra, 88, 16);
        strides(PROGRAM_FLAG_COMPACT, PROGRAM_SPACE + extra, 100u + 37u * extra, 69, 12);
    }
}
