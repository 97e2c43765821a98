/* SPDX-License-Identifier: MIT */
/*
 * console: sends the lines of port_log and of faults by LPUART1 on PA2, which the board's ST-LINK shows as a serial
 * port: 115200 bit/s, 8 data bits, no parity. Receives nothing. Used by port_stm32g4.c and faults. Main loop, and
 * handlers that do not return: a character takes 87 us, and the functions wait for it. Writes registers of LPUART1 and
 * RCC.
 */
#ifndef PORT_STM32G4_CONSOLE_H
#define PORT_STM32G4_CONSOLE_H

#include <stdint.h>

/* Turns the UART on, once. Needs HSI and the pins' port clock (pins_begin). */
void console_begin(void);

/* "hodograph: TEXT VALUE", a line. */
void console_number(const char *text, int32_t value);
void console_hex(const char *text, uint32_t value);

#endif
