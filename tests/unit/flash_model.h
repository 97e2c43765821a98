/* SPDX-License-Identifier: MIT */
/*
 * flash_model: the flash of an STM32G474 in dual-bank mode as its reference manual describes it (RM0440 chapter 3):
 * keys, erasing pages and programming double words of bank 2, error flags; and a supply that can fail at any of these
 * operations. A part of stm32g4_chip. Used by the tests of firmware/port/stm32g4. One thread; no I/O.
 */
#ifndef TESTS_UNIT_FLASH_MODEL_H
#define TESTS_UNIT_FLASH_MODEL_H

#include <setjmp.h>
#include <stdbool.h>
#include <stdint.h>

#define FLASH_MODEL_BYTES 0x40000u /* of bank 2 */

/* The effect of an operation during which the power fails. */
enum flash_model_remains {
    FLASH_MODEL_BEFORE, /* it has not begun */
    FLASH_MODEL_HALF, /* some of its bits have changed, anywhere; error correction fails for these words */
    FLASH_MODEL_QUIET, /* the same, but error correction sees nothing */
    FLASH_MODEL_AFTER, /* it is complete, but no status was returned */
    FLASH_MODEL_REMAINS,
};

/* Erased, as delivered. */
void flash_model_new(void);

/* Memory and registers to come back to. */
void flash_model_save(void);
void flash_model_restore(void);

/* Registers as after power-on; the memory as it is. */
void flash_model_power_on(void);

bool flash_model_covers(uint32_t address);
uint32_t flash_model_read(uint32_t address);
void flash_model_write(uint32_t address, uint32_t value);
const uint8_t *flash_model_memory(uint32_t address);

/* Erases and writes of double words since flash_model_new(). */
uint32_t flash_model_operations(void);

/* The power fails at the operation with this number (from 0): longjmp(*where, 1). UINT32_MAX: never. `seed` decides
 * which bits change. */
void flash_model_cut(uint32_t operation, enum flash_model_remains remains, uint32_t seed,
                     jmp_buf *where);

/* Words of bank 2 now whose error correction fails. */
uint32_t flash_model_spoiled(void);

/* What the memory was written with and how often a page was erased. */
unsigned flash_model_erased(uint32_t page);

/* One-bank mode, as an option bit can have it. */
void flash_model_single_bank(void);

/* The data cache may hold what the memory held before: it was not emptied after the last operation. */
bool flash_model_cache_is_stale(void);

/* The next operation fails with an error flag. */
void flash_model_refuse_next(void);

/* Error correction fails for a word of that bank (1 or 2): as the register reports to the NMI. */
void flash_model_fail_word(unsigned bank);

#endif
