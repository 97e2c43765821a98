/* SPDX-License-Identifier: MIT */
/*
 * flash_store: the banks of port.h's store in the chip's second flash bank: 126 KiB each for two programs, then a page
 * (2 KiB) each for two sets of parameters.
 *
 * The first bank holds the firmware. Erasing a page of it would stop the core for 22 ms, which is 22 ticks.
 *
 * Erasing a bank erases its last page only, which has the commit record (app/bank_record.h); every other page is erased
 * when the first write reaches it. So no call takes longer than the erase of one page and the writing itself. A bank
 * whose erasing or writing was interrupted needs no repair: the next erase begins again.
 *
 * Writes collect eight bytes, the unit that the flash programs and protects by its error correction. Each double word
 * is programmed once. Used by port_store.c. Main loop. Erases and writes the second flash bank by flash.c.
 */
#ifndef PORT_STM32G4_FLASH_STORE_H
#define PORT_STM32G4_FLASH_STORE_H

#include <stdbool.h>
#include <stdint.h>

#define FLASH_STORE_BANKS           4u       /* 0 and 1: programs, 2 and 3: parameters */
#define FLASH_STORE_BYTES           0x1F800u /* a bank for a program */
#define FLASH_STORE_PARAMETER_BYTES 0x800u   /* a bank for parameters */

/* Like the functions of port.h; false: outside the bank, out of order, or the memory did not take it. The one bank that
 * was erased last can be written. */
uint32_t flash_store_size(unsigned bank); /* 0: there is no such bank */
bool flash_store_erase(unsigned bank);
bool flash_store_write(unsigned bank, uint32_t offset, const uint8_t *data, uint32_t size);
const uint8_t *flash_store_data(unsigned bank);

#endif
