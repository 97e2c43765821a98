/* SPDX-License-Identifier: MIT */
/*
 * fdcan_model: FDCAN1 of an STM32G4 as its reference manual describes it (RM0440 chapter 44), for one node on a bus
 * that the test plays: configuration protocol, message RAM, filters, FIFOs, flags, bus-off. A part of stm32g4_chip.
 * Used by the tests of firmware/port/stm32g4. One thread; no I/O.
 */
#ifndef TESTS_UNIT_FDCAN_MODEL_H
#define TESTS_UNIT_FDCAN_MODEL_H

#include <stdbool.h>
#include <stdint.h>

struct fdcan_model_frame {
    uint32_t id;
    bool extended;
    bool remote;
    uint8_t dlc;
    uint8_t data[8];
};

void fdcan_model_reset(void);
bool fdcan_model_covers(uint32_t address);
uint32_t fdcan_model_read(uint32_t address);
void fdcan_model_write(uint32_t address, uint32_t value);

/* The kernel clock does not run: INIT never answers. */
void fdcan_model_stop_clock(void);

/* Bit timing, from the registers and the kernel clock. */
uint32_t fdcan_model_bits_s(uint32_t clock_hz);
double fdcan_model_sample_point(void);
uint32_t fdcan_model_jump_quanta(void);

/* On the bus: neither in initialisation nor bus-off. */
bool fdcan_model_active(void);

/* The next frame of the transmit FIFO goes out; false: there is none, or the node is not on the bus. */
bool fdcan_model_transmit(struct fdcan_model_frame *frame);

/* How many wait in the chip. */
unsigned fdcan_model_waiting(void);

/* A frame comes from the bus. True: it was stored. */
bool fdcan_model_receive(const struct fdcan_model_frame *frame);

/* Sending fails so many times, each costing 8 of the transmit error counter. */
void fdcan_model_fail(unsigned times);

/* Recessive bits on the bus. */
void fdcan_model_recessive(unsigned bits);

/* Interrupt line 0. */
bool fdcan_model_interrupt(void);

#endif
