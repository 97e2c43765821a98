/* SPDX-License-Identifier: MIT */
/*
 * irq: the two interrupts of the controller, and how they exclude each other. Used by port_stm32g4.c and vectors.c.
 * Main loop, except the handlers. Switches the interrupts on and off by cpu, tick_timer and fdcan, and calls the
 * handlers of the application.
 *
 *     TIM2        priority 1: the tick
 *     FDCAN1 IT0  priority 2: frames that came, the next ones to send, bus-off
 *
 * The tick may begin while frames are fetched, but not while the application handles one: `receive` is called with the
 * tick held off, for one frame at a time. The main loop's critical section holds off both. So the contexts are those of
 * port.h, and a tick waits for at most one call of `receive`, a few microseconds.
 */
#ifndef PORT_STM32G4_IRQ_H
#define PORT_STM32G4_IRQ_H

#include <stdint.h>

#include "port/port.h"
#include "port/stm32g4/fdcan.h"

/* Both on; the first tick comes one period later. Main loop. */
void irq_start(struct fdcan *can, const struct port_handlers *handlers, uint32_t period_us);

/* Both off. Main loop. */
void irq_stop(void);

/* From the next tick on. Main loop, in a critical section. */
void irq_period(uint32_t period_us);

/* Number of ticks since irq_start. Main loop. */
uint32_t irq_ticks(void);

/* The handlers themselves, for the vectors (vectors.c). Called by the hardware only. */
void irq_tick(void);
void irq_can(void);

#endif
