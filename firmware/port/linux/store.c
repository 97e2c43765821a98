/* SPDX-License-Identifier: MIT */
/* The program store is memory of the process. */
#include "port/common/ram_store.h"
#include "port/port.h"

#define BANK_BYTES (64u * 1024u * 1024u)

static uint8_t banks[PORT_STORE_BANKS][BANK_BYTES] __attribute__((aligned(8)));
const struct ram_store ram_store = {.memory = banks[0], .bank_bytes = sizeof banks[0]};
