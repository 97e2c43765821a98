/* SPDX-License-Identifier: MIT */
/* Implements port/common/ram_store.h (see there): the store of port.h in memory. Used by port/linux/store and
 * port/mps2/store. Main loop. Writes the memory of the store. */
#include "port/common/ram_store.h"

#include <string.h>

#include "port/port.h"

#define RECORD_BYTES 16u

static uint8_t *bank_at(unsigned bank)
{
    return bank < PORT_STORE_BANKS ? ram_store.memory + (size_t)bank * ram_store.bank_bytes
                                   : ram_store.parameters + (size_t)(bank - PORT_STORE_PARAMETERS) *
                                                                PORT_STORE_PARAMETER_BYTES;
}

uint32_t port_store_size(unsigned bank)
{
    return bank < PORT_STORE_BANKS ? ram_store.bank_bytes : PORT_STORE_PARAMETER_BYTES;
}

__attribute__((weak)) int ram_store_put(uint8_t *at, const uint8_t *data, uint32_t size)
{
    memcpy(at, data, size);
    return 0;
}

/* Clearing the commit record is enough; and on a host, pages that were never written cost nothing. */
int port_store_erase(unsigned bank)
{
    if (bank >= PORT_STORE_BANKS_ALL) {
        return PORT_ERR_STORE;
    }
    uint8_t none[RECORD_BYTES];
    memset(none, 0xFF, sizeof none);
    return ram_store_put(bank_at(bank) + port_store_size(bank) - RECORD_BYTES, none, RECORD_BYTES);
}

int port_store_write(unsigned bank, uint32_t offset, const uint8_t *data, uint32_t size)
{
    if (bank >= PORT_STORE_BANKS_ALL || offset > port_store_size(bank) ||
        size > port_store_size(bank) - offset) {
        return PORT_ERR_STORE;
    }
    return ram_store_put(bank_at(bank) + offset, data, size);
}

const uint8_t *port_store_data(unsigned bank)
{
    return bank_at(bank);
}
