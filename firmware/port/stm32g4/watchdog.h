/* SPDX-License-Identifier: MIT */
/*
 * watchdog: the independent watchdog, on its own oscillator: restarts the chip 4 s (3.8 to 4.3 s) after it was last
 * fed. It cannot be stopped. Used by port_stm32g4.c. Main loop; uses IWDG and the reset flags in RCC_CSR only.
 *
 * The main loop feeds it in each round and at each step of longer work (port_progress), but only if ticks have come
 * since the last time. So it restarts the chip if main loop or ticks stop. The drives detect missing SYNCs and
 * heartbeats much sooner; the watchdog is for the recovery of the controller.
 */
#ifndef PORT_STM32G4_WATCHDOG_H
#define PORT_STM32G4_WATCHDOG_H

#include <stdbool.h>
#include <stdint.h>

/* Main loop, once, when ticks are about to begin. The core may run at any clock. */
void watchdog_start(void);

/* Feeds the watchdog if `ticks`, how many there have been, has changed since the last call. Main loop. */
void watchdog_feed(uint32_t ticks);

/* Whether the watchdog has restarted the chip. Clears all reset flags: only the first call after a reset is right. Main
 * loop. */
bool watchdog_has_reset(void);

#endif
