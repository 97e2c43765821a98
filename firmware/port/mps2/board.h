/* SPDX-License-Identifier: MIT */
/* What differs between the MPS2 boards (clock, UART): constants, which each linker script of firmware/targets sets as
 * addresses of symbols. Used by port/mps2 only. Any context. */
#ifndef PORT_MPS2_BOARD_H
#define PORT_MPS2_BOARD_H

#include <stdint.h>

extern const uint8_t mps2_clock_mhz[]; /* of the core, which drives SysTick */
extern const uint8_t mps2_uart[];      /* registers of UART 0 */
extern const uint8_t
    mps2_uart_number[]; /* its receive interrupt; that of its transmitter is the next */

#define BOARD_CLOCK_MHZ   ((uint32_t)(uintptr_t)mps2_clock_mhz)
#define BOARD_UART        ((uint32_t)(uintptr_t)mps2_uart)
#define BOARD_UART_NUMBER ((uint32_t)(uintptr_t)mps2_uart_number)

#endif
