/* SPDX-License-Identifier: MIT */
/*
 * program_open for every image of any size: it reads inside the image only, and the sizes that it accepts are those of
 * its axes and flags. That its counts fit is shown by cbmc_record.c and cbmc_compact.c. Whether the CRC is right is
 * left open. Analysed by CBMC in `make proofs` (tools/analysis/prove.py explains the keywords); never executed, touches
 * nothing.
 *
 * prover: cbmc
 * options: --unwind 40
 * replaces: read_u16:some_u16 read_u32:some_u32 read_u64:some_u64
 * shows: program_open
 * mutant: core/program.c: h->image_size > size || =>
 * mutant: core/program.c: NULL || size < PROGRAM_HEADER_SIZE => NULL || size < 64
 */
#include <stdlib.h>

#include "proof.h"

int nondet_int(void);

int memcmp(const void *a, const void *b, size_t size)
{
    prove(__CPROVER_r_ok(a, size) && __CPROVER_r_ok(b, size));
    return nondet_int();
}

void *memcpy(void *to, const void *from, size_t size)
{
    prove(__CPROVER_w_ok(to, size) && __CPROVER_r_ok(from, size));
    return to;
}

uint32_t some_u16(const uint8_t *b)
{
    prove(__CPROVER_r_ok(b, 2));
    return nondet_uint32() & 0xFFFFu;
}

uint32_t some_u32(const uint8_t *b)
{
    prove(__CPROVER_r_ok(b, 4));
    return nondet_uint32();
}

uint64_t some_u64(const uint8_t *b)
{
    prove(__CPROVER_r_ok(b, 8));
    return nondet_uint64();
}

uint32_t crc32_update(uint32_t crc, const uint8_t *bytes, uint32_t size)
{
    prove(__CPROVER_r_ok(bytes, size));
    return crc ^ nondet_uint32();
}

#include "core/program.c"

void harness(void)
{
    uint32_t size = nondet_uint32();
    uint8_t *image = malloc(size);
    struct program p;
    if (program_open(&p, image, size) == 0) {
        const struct program_header *h = &p.header;
        prove(h->segment_count > 0 && h->piece_count > 0);
        prove(p.size == h->image_size && p.size <= size);
        prove(h->axis_count >= PROGRAM_PLANE && h->axis_count <= PROGRAM_AXES);
        uint32_t extras = h->axis_count > 3u ? h->axis_count - 3u : 0u;
        int compact = (h->flags & PROGRAM_FLAG_COMPACT) != 0u;
        uint32_t segment = segment_size(h);
        prove(piece_size(h) + stop_size(h) == (compact ? 69u + 12u : 88u + 16u));
        prove(compact || segment == (h->axis_count == 2u ? 72u : 104u + 38u * extras));
        prove(!compact || segment == (h->axis_count == 2u ? 57u : 100u + 37u * extras));
        prove(h->header_size == 112u + 8u * h->axis_count);
        reached();
    }
}
