/* SPDX-License-Identifier: MIT */
/*
 * clock: 170 MHz from the board's 24 MHz crystal.
 *
 *     HSE 24 MHz --+-- / 6 * 85 / 2 (VCO 340 MHz) --> SYSCLK = HCLK = PCLK1 = PCLK2 = timers, 170 MHz
 *                  '-- FDCAN1 (fdcan.h)
 *     HSI 16 MHz ----> LPUART1, so that the console works without the crystal
 *
 * The crystal rather than the internal oscillator: CAN needs it, and the ticks are as exact as the bus. 170 MHz is the
 * chip's maximum. Above 150 MHz the core's regulator has to be in range 1 boost mode, where the flash needs 4 wait
 * states (34 MHz each). Instruction cache, data cache and prefetch hide them most of the time.
 *
 * Used by port_stm32g4.c. Main loop, once; changes registers of RCC, PWR and FLASH only.
 */
#ifndef PORT_STM32G4_CLOCK_H
#define PORT_STM32G4_CLOCK_H

#include <stdbool.h>

#define CLOCK_MHZ 170u

/* Main loop, after reset, once. False: crystal or PLL does not start; the core then stays at 16 MHz. */
bool clock_begin(void);

#endif
