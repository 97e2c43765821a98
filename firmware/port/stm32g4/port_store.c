/* SPDX-License-Identifier: MIT */
/* The store of port/port.h: the banks of flash_store, with the watchdog fed in between; and the ring of streamed jobs
 * in RAM. Used by firmware/app and the ports. Main loop, except where port/port.h states otherwise. Erases and writes
 * the second flash bank by flash_store, and feeds the watchdog. */
#include "port/port.h"
#include "port/stm32g4/flash_store.h"

#define RING_BYTES  (48u * 1024u)
#define CACHE_BYTES (8u * 1024u)

uint32_t port_store_size(unsigned bank)
{
    return flash_store_size(bank);
}

/* The main loop may be in the store for a second or two without a wait in between. */
int port_store_erase(unsigned bank)
{
    port_progress();
    return flash_store_erase(bank) ? 0 : PORT_ERR_STORE;
}

int port_store_write(unsigned bank, uint32_t offset, const uint8_t *data, uint32_t size)
{
    port_progress();
    return flash_store_write(bank, offset, data, size) ? 0 : PORT_ERR_STORE;
}

const uint8_t *port_store_data(unsigned bank)
{
    return flash_store_data(bank);
}

uint8_t *port_stream_memory(uint32_t *size)
{
    static uint8_t ring[RING_BYTES] __attribute__((aligned(8)));
    *size = sizeof ring;
    return ring;
}

uint8_t *port_cache_memory(uint32_t *size)
{
    static uint8_t cache[CACHE_BYTES] __attribute__((aligned(8)));
    *size = sizeof cache;
    return cache;
}
