/* SPDX-License-Identifier: MIT */
/*
 * watchdog: the independent one, on its own oscillator: restarts the chip 4 s (3.8 to 4.3 s) after it was fed last.
 * Cannot be stopped.
 *
 * It is fed from the main loop, in each round and at each step of longer work (port_progress), and only when ticks have
 * gone on since the last time: so it bites when either of them stands still. The drives detect missing frames of the
 * controller much sooner, by missing SYNCs and heartbeats; this is for the way back.
 */
#ifndef PORT_STM32G4_WATCHDOG_H
#define PORT_STM32G4_WATCHDOG_H

#include <stdbool.h>
#include <stdint.h>

/* Any clock. */
void watchdog_start(void);

/* Main loop; ticks: how many there have been. */
void watchdog_feed(uint32_t ticks);

/* Whether it was the watchdog that restarted the chip; forgets it. */
bool watchdog_has_reset(void);

#endif
