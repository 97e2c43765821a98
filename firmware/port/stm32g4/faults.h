/* SPDX-License-Identifier: MIT */
/*
 * faults: reactions to faults of the chip itself: a word of the flash that cannot be corrected (NMI), a hard fault. One
 * line on the console, and the chip restarts. SYNC stops, so the drives stop by themselves. Used by port_stm32g4.c.
 * Main loop; the reactions run in the interrupt handlers of the faults. Writes a line to the console, and restarts the
 * chip.
 */
#ifndef PORT_STM32G4_FAULTS_H
#define PORT_STM32G4_FAULTS_H

#include <stdint.h>

/* Before all other modules. Main loop, once. */
void faults_begin(void);

/* Until this call a damaged word of the flash is only counted: the store is searched for a complete program, and a
 * write that a loss of power has interrupted is no failure of the flash. From this call on it is a fault. Returns the
 * count. Main loop, once. */
uint32_t faults_from_now_on(void);

#endif
