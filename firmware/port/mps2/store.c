/* SPDX-License-Identifier: MIT */
/* The program store in the board's PSRAM: what another board keeps in two banks of flash. Lost with the power. */
#include "port/port.h"

#include <string.h>

#define BANK_BYTES (8u * 1024u * 1024u)

__attribute__((section(".store"), aligned(8))) static uint8_t banks[PORT_STORE_BANKS][BANK_BYTES];

uint32_t port_store_size(void)
{
    return BANK_BYTES;
}

/* Nothing needs erasing before it is written. */
int port_store_erase(unsigned bank)
{
    return bank < PORT_STORE_BANKS ? 0 : PORT_ERR_STORE;
}

int port_store_write(unsigned bank, uint32_t offset, const uint8_t *data, uint32_t size)
{
    if (bank >= PORT_STORE_BANKS || offset > BANK_BYTES || size > BANK_BYTES - offset) {
        return PORT_ERR_STORE;
    }
    memcpy(&banks[bank][offset], data, size);
    return 0;
}

const uint8_t *port_store_data(unsigned bank)
{
    return banks[bank];
}
