/* SPDX-License-Identifier: MIT */
/*
 * systick: SysTick as timer of the tick and as clock, for ports of a Cortex-M without a better timer. The time is 0
 * before systick_begin(). Used by port/mps2. Main loop and interrupts, as each function states. Writes the registers of
 * SysTick and its priority.
 *
 * SysTick counts down to 0, where its interrupt (startup_systick) becomes pending and the next period begins; so ticks
 * never drift, and none is closer to the next than a period less its own lateness. The core's clock must be a whole
 * number of MHz, and a period at most 2^24 of its counts (98 ms at 170 MHz).
 */
#ifndef PORT_CORTEX_M_SYSTICK_H
#define PORT_CORTEX_M_SYSTICK_H

#include <stdint.h>

/* The first interrupt comes one period later. priority: 0 the highest, in the upper bits (core_enable). Main loop,
 * interrupts masked. */
void systick_begin(uint32_t period_us, uint32_t core_mhz, uint8_t priority);
/* Stops SysTick; the interrupt does not come any more. Main loop. */
void systick_end(void);

/* Sets the period that follows the next tick. Any context. */
void systick_period(uint32_t period_us);

/* The period that is under way. Any context. */
uint32_t systick_period_us(void);

/* The interrupt calls it first: a period is over. */
void systick_tick(void);

/* Time since the interrupt became due, by the core's clock. In that interrupt. */
uint32_t systick_late_ns(void);

/* Any context, interrupts masked or not (for less than a period). Both wrap. */
uint32_t systick_ns(void);
uint32_t systick_us(void);

#endif
