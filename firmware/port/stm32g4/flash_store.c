/* SPDX-License-Identifier: MIT */
/* Implements port/stm32g4/flash_store.h (see there): the banks of port.h's store in the chip's second flash bank. Used
 * by port_store.c. Main loop. Erases and writes the second flash bank by flash.c. */
#include "port/stm32g4/flash_store.h"

#include <string.h>

#include "port/stm32g4/flash.h"
#include "port/stm32g4/reg_flash.h"

#define PROGRAM_BANKS 2u

static struct {
    bool open; /* bank has been erased and takes writes */
    unsigned bank;
    uint32_t end; /* of what has been written, those that wait included */
    uint8_t waiting[FLASH_WRITE_BYTES];
} self;

/* In the second flash bank. */
static uint32_t start_of(unsigned bank)
{
    return bank <= PROGRAM_BANKS ? bank * FLASH_STORE_BYTES
                                 : PROGRAM_BANKS * FLASH_STORE_BYTES +
                                       (bank - PROGRAM_BANKS) * FLASH_STORE_PARAMETER_BYTES;
}

static uint32_t last_page_at(unsigned bank)
{
    return flash_store_size(bank) - FLASH_PAGE_BYTES;
}

uint32_t flash_store_size(unsigned bank)
{
    if (bank >= FLASH_STORE_BANKS) {
        return 0;
    }
    return bank < PROGRAM_BANKS ? FLASH_STORE_BYTES : FLASH_STORE_PARAMETER_BYTES;
}

bool flash_store_erase(unsigned bank)
{
    self.open = bank < FLASH_STORE_BANKS &&
                flash_erase_page((start_of(bank) + last_page_at(bank)) / FLASH_PAGE_BYTES);
    self.bank = bank;
    self.end = 0;
    return self.open;
}

/* The last page has been erased already. */
static bool prepare_page(uint32_t offset)
{
    return offset % FLASH_PAGE_BYTES != 0u || offset == last_page_at(self.bank) ||
           flash_erase_page((start_of(self.bank) + offset) / FLASH_PAGE_BYTES);
}

/* Programs the waiting bytes, filled up with the value of erased memory. */
static bool program_waiting(void)
{
    const uint32_t count =
        self.end % FLASH_WRITE_BYTES == 0u ? FLASH_WRITE_BYTES : self.end % FLASH_WRITE_BYTES;
    const uint32_t offset = self.end - count;
    memset(self.waiting + count, 0xFF, FLASH_WRITE_BYTES - count);
    return prepare_page(offset) && flash_program(start_of(self.bank) + offset, self.waiting);
}

/* Only into the last page, as the pages between have not been erased. */
static bool skip_to(uint32_t offset)
{
    if (offset < last_page_at(self.bank) || offset % FLASH_WRITE_BYTES != 0u) {
        return false;
    }
    if (self.end % FLASH_WRITE_BYTES != 0u && !program_waiting()) {
        return false;
    }
    self.end = offset;
    return true;
}

static bool write_byte(uint8_t byte)
{
    self.waiting[self.end % FLASH_WRITE_BYTES] = byte;
    self.end++;
    return self.end % FLASH_WRITE_BYTES != 0u || program_waiting();
}

static bool fits(unsigned bank, uint32_t offset, uint32_t size)
{
    return self.open && bank == self.bank && offset >= self.end &&
           offset <= flash_store_size(bank) && size <= flash_store_size(bank) - offset;
}

bool flash_store_write(unsigned bank, uint32_t offset, const uint8_t *data, uint32_t size)
{
    bool good = fits(bank, offset, size) && (offset == self.end || skip_to(offset));
    for (uint32_t i = 0; i < size && good; ++i) {
        good = write_byte(data[i]);
    }
    self.open = self.open && good;
    return good;
}

const uint8_t *flash_store_data(unsigned bank)
{
    return reg_memory(FLASH_BANK_2 + start_of(bank));
}
