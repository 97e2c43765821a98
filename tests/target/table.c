/* SPDX-License-Identifier: MIT */
/* Implements table.h (see there): the place after the programs in the store where coefficient records go. Part of the
 * images setpoints and isr; on one board it erases and writes flash pages. */
#include "table.h"

#include <string.h>

#include "core/coefficients.h"

extern uint8_t startup_store_base[];

#if defined(__ARM_ARCH_6M__)

/* nRF51822: the store is flash, written word by word through its controller (reference manual 3.0, section 6). */
#define TABLE_SIZE      0xC000u
#define PAGE            1024u
#define NVMC_READY      (*(volatile const uint32_t *)0x4001E400u)
#define NVMC_CONFIG     (*(volatile uint32_t *)0x4001E504u)
#define NVMC_ERASE_PAGE (*(volatile uint32_t *)0x4001E508u)

enum { READ_ONLY, WRITE, ERASE };

static void wait(void)
{
    while (NVMC_READY == 0u) {
    }
}

static void erase(void)
{
    NVMC_CONFIG = ERASE;
    for (uint32_t offset = 0; offset < TABLE_SIZE; offset += PAGE) {
        NVMC_ERASE_PAGE = (uint32_t)(uintptr_t)(startup_store_base + TABLE_AT + offset);
        wait();
    }
    NVMC_CONFIG = WRITE;
}

/* Records are whole words. */
static void put(uint32_t offset, const uint8_t *bytes, uint32_t size)
{
    for (uint32_t k = 0; k < size; k += 4u) {
        uint32_t word;
        memcpy(&word, bytes + k, sizeof word);
        *(volatile uint32_t *)(void *)(startup_store_base + TABLE_AT + offset + k) = word;
        wait();
    }
}

#else

#define TABLE_SIZE 0xE0000u

static void erase(void)
{
}

static void put(uint32_t offset, const uint8_t *bytes, uint32_t size)
{
    memcpy(startup_store_base + TABLE_AT + offset, bytes, size);
}

#endif

static int write_records(void *context, const uint8_t *bytes, uint32_t size)
{
    uint32_t *offset = context;
    put(*offset, bytes, size);
    *offset += size;
    return 0;
}

int table_make(struct program *program, uint32_t kernel)
{
    const struct kernel *made_for = kernel_find(kernel);
    uint32_t offset = 0;
    if (made_for == NULL || coefficients_size(program, made_for) > TABLE_SIZE) {
        return -1;
    }
    erase();
    (void)coefficients_make(program, made_for, write_records, &offset);
    coefficients_attach(program, made_for, startup_store_base + TABLE_AT);
    return 0;
}
