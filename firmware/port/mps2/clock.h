/* SPDX-License-Identifier: MIT */
/*
 * clock: SysTick as the tick's timer and as the clock of the port. Stands still before clock_begin().
 *
 * SysTick counts down to 0, where its interrupt becomes pending and the next period begins.
 */
#ifndef PORT_MPS2_CLOCK_H
#define PORT_MPS2_CLOCK_H

#include <stdint.h>

/* The first interrupt comes one period later. period_us: up to 600 ms. */
void clock_begin(uint32_t period_us);
void clock_end(void);

/* The period that follows the next tick. */
void clock_period(uint32_t period_us);
uint32_t clock_period_us(void);

/* First of all in the interrupt: a period is over. */
void clock_tick(void);

/* Since then, as far as the core's clock tells. In that interrupt. */
uint32_t clock_late_ns(void);

/* Any context, interrupts masked or not (for less than a period). Both wrap. */
uint32_t clock_ns(void);
uint32_t clock_us(void);

#endif
