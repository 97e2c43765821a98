/* SPDX-License-Identifier: MIT */
/*
 * uart: UART 0 of the board (Arm's CMSDK UART), both ways by interrupt.
 *
 * Its transmitter's interrupt takes characters from a ring, so that whoever sends does not wait. Flow is controlled by
 * the other end: the emulator gives a character when the last one has been read.
 */
#ifndef PORT_MPS2_UART_H
#define PORT_MPS2_UART_H

#include <stdbool.h>
#include <stdint.h>

/* `receive` is called in the UART's interrupt. */
void uart_begin(void (*receive)(char character));

/* All of it or nothing: false when the ring has no room. Any context. */
bool uart_send(const char *text, uint32_t length);

/* A mark after what has been sent so far, and whether all before it has left. Any context. */
uint32_t uart_mark(void);
bool uart_passed(uint32_t mark);

/* True when everything has left. */
bool uart_idle(void);

#endif
