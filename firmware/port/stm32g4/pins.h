/* SPDX-License-Identifier: MIT */
/*
 * pins: what the port uses of port A.
 *
 *     PA2         console, to the ST-LINK on the board
 *     PA11, PA12  CAN receive and transmit (connector CN10, pins 14 and 12), to a 3.3 V transceiver
 *
 * FDCAN1 is also available on PB8 and PB9, but PB8 is BOOT0. With option bit nSWBOOT0 as delivered, the chip would
 * start its boot loader if the bus is recessive (high) at reset, which is the usual state. PA11 and PA12 are the chip's
 * USB pins, which this board does not use. Used by port_stm32g4.c and console. Main loop, at the start. Writes
 * registers of GPIOA and RCC.
 */
#ifndef PORT_STM32G4_PINS_H
#define PORT_STM32G4_PINS_H

#include <stdint.h>

/* Turns the clock of port A on; before pins_alternate. */
void pins_begin(void);

/* Gives pin 0 ... 15 of port A to a peripheral, with a pull-up. */
void pins_alternate(uint32_t pin, uint32_t function);

#endif
