/* SPDX-License-Identifier: MIT */
/* The store and the memory of streamed jobs of port/port.h. The store is the board's PSRAM, 16 MiB. The ring of
 * streamed jobs has as much RAM as a microcontroller could provide. Used by firmware/app and the ports. Contexts:
 * port/port.h. Defines memory, and returns its addresses; port/common/ram_store writes it. */
#include "port/common/ram_store.h"
#include "port/port.h"

#define BANK_BYTES (8u * 1024u * 1024u - PORT_STORE_PARAMETER_BYTES)

static uint8_t banks[PORT_STORE_BANKS][BANK_BYTES] __attribute__((section(".store"), aligned(8)));
static uint8_t parameters[RAM_STORE_PARAMETER_BYTES] __attribute__((section(".store"), aligned(8)));
struct ram_store ram_store = {
    .memory = banks[0], .bank_bytes = sizeof banks[0], .parameters = parameters};

#if defined(__ARM_ARCH_6M__)
#define RING_BYTES  (8u * 1024u)
#define CACHE_BYTES (5u * 1024u) /* for six axes */
#else
#define RING_BYTES  (48u * 1024u)
#define CACHE_BYTES (8u * 1024u)
#endif

static uint8_t ring[RING_BYTES] __attribute__((aligned(8)));
static uint8_t cache[CACHE_BYTES] __attribute__((aligned(8)));

uint8_t *port_stream_memory(uint32_t *size)
{
    *size = sizeof ring;
    return ring;
}

uint8_t *port_cache_memory(uint32_t *size)
{
    *size = sizeof cache;
    return cache;
}
