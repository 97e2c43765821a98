/* SPDX-License-Identifier: MIT */
/*
 * flash_store: the two banks of port.h's program store, each one half (128 KB) of the chip's second flash bank.
 *
 * Both lie there because the firmware runs from the first: erasing a page of the bank one runs from stops
 * the core for 22 ms, which is 22 ticks.
 *
 * Erasing a bank erases its last page only, which holds what makes the rest count (app/program_record.h); every other page is
 * erased when the first write reaches it. So no call takes longer than a page and what is written takes. A bank that is
 * broken off anywhere needs no repair: the next erase begins anew.
 *
 * Writes collect eight bytes, which is what the flash programs and protects by its error correction at once; each double word is
 * programmed once. Mainline.
 */
#ifndef PORT_STM32G4_FLASH_STORE_H
#define PORT_STM32G4_FLASH_STORE_H

#include <stdbool.h>
#include <stdint.h>

#define FLASH_STORE_BANKS 2u
#define FLASH_STORE_BYTES 0x20000u /* a bank */

/* Like the functions of port.h; false: outside the bank, out of order, or the memory did not take it. The one bank that was
 * erased last can be written. */
bool flash_store_erase(unsigned bank);
bool flash_store_write(unsigned bank, uint32_t offset, const uint8_t *data, uint32_t size);
const uint8_t *flash_store_data(unsigned bank);

#endif
