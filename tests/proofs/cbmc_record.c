/* SPDX-License-Identifier: MIT */
/*
 * Segments, pieces and events lie inside the image: every record begins where it has its whole length before the end of
 * an image of up to 16 KiB that program_open accepts, and its readers stay inside the record. (For any size: h + s i +
 * s <= h + s n as i < n; a line that SAT solvers find hard with 32 bits.) Analysed by CBMC in `make proofs`
 * (tools/analysis/prove.py explains the keywords); never executed, touches nothing.
 *
 * prover: cbmc
 * options: --unwind 40
 * replaces: segment_bytes:some_segment piece_bytes:some_piece event_bytes:some_event
 * shows: read_u16 read_u32 read_u64 segment_bytes piece_bytes event_bytes
 * mutant: core/program.c: out->value = (int32_t)read_u32(b + 12) => out->value = (int32_t)read_u32(b + 13)
 * mutant: core/program.c: b[9u + k] => b[10u + k]
 * mutant: core/program.c: b + 32 + 16 * k => b + 40 + 16 * k
 * mutant: core/program.c: read_preimage(b + 32, => read_preimage(b + 40,
 * mutant: core/program.c: read_extra(at + 8, => read_extra(at + 14,
 * mutant: core/program.c: read_extra(at + COMPACT_COEFFICIENTS, => read_extra(at + 8,
 * mutant: core/program.c: b + COMPACT_POWERS + 6 * k => b + COMPACT_POWERS + 11 * k
 * mutant: core/program.c: need != h->image_size => need < h->image_size
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

const uint8_t *some_segment(const struct program *p, uint32_t i)
{
    (void)i;
    return __CPROVER_allocate(segment_size(&p->header), 0);
}

const uint8_t *some_piece(const struct program *p, uint32_t i)
{
    (void)i;
    return __CPROVER_allocate(piece_size(&p->header), 0);
}

const uint8_t *some_event(const struct program *p, uint32_t i)
{
    (void)p;
    (void)i;
    return __CPROVER_allocate(PROGRAM_EVENT_SIZE, 0);
}

static void readers(void)
{
    struct program p;
    p.header.axis_count = (uint16_t)any_between(PROGRAM_PLANE, PROGRAM_AXES);
    struct program_segment g;
    struct program_piece c;
    struct program_override bounds;
    uint32_t i = nondet_uint32();
    program_segment_get(&p, i, &g);
    program_segment_start(&p, i);
    program_piece_get(&p, i, &c);
    program_piece_duration(&p, i);
    program_piece_override(&p, i, &bounds);
    struct program_event event;
    program_event_get(&p, i, &event);
    program_event_place(&p, i);
}

/* In a program with so many path axes. */
static void places(uint32_t axis_count)
{
    uint32_t size = nondet_uint32();
    uint32_t i = nondet_uint32();
    __CPROVER_assume(size <= 1u << 14);
    const struct program_header h = any_header(axis_count, 0); /* compact ones: cbmc_compact.c */
    uint32_t segment = segment_size(&h);
    uint32_t piece = piece_size(&h);
    if (check_size(&h, size) != 0) {
        return;
    }
    uint64_t pieces = h.header_size + (uint64_t)h.segment_count * segment;
    if (i < h.segment_count) {
        prove(h.header_size + (uint64_t)i * segment + segment <= size);
    }
    if (i < h.piece_count) {
        prove(pieces + (uint64_t)i * piece + piece <= size);
        reached();
    }
    uint64_t events = pieces + (uint64_t)h.piece_count * (piece + stop_size(&h));
    if (i < h.event_count) {
        prove(events + (uint64_t)i * PROGRAM_EVENT_SIZE + PROGRAM_EVENT_SIZE <= size);
    }
}

void harness(void)
{
    readers();
    for (uint32_t axis_count = PROGRAM_PLANE; axis_count <= PROGRAM_AXES; axis_count++) {
        places(axis_count);
    }
}
