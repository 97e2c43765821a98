/* SPDX-License-Identifier: MIT */
/*
 * Segments and pieces lie inside the image: every record begins where it has its whole length before the end of an
 * image of up to 256 KiB (a bank of the STM32G474) that program_open accepts, and its readers stay inside the record.
 * (For any size: 128 + 72 i + 72 <= 128 + 72 n as i < n; a line that SAT solvers find hard with 32 bits.)
 *
 * prover: cbmc
 * options: --unwind 40
 * replaces: segment_bytes:some_segment piece_bytes:some_piece
 * shows: read_u16 read_u32 read_u64 segment_bytes piece_bytes
 * mutant: core/program.c: b[81u + k] => b[82u + k]
 * mutant: core/program.c: b + 32 + 16 * k => b + 40 + 16 * k
 * mutant: core/program.c: need != h->image_size => need < h->image_size
 */
#include "core/program.c"
#include "proof.h"

uint32_t crc32_update(uint32_t crc, const uint8_t *bytes, uint32_t size)
{
    (void)bytes;
    (void)size;
    return crc;
}

const uint8_t *some_segment(const struct program *p, uint32_t i)
{
    (void)p;
    (void)i;
    return __CPROVER_allocate(PROGRAM_SEGMENT_SIZE, 0);
}

const uint8_t *some_piece(const struct program *p, uint32_t i)
{
    (void)p;
    (void)i;
    return __CPROVER_allocate(PROGRAM_PIECE_SIZE, 0);
}

static void readers(void)
{
    struct program p;
    struct program_segment g;
    struct program_piece c;
    struct program_override bounds;
    uint32_t i = nondet_uint32();
    program_segment_get(&p, i, &g);
    program_segment_start(&p, i);
    program_piece_get(&p, i, &c);
    program_piece_duration(&p, i);
    program_piece_override(&p, i, &bounds);
}

static void places(void)
{
    struct program_header h;
    uint32_t size = nondet_uint32();
    uint32_t i = nondet_uint32();
    __CPROVER_assume(size <= 1u << 18);
    h.image_size = nondet_uint32();
    h.segment_count = nondet_uint32();
    h.piece_count = nondet_uint32();
    if (check_size(&h, size) != 0) {
        return;
    }
    uint64_t pieces = PROGRAM_HEADER_SIZE + (uint64_t)h.segment_count * PROGRAM_SEGMENT_SIZE;
    if (i < h.segment_count) {
        prove(PROGRAM_HEADER_SIZE + (uint64_t)i * PROGRAM_SEGMENT_SIZE + PROGRAM_SEGMENT_SIZE <=
              size);
    }
    if (i < h.piece_count) {
        prove(pieces + (uint64_t)i * PROGRAM_PIECE_SIZE + PROGRAM_PIECE_SIZE <= size);
        reached();
    }
}

void harness(void)
{
    readers();
    places();
}
