/* SPDX-License-Identifier: MIT */
/*
 * link: how CAN frames leave and reach the emulated board. Used by port/mps2 only. Main loop and interrupts, as struct
 * link states. Declarations only; a link sends and receives frames. The command line selects one of two links
 * (docs/guides/target.md):
 *
 *   link_fifo   records on two FIFOs, exchanged in the tick's interrupt while the clock of the guest stands still
 *   link_slcan  text on a UART, received by interrupt in real time
 */
#ifndef PORT_MPS2_LINK_H
#define PORT_MPS2_LINK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "port/mps2/command_line.h"
#include "port/port.h"

/* What a tick requests for the next one: port_tick_await(). */
struct link_request {
    uint32_t guard_us;
    bool awaiting; /* until port_tick_ready() */
    bool hurry;
};

struct link {
    /* Whether the main loop sleeps (WFI) while it has nothing to do. If the guest's clock counts instructions, sleeping
     * only makes the emulator change its threads; then the main loop spins. */
    bool sleeps;

    /* Main loop, in this order. 0 or PORT_ERR_SYSTEM. */
    int (*begin)(const struct command_line *line);
    int (*accept)(const struct can_match *filters, size_t count);

    /* Any context. 0 or PORT_ERR_FULL. */
    int (*send)(const struct can_msg *message);

    /* port_can_delivered(): in a tick. */
    bool (*delivered)(void);

    /* In the tick's interrupt, after the tick. `request` changes if a received frame ends the waiting. Returns the
     * lateness of the next tick, in ns. */
    uint32_t (*after_tick)(const struct link_request *request);

    /* Sends what still waits. Main loop, with the tick ended. */
    void (*end)(void);

    /* Main loop. */
    bool (*stop_requested)(void); /* when it becomes true the link wakes the main loop */
    bool (*failed)(void);         /* the other end has ended */
};

extern const struct link link_fifo;
extern const struct link link_slcan;

#endif
