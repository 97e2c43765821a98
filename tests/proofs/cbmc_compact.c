/* SPDX-License-Identifier: MIT */
/*
 * Compact segments, pieces, stops and events lie inside the image, as those of cbmc_record.c do: every record begins
 * where it has its whole length before the end of an image of up to 8 KiB that program_open accepts. Analysed by CBMC
 * in `make proofs` (tools/analysis/prove.py explains the keywords); never executed, touches nothing.
 *
 * prover: cbmc
 * options: --unwind 40
 * shows: segment_size piece_size stop_size
 * mutant: core/program.c: need != h->image_size => need < h->image_size
 * mutant: core/program.c: (uint64_t)h->segment_count * segment_size(h) => h->segment_count * segment_size(h)
 * mutant: core/program.c: ? PROGRAM_COMPACT_PIECE_SIZE : PROGRAM_PIECE_SIZE => ? 68u : PROGRAM_PIECE_SIZE
 * mutant: core/program.c: ? PROGRAM_COMPACT_STOP_SIZE : PROGRAM_STOP_SIZE => ? 11u : PROGRAM_STOP_SIZE
 */
#include "core/program.c"
#include "proof.h"
#include "any_header.h"

uint32_t crc32_update(uint32_t crc, const uint8_t *bytes, uint32_t size)
{
    (void)bytes;
    (void)size;
    return crc;
}

/* In a program with so many path axes, whose segments have so many bytes. */
static void places(uint32_t axis_count, uint32_t segment)
{
    uint32_t size = nondet_uint32();
    uint32_t i = nondet_uint32();
    __CPROVER_assume(size <= 1u << 13);
    const struct program_header h = any_header(axis_count, PROGRAM_FLAG_COMPACT);
    prove(segment_size(&h) == segment);
    if (check_size(&h, size) != 0) {
        return;
    }
    uint64_t pieces = h.header_size + (uint64_t)h.segment_count * segment;
    uint64_t stops = pieces + (uint64_t)h.piece_count * 69u;
    uint64_t events = stops + (uint64_t)h.piece_count * 12u;
    if (i < h.segment_count) {
        prove(h.header_size + (uint64_t)i * segment + segment <= size);
    }
    if (i < h.piece_count) {
        prove(pieces + (uint64_t)i * 69u + 69u <= size && stops + (uint64_t)i * 12u + 12u <= size);
        reached();
    }
    prove(events + (uint64_t)h.event_count * PROGRAM_EVENT_SIZE <= size);
}

void harness(void)
{
    places(PROGRAM_PLANE, 57);
    places(PROGRAM_SPACE, 100);
    places(PROGRAM_AXES, 100 + 3 * 37);
}
