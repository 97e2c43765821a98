/* SPDX-License-Identifier: MIT */
/*
 * pins: what the port uses of port A.
 *
 *     PA2         console, to the ST-LINK on the board
 *     PA11, PA12  CAN receive and transmit (connector CN10, pins 14 and 12), to a 3.3 V transceiver
 *
 * FDCAN1 can be had on PB8 and PB9 too, but PB8 is BOOT0: as long as option bit nSWBOOT0 is as delivered, the chip
 * would start its boot loader whenever the bus is recessive (high) at reset, which it nearly always is. PA11 and PA12
 * are the chip's USB pins, which this board leaves free.
 */
#ifndef PORT_STM32G4_PINS_H
#define PORT_STM32G4_PINS_H

#include <stdint.h>

/* Clock of the port. */
void pins_begin(void);

/* Gives pin 0 ... 15 of port A to a peripheral, with a pull-up, for when nobody drives it. */
void pins_alternate(uint32_t pin, uint32_t function);

#endif
