/* SPDX-License-Identifier: MIT */
/*
 * interrupts: the tick, and the receive handler that both links call. Used by port_mps2.c, uart.c, link_fifo.c and
 * link_slcan.c. Main loop and interrupts, as each function states. Writes the registers of SysTick, masks interrupts,
 * and calls the handlers of the application.
 *
 * Priorities: SysTick 0, the UART below it. So a tick interrupts the taking of characters, never the receive handler,
 * which runs with all interrupts masked. The FPU keeps its state lazily, as after reset: an interrupt reserves room on
 * the stack, and the registers are saved only when it computes with floats while the main loop was doing so.
 */
#ifndef PORT_MPS2_INTERRUPTS_H
#define PORT_MPS2_INTERRUPTS_H

#include <stdbool.h>
#include <stdint.h>

#include "port/mps2/link.h"
#include "port/port.h"

#define INTERRUPTS_UART_PRIORITY 0x80u /* for core_enable: below SysTick */

/* Sets the link; once, before the other functions. Main loop. */
void interrupts_begin(const struct link *link);

/* Stops the tick. Main loop. */
void interrupts_end(void);

/* Whether the caller is a tick. Any context. */
bool interrupts_in_tick(void);

/* A frame for the receive handler. Any interrupt; harmless before port_start(). */
void interrupts_receive(const struct can_msg *message);

#endif
