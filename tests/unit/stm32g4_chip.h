/* SPDX-License-Identifier: MIT */
/*
 * stm32g4_chip: an STM32G474 for tests of firmware/port/stm32g4: what its registers do, as reference manual RM0440
 * describes it. The models share no constant with the port. What the manual forbids ends the test. Used by the tests of
 * firmware/port/stm32g4. One thread; no I/O.
 *
 *     chip_power_on();                      registers as after power-on; the flash keeps what it holds
 *     ...
 *     fdcan_model_...   flash_model_...     what happens outside of the chip, and what tests read
 *
 * Registers of peripherals without a model are plain memory.
 */
#ifndef TESTS_UNIT_STM32G4_CHIP_H
#define TESTS_UNIT_STM32G4_CHIP_H

#include <stdbool.h>
#include <stdint.h>

void chip_power_on(void);

/* A register of a peripheral without a model, as it was last written. */
uint32_t chip_peek(uint32_t address);
void chip_poke(uint32_t address, uint32_t value);

/* Writes to an address since power-on. */
unsigned chip_writes(uint32_t address);

/* The text sent to the console (LPUART1) since the last call: the first kilobyte. */
const char *chip_said(void);

/* Ends the test: the access breaks a rule of the manual. */
void chip_forbids(const char *rule, uint32_t address);

/* The core: the priority whose interrupts are held off (0: none), and which handler runs (0: none). */
uint8_t chip_held(void);
void chip_in_handler(bool in_handler);
bool chip_interrupt_is_on(uint32_t number, uint8_t *priority);

/* Sets what happens while the core sleeps; the number of requested restarts. */
void chip_on_sleep(void (*hook)(void));
unsigned chip_resets(void);

/* The counters of TIM2 (100 ns) and TIM5 (1 us), once they run. True when the compare interrupt of TIM2 is pending. */
void chip_advance_100ns(uint32_t counts);
bool chip_tick_pending(void);

#endif
