/* SPDX-License-Identifier: MIT */
#include "port/common/ram_store.h"

#include <string.h>

#include "port/port.h"

static uint8_t *bank_at(unsigned bank)
{
    return ram_store.memory + (size_t)bank * ram_store.bank_bytes;
}

uint32_t port_store_size(void)
{
    return ram_store.bank_bytes;
}

/* Nothing needs erasing before it is written; and on a host, pages that were never written cost nothing. */
int port_store_erase(unsigned bank)
{
    return bank < PORT_STORE_BANKS ? 0 : PORT_ERR_STORE;
}

int port_store_write(unsigned bank, uint32_t offset, const uint8_t *data, uint32_t size)
{
    if (bank >= PORT_STORE_BANKS || offset > ram_store.bank_bytes ||
        size > ram_store.bank_bytes - offset) {
        return PORT_ERR_STORE;
    }
    memcpy(bank_at(bank) + offset, data, size);
    return 0;
}

const uint8_t *port_store_data(unsigned bank)
{
    return bank_at(bank);
}
