/* SPDX-License-Identifier: MIT */
/*
 * ram_store: the store of port.h in memory, lost with the power. For emulated boards, and the first day of a new
 * port; what a board keeps is in flash (port/stm32g4/flash_store.h).
 *
 * The parameter banks (4 KB in section .store) are here; those for programs belong to the port, which defines `ram_store`:
 *
 *     static uint8_t banks[PORT_STORE_BANKS][BANK_BYTES] __attribute__((section(".store"), aligned(8)));
 *     const struct ram_store ram_store = {banks[0], sizeof banks[0]};
 *
 * Section .store is the memory STORE of the linker scripts in firmware/targets.
 */
#ifndef PORT_COMMON_RAM_STORE_H
#define PORT_COMMON_RAM_STORE_H

#include <stdint.h>

struct ram_store {
    uint8_t *memory; /* PORT_STORE_BANKS banks, one behind the other, aligned to 8 */
    uint32_t bank_bytes;
};

extern const struct ram_store ram_store;

#endif
