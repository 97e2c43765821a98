/* SPDX-License-Identifier: MIT */
/*
 * faults: what the chip calls when nothing else helps: a word of the flash that cannot be corrected (NMI), a hard
 * fault. One line on the console, and the chip restarts: SYNC stops, so the drives stop by themselves.
 */
#ifndef PORT_STM32G4_FAULTS_H
#define PORT_STM32G4_FAULTS_H

#include <stdint.h>

/* First of all. Main loop, once. */
void faults_begin(void);

/* Until this call a spoiled word of the flash is only counted: the store is looked through for a whole program, and one
 * of which the power failed in the middle of a write is no failure. From now on it is a fault. Returns how many there
 * were. Main loop, once. */
uint32_t faults_from_now_on(void);

#endif
