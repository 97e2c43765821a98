/* SPDX-License-Identifier: MIT */
/*
 * The CRC of any bytes: nothing outside of them and of its table is read. Their value: test_program.c and the golden
 * files. Analysed by Eva in `make proofs` (tools/analysis/prove.py explains the keywords); never executed, touches
 * nothing.
 *
 * prover: eva
 * options: -eva-slevel 0
 * shows: crc32_update
 * mutant: core/crc32.c: i < size; i++ => i <= size; i++
 * mutant: core/crc32.c: nibble_table[16] => nibble_table[15]
 * mutant: core/crc32.c: nibble_table[crc & 15u] => nibble_table[crc & 31u]
 */
#include "proof.h"

#define MOST ((uint32_t)1 << 28) /* no store of a controller is longer */

/*@ requires size <= MOST && \valid_read(bytes + (0 .. size - 1)) && \initialized(bytes + (0 .. size - 1));
    assigns \result \from crc, bytes[0 .. size - 1]; */
uint32_t crc32_update(uint32_t crc, const uint8_t *bytes, uint32_t size);

#include "core/crc32.c"

static uint8_t bytes[MOST];

int main(void)
{
    uint32_t size = (uint32_t)any_between(0, MOST);
    Frama_C_make_unknown((char *)bytes, sizeof bytes);
    crc32_update((uint32_t)any_between(0, UINT32_MAX), bytes, size);
    reached();
    return 0;
}
