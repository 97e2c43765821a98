/* SPDX-License-Identifier: MIT */
/* homing: the homing mode of a simulated drive (CiA 402-2): methods, search for the switch, change of coordinates.
 *
 *     17, 18   to the negative, positive limit switch, home where it goes off again
 *     19, 20   home switch on in the positive direction: home where it goes off going negative, on
 *              going positive
 *     21, 22   the mirror of 19, 20
 *     35, 37   home is here
 *
 * Edges are seen once a period: the slow speed decides how exact home is. One period is homing_move, then the caller
 * reads the switches, then homing_evaluate. All in one context.
 */
#ifndef NODE_HOMING_H
#define NODE_HOMING_H

#include <stdbool.h>
#include <stdint.h>

#include "node/axis_motion.h"
#include "od_drive.h"

enum homing_phase {
    HOMING_IDLE,     /* not begun, or interrupted */
    HOMING_SEARCH,   /* fast, until the switch comes on */
    HOMING_BACK,     /* slowly, until it goes off */
    HOMING_APPROACH, /* slowly, until it comes on again */
    HOMING_STOP,     /* home was passed: coming to rest */
    HOMING_DONE,
    HOMING_FAILED /* coming to rest, or at rest */
};

/* All zero is the beginning. */
struct homing {
    enum homing_phase phase;
    uint32_t inputs_switch; /* the method's switch, bits of 0x60FD */
    int32_t edge_counts;    /* where home was passed */
    int8_t direction;       /* of the search: -1, 1; 0: none */
    bool entering;          /* home is where the switch comes on */
    bool start_bit;         /* bit 4 of the last controlword */
    bool homed;             /* a homing has ended at home, and none has begun since */
};

/* Whether there is such a method (0x6098). Pure. */
bool homing_supports(int8_t method);

/* Whether a homing has begun and not ended. Pure. */
bool homing_busy(const struct homing *homing);

/* Ends a homing unfinished, as if it had not begun. */
void homing_leave(struct homing *homing);

/* A controlword with or without bit 4: its rising edge begins `method` at the axis' position, bit 4 at 0 interrupts.
 * `permitted`: the mode is homing and the drive is in Operation enabled; otherwise a homing is interrupted. A method that
 * does not exist fails at once. */
void homing_control(struct homing *homing, bool start_bit, bool permitted, int8_t method,
                    const struct axis_motion *axis);

/* One period of the axis at the speed that the phase needs: 0x6099, 0x609A, halt in the controlword. Returns whether the
 * axis' setpoint has that speed. */
bool homing_move(const struct homing *homing, struct axis_motion *axis,
                 const struct od_drive *values);

/* After homing_move, which returned `steady`, with the switches of now in 0x60FD. At rest after home was passed it gives
 * the axis the coordinates of 0x607C and returns true: the axis is homed and its target has changed. */
bool homing_evaluate(struct homing *homing, struct axis_motion *axis, const struct od_drive *values,
                     bool steady);

#endif
