/* SPDX-License-Identifier: MIT */
/* The program store is the board's PSRAM. */
#include "port/common/ram_store.h"
#include "port/port.h"

#define BANK_BYTES (8u * 1024u * 1024u)

static uint8_t banks[PORT_STORE_BANKS][BANK_BYTES] __attribute__((section(".store"), aligned(8)));
const struct ram_store ram_store = {.memory = banks[0], .bank_bytes = sizeof banks[0]};
