/* SPDX-License-Identifier: MIT */
/*
 * fdcan_timing: bit rates that this board can keep exactly. Pure.
 *
 * FDCAN1 is clocked by the board's 24 MHz crystal (HSE) itself, not by the PLL. A sample point at 87.5 % = 7/8 is exact
 * where the time quanta of a bit are a multiple of 8:
 *
 *     crystal   24 MHz / 1 Mbit/s = 24 quanta: 1 + 20 before the sample, 3 after it; 21/24 = 87.5 %
 *     PLL       its 340 MHz give 170, 85, 56.7 or 42.5 MHz here: 170 or 85 quanta, no multiple of 8
 *     PCLK1     170 MHz, the same
 *
 * The crystal serves 500, 250 and 125 kbit/s with the same 24 quanta and prescalers 2, 4, 8, and has no jitter of a PLL. At 1 Mbit/s
 * the bits of two nodes may differ by 0.48 % (3 quanta after the sample, jump width 3); a crystal is good for 0.01 %,
 * the chip's own RC oscillator (1 %) is not good enough.
 */
#ifndef PORT_STM32G4_FDCAN_TIMING_H
#define PORT_STM32G4_FDCAN_TIMING_H

#include <stdint.h>

#define FDCAN_TIMING_CLOCK_HZ 24000000u

/* Value of register NBTP for 1000000, 500000, 250000 or 125000 bit/s; 0: no such rate. */
uint32_t fdcan_timing(uint32_t bits_s);

#endif
