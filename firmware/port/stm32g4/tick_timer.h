/* SPDX-License-Identifier: MIT */
/*
 * tick_timer: the clocks of the port, and when the next tick is due.
 *
 * TIM2 counts 100 ns with 32 bits; its compare interrupt is the tick. TIM5 counts microseconds with 32 bits. Both run
 * on for ever, so 100 times TIM2 wraps where nanoseconds in 32 bits do: no interrupt is needed to extend them.
 *
 * Ticks are due a period apart. After a late tick the next one comes at its own due time, but at least three quarters
 * of a period after the late one. After a tick that was late by a whole period the clock of the ticks is set anew. Used
 * by irq.c, fdcan.c and port_stm32g4.c. Main loop and tick; the times in any context. Writes the registers of TIM2 and
 * TIM5.
 */
#ifndef PORT_STM32G4_TICK_TIMER_H
#define PORT_STM32G4_TICK_TIMER_H

#include <stdint.h>

#define TICK_TIMER_PER_US 10u /* counts of TIM2 */

struct tick_timer {
    uint32_t due;     /* of the next tick, in counts of TIM2 */
    uint32_t started; /* the present one */
    uint32_t period;
};

/* Starts both counters, no ticks; input_mhz: the clock of the timers. Before any other function. */
void tick_timer_begin(uint32_t input_mhz);

/* Time since tick_timer_begin. Any context. Both wrap. */
uint32_t tick_timer_ns(void);
uint32_t tick_timer_us(void);

/* Time until the next tick is due, in counts of TIM2; UINT32_MAX: there are no ticks. 0: it is due. Any context. */
uint32_t tick_timer_left(void);

/* Starts the ticks; the first one comes one period later. Main loop. */
void tick_timer_start(struct tick_timer *timer, uint32_t period_us);

/* No more ticks; the counters go on. Main loop. */
void tick_timer_stop(void);

/* Sets the period from the next tick on. Main loop with the tick held off, or the tick. */
void tick_timer_period(struct tick_timer *timer, uint32_t period_us);

/* First call in the interrupt: acknowledges it. Returns how late the tick is, in ns (UINT32_MAX at most). */
uint32_t tick_timer_enter(struct tick_timer *timer);

/* Last call in the interrupt: sets the next due time. */
void tick_timer_leave(struct tick_timer *timer);

#endif
