/* SPDX-License-Identifier: MIT */
/*
 * ram_store: the store of port.h in memory. For Linux (port/linux/store.h: also a file that is mapped there), emulated
 * boards, and the beginning of a new port. A real board keeps its content in flash (port/stm32g4/flash_store.h). Used
 * by port/linux/store and port/mps2/store. Main loop. Writes the memory of the store.
 *
 * The memory belongs to the port, which defines `ram_store`:
 *
 *     static uint8_t banks[PORT_STORE_BANKS][BANK_BYTES] __attribute__((section(".store"), aligned(8)));
 *     static uint8_t parameters[RAM_STORE_PARAMETER_BYTES] __attribute__((section(".store"), aligned(8)));
 *     struct ram_store ram_store = {banks[0], sizeof banks[0], parameters};
 *
 * Section .store is the memory STORE of the linker scripts in firmware/targets. It is lost with the power. The
 * application calls the functions of port.h, from the main loop; nothing else reads or writes this memory.
 */
#ifndef PORT_COMMON_RAM_STORE_H
#define PORT_COMMON_RAM_STORE_H

#include <stdint.h>

#include "port/port.h"

/* Of all parameter banks together. */
#define RAM_STORE_PARAMETER_BYTES                                                                  \
    ((PORT_STORE_BANKS_ALL - PORT_STORE_BANKS) * PORT_STORE_PARAMETER_BYTES)

struct ram_store {
    uint8_t *memory;     /* PORT_STORE_BANKS banks, one after the other, aligned to 8 */
    uint32_t bank_bytes; /* of each of these */
    uint8_t *parameters; /* RAM_STORE_PARAMETER_BYTES, aligned to 8 */
};

/* The port fills it before the first function port_store_... is called. */
extern struct ram_store ram_store;

/* Every write to that memory: memcpy(), unless the port has its own function of this name, because a write may fail. 0
 * or PORT_ERR_STORE. */
int ram_store_put(uint8_t *at, const uint8_t *data, uint32_t size);

#endif
