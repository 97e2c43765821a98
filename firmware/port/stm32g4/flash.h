/* SPDX-License-Identifier: MIT */
/*
 * flash: erasing and programming pages of the second flash bank, while the program runs from the first.
 *
 * A page takes about 22 ms to erase, a double word 85 us to program; the functions wait. Other contexts continue: they
 * run from bank 1, which can be read at the same time. A read of bank 2 stalls the core until the operation has ended.
 * Used by flash_store.c, port_stm32g4.c and faults.c. Main loop, except flash_take_ecc_error (NMI). Writes the
 * registers of FLASH and the second bank.
 *
 * The data cache is off during an operation and empty afterwards. On other dual-bank chips of the family it may cache
 * wrong data if bank 2 is read during a write, and would keep old contents after an erase.
 */
#ifndef PORT_STM32G4_FLASH_H
#define PORT_STM32G4_FLASH_H

#include <stdbool.h>
#include <stdint.h>

#define FLASH_PAGES 128u /* of bank 2 */

/* False when the chip is not in dual-bank mode: then there is no second bank. */
bool flash_is_dual(void);

/* Erases page 0 ... 127 of bank 2. False: not done, or not proved by reading back. */
bool flash_erase_page(uint32_t page);

/* Programs one erased double word. `offset`: from the start of bank 2, a multiple of 8. False: as above. */
bool flash_program(uint32_t offset, const uint8_t data[8]);

/* For the NMI: true if the error correction of a word of bank 2 failed. Clears the flag. */
bool flash_take_ecc_error(void);

#endif
