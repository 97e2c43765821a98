/* SPDX-License-Identifier: MIT */
/*
 * uart: UART 0 of the board (Arm's CMSDK UART), both directions by interrupt.
 *
 * The interrupt of the transmitter takes characters from a ring, so the sender does not wait. The other end controls
 * the flow: the emulator gives a character when the last one has been read. Used by link_slcan. Reads and writes the
 * registers of UART 0. Any context; uart_begin in the main loop. It calls `receive` in the receive interrupt.
 */
#ifndef PORT_MPS2_UART_H
#define PORT_MPS2_UART_H

#include <stdbool.h>
#include <stdint.h>

/* Main loop, once. `receive` is called in the UART's interrupt. */
void uart_begin(void (*receive)(char character));

/* Sends all of the text, or nothing: false if the ring has no room. Any context. */
bool uart_send(const char *text, uint32_t length);

/* uart_mark gives a mark after all that has been sent up to now; uart_passed: all before the mark has left. Any
 * context. */
uint32_t uart_mark(void);
bool uart_passed(uint32_t mark);

/* True when everything has left. Any context. */
bool uart_idle(void);

#endif
