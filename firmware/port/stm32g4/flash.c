/* SPDX-License-Identifier: MIT */
/* Implements port/stm32g4/flash.h (see there): erasing and programming pages of the second flash bank, while the
 * program runs from the first. Used by flash_store.c, port_stm32g4.c and faults.c. Main loop, except
 * flash_take_ecc_error (NMI). Writes the registers of FLASH and the second bank. */
#include "port/stm32g4/flash.h"

#include <string.h>

#include "port/stm32g4/reg_flash.h"

#define ERRORS                                                                                     \
    (FLASH_SR_OPERR | FLASH_SR_PROGERR | FLASH_SR_WRPERR | FLASH_SR_PGAERR | FLASH_SR_SIZERR |     \
     FLASH_SR_PGSERR | FLASH_SR_MISERR | FLASH_SR_FASTERR)
#define ERASED 0xFFu

/* An erase or a write ends within 25 ms. So many polls take longer than that. */
#define POLLS 2000000u

static uint32_t get(uint32_t offset)
{
    return reg_read(FLASH_BASE + offset);
}

static void put(uint32_t offset, uint32_t value)
{
    reg_write(FLASH_BASE + offset, value);
}

bool flash_is_dual(void)
{
    return (get(FLASH_OPTR) & FLASH_OPTR_DBANK) != 0u;
}

static bool is_idle(void)
{
    for (uint32_t i = 0; i < POLLS; ++i) {
        if ((get(FLASH_SR) & FLASH_SR_BSY) == 0u) {
            return true;
        }
    }
    return false;
}

/* Flags of earlier errors would prevent the chip from beginning. */
static bool begin(void)
{
    if (!is_idle()) {
        return false;
    }
    reg_clear(FLASH_BASE + FLASH_ACR, FLASH_ACR_DCEN);
    put(FLASH_SR, ERRORS | FLASH_SR_EOP);
    if ((get(FLASH_CR) & FLASH_CR_LOCK) != 0u) { /* keys for what is open count as wrong ones */
        put(FLASH_KEYR, FLASH_KEY1);
        put(FLASH_KEYR, FLASH_KEY2);
    }
    return true;
}

/* The cache can be emptied only while it is off. */
static bool end(void)
{
    const bool done = is_idle() && (get(FLASH_SR) & ERRORS) == 0u;
    put(FLASH_CR, FLASH_CR_LOCK);
    reg_set(FLASH_BASE + FLASH_ACR, FLASH_ACR_DCRST);
    reg_clear(FLASH_BASE + FLASH_ACR, FLASH_ACR_DCRST);
    reg_set(FLASH_BASE + FLASH_ACR, FLASH_ACR_DCEN);
    return done;
}

static bool is_erased(uint32_t page)
{
    const uint8_t *bytes = reg_memory(FLASH_BANK_2 + page * FLASH_PAGE_BYTES);
    for (uint32_t i = 0; i < FLASH_PAGE_BYTES; ++i) {
        if (bytes[i] != ERASED) {
            return false;
        }
    }
    return true;
}

bool flash_erase_page(uint32_t page)
{
    if (page >= FLASH_PAGES || !begin()) {
        return false;
    }
    const uint32_t what = FLASH_CR_PER | FLASH_CR_BKER | reg_field(FLASH_CR_PNB, page);
    put(FLASH_CR, what);
    put(FLASH_CR, what | FLASH_CR_STRT);
    return end() && is_erased(page);
}

bool flash_program(uint32_t offset, const uint8_t data[8])
{
    if (offset % FLASH_WRITE_BYTES != 0u || offset >= FLASH_BANK_BYTES || !begin()) {
        return false;
    }
    uint32_t words[2];
    memcpy(words, data, sizeof words);
    put(FLASH_CR, FLASH_CR_PG);
    reg_write(FLASH_BANK_2 + offset, words[0]);
    reg_write(FLASH_BANK_2 + offset + 4u, words[1]);
    return end() && memcmp(reg_memory(FLASH_BANK_2 + offset), data, FLASH_WRITE_BYTES) == 0;
}

bool flash_take_ecc_error(void)
{
    const uint32_t status = get(FLASH_ECCR);
    if ((status & FLASH_ECCR_ECCD) == 0u) {
        return false;
    }
    put(FLASH_ECCR, status);
    return (status & FLASH_ECCR_BK_ECC) != 0u;
}
