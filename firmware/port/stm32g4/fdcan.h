/* SPDX-License-Identifier: MIT */
/*
 * fdcan: FDCAN1 for classic frames with 11-bit identifiers. Used by port_stm32g4.c and irq. Main loop and interrupts,
 * as each function states. Reads and writes the registers and the message RAM of FDCAN1.
 *
 * Sending. Two queues, one for the interrupts (SYNC, setpoints) and one for the main loop (SDO, heartbeats), each in
 * order. The chip's own FIFO of three takes all frames of the interrupts. It takes one frame of the main loop at a
 * time, when it is empty and the time to the next tick is longer than the longest frame. So SYNC does not wait for
 * queued frames of the main loop. It waits, as on any bus, for the one frame that is on the wire.
 *
 * Receiving. The chip's FIFO of three, 141 us of the shortest frames at 1 Mbit/s: the receive interrupt must not be
 * held off longer. What matches no filter is rejected by the chip, as are remote and extended frames.
 *
 * Bus-off. The chip leaves the bus by itself. All waiting frames are dropped, because they would be old when the bus is
 * back, and sending is refused. The chip gets the command to return, which it does after 129 times 11 recessive bits
 * (1.4 ms at 1 Mbit/s). This repeats without limit; CiA 301 leaves it to the node. The application gets PORT_ERR_FULL
 * for its frames.
 *
 * Bit rates. FDCAN1 is clocked by the board's 24 MHz crystal (HSE) itself, not by the PLL. A sample point at 87.5 % =
 * 7/8 is exact where the time quanta of a bit are a multiple of 8:
 *
 *     crystal   24 MHz / 1 Mbit/s = 24 quanta: 1 + 20 before the sample, 3 after it; 21/24 = 87.5 %
 *     PLL       its 340 MHz give 170, 85, 56.7 or 42.5 MHz here: 170 or 85 quanta, no multiple of 8
 *     PCLK1     170 MHz, the same
 *
 * The crystal serves 500, 250 and 125 kbit/s with the same 24 quanta and prescalers 2, 4, 8, and has no jitter of a
 * PLL. At 1 Mbit/s the bits of two nodes may differ by 0.48 % (3 quanta after the sample, jump width 3); a crystal is
 * good for 0.01 %, the chip's own RC oscillator (1 %) is not good enough.
 *
 * The caller (port_stm32g4.c, irq) sets up pins, clock and interrupt lines. "Any context": interrupts of priority
 * CPU_PRIORITY_TICK and lower, and the main loop; the functions hold these off where necessary.
 */
#ifndef PORT_STM32G4_FDCAN_H
#define PORT_STM32G4_FDCAN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "can/can_frame.h"
#include "can/can_match.h"

/* A tick has at most 13 frames (SYNC, position and velocity of six axes). Not many more, so that few old setpoints are
 * sent after an interruption of the bus. */
#define FDCAN_QUEUE_SIZE 16u

/* Frames of one context that wait for the transmitter, in order. */
struct fdcan_queue {
    uint32_t head; /* frames ever put in; wraps */
    uint32_t tail; /* frames ever taken out */
    struct can_msg frames[FDCAN_QUEUE_SIZE];
};

/* Counts since the last fdcan_take_events. */
struct fdcan_events {
    uint32_t bus_offs;
    uint32_t error_passives; /* entered or left */
    uint32_t lost;           /* received frames lost because the FIFO was full, at least */
};

struct fdcan {
    struct fdcan_queue urgent;   /* of the interrupts */
    struct fdcan_queue ordinary; /* of the main loop */
    struct fdcan_events events;
    bool main_loop_last; /* the newest frame in the chip is the main loop's */
    uint32_t
        guard_100ns; /* before a tick, in which no frame of the main loop is given to the chip */
    bool off;        /* not on the bus: not started, or bus-off */
};

/* Whose frame it is, so which queue it goes to. */
enum fdcan_sender {
    FDCAN_URGENT,  /* of an interrupt: `urgent` */
    FDCAN_ORDINARY /* of the main loop: `ordinary` */
};

/* Configures the chip and stays off the bus. False: not one of 1000000, 500000, 250000 and 125000 bit/s, or the chip
 * does not answer (no clock). Main loop. */
bool fdcan_begin(struct fdcan *can, uint32_t bits_s);

/* Between begin and start, main loop. False: more filters than the chip has (28). No filter: nothing passes. */
bool fdcan_accept(const struct can_match *filters, size_t count);

/* Enters the bus (after 11 recessive bits), leaves it. Main loop. */
void fdcan_start(struct fdcan *can);
void fdcan_stop(struct fdcan *can);

/* False: off the bus, or no room; the frame is not queued. Any context. */
bool fdcan_send(struct fdcan *can, const struct can_msg *message, enum fdcan_sender sender);

/* Whether no frame of the interrupts waits for the bus: each has been sent, or was dropped in bus-off. Any context. */
bool fdcan_delivered(const struct fdcan *can);

/* Receive interrupt, in this order: acknowledges the flags, fetches frames until there is none, handles the
 * acknowledged flags. */
uint32_t fdcan_acknowledge(void);
bool fdcan_fetch(struct can_msg *message);
void fdcan_attend(struct fdcan *can, uint32_t acknowledged);

/* The counts, which then begin at 0 again. Main loop. */
struct fdcan_events fdcan_take_events(struct fdcan *can);

/* Error counters of the chip: transmit, receive (0 to 255, 0 to 127). Any context. */
void fdcan_errors(uint8_t *transmit, uint8_t *receive);

#endif
