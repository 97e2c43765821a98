/* SPDX-License-Identifier: MIT */
/*
 * cpu: interrupts, sleep and reset of the core (ARMv7-M Architecture Reference Manual B1, B3). Used by port/stm32g4
 * only. Any context, but cpu_sleep: main loop. On any other machine the tests define these functions. Writes registers
 * of the core only (BASEPRI, NVIC, AIRCR).
 *
 * Priorities: 0 is the highest of 16. NMI and hard fault are above all of them.
 */
#ifndef PORT_STM32G4_CPU_H
#define PORT_STM32G4_CPU_H

#include <stdbool.h>
#include <stdint.h>

#define CPU_PRIORITY_TICK    1u /* TIM2 */
#define CPU_PRIORITY_RECEIVE 2u /* FDCAN1 */

/* Holds off interrupts of this priority and lower ones; 0: none. Returns the previous value, for cpu_hold afterwards.
 * */
uint8_t cpu_hold(uint8_t priority);

/* True in an interrupt handler. */
bool cpu_in_handler(void);

/* Turns a board's interrupt on, and off. */
void cpu_interrupt_on(uint32_t number, uint8_t priority);
void cpu_interrupt_off(uint32_t number);

/* Sleeps until an interrupt has been served since the last call. */
void cpu_sleep(void);

/* Restarts the chip, as after power-on. Does not return. */
void cpu_reset(void);

#endif
