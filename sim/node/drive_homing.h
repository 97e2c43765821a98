/* SPDX-License-Identifier: MIT */
/* drive_homing: the homing mode of a simulated drive (CiA 402-2): methods, search for the switch, change of
 * coordinates. Called by node/servo and node/drive_od. Changes its struct and the axis that it is given; no I/O.
 *
 *     17, 18   to the negative, positive limit switch, home where it goes off again
 *     19, 20   home switch on in the positive direction: home where it goes off going negative, on
 *              going positive
 *     21, 22   the mirror of 19, 20
 *     35, 37   home is here
 *
 * Switches are read once in each period, so the error of home is the distance of a period at the slow speed. In each
 * period the servo calls drive_homing_move, reads the switches, then calls drive_homing_evaluate. The one thread of
 * hodograph-drive.
 */
#ifndef NODE_DRIVE_HOMING_H
#define NODE_DRIVE_HOMING_H

#include <stdbool.h>
#include <stdint.h>

#include "node/axis_motion.h"
#include "od_drive.h"

enum drive_homing_phase {
    DRIVE_HOMING_IDLE,     /* not begun, or interrupted */
    DRIVE_HOMING_SEARCH,   /* fast, until the switch comes on */
    DRIVE_HOMING_BACK,     /* slowly, until it goes off */
    DRIVE_HOMING_APPROACH, /* slowly, until it comes on again */
    DRIVE_HOMING_STOP,     /* home was passed: stopping */
    DRIVE_HOMING_DONE,     /* the axis has its zero, at standstill */
    DRIVE_HOMING_FAILED    /* stopping, or at standstill */
};

/* All zero is the beginning. */
struct drive_homing {
    enum drive_homing_phase phase;
    uint32_t inputs_switch; /* the method's switch, bits of 0x60FD */
    int32_t edge_counts;    /* where home was passed */
    int8_t direction;       /* of the search: -1, 1; 0: none */
    bool entering;          /* home is where the switch comes on */
    bool start_bit;         /* bit 4 of the last controlword */
    bool homed;             /* the last homing has ended at home */
};

/* Whether there is such a method (0x6098). Pure. */
bool drive_homing_supports(int8_t method);

/* Whether a homing has begun and not ended. Pure. */
bool drive_homing_busy(const struct drive_homing *homing);

/* Ends a homing unfinished, as if it had not begun. */
void drive_homing_leave(struct drive_homing *homing);

/* A controlword with or without bit 4: its rising edge begins `method` at the axis' position, bit 4 at 0 interrupts.
 * `permitted`: the mode is homing and the drive is in Operation enabled; otherwise a homing is interrupted. A method
 * that does not exist fails at once. */
void drive_homing_control(struct drive_homing *homing, bool start_bit, bool permitted,
                          int8_t method, const struct axis_motion *axis);

/* One period of the axis at the speed that the phase needs: 0x6099, 0x609A, halt in the controlword. Returns whether
 * the axis' setpoint has that speed. */
bool drive_homing_move(const struct drive_homing *homing, struct axis_motion *axis,
                       const struct od_drive *values);

/* After drive_homing_move, which returned `steady`, with the present switches in 0x60FD. At standstill after home was
 * passed it gives the axis the coordinates of 0x607C and returns true: the axis is homed and its target has changed. */
bool drive_homing_evaluate(struct drive_homing *homing, struct axis_motion *axis,
                           const struct od_drive *values, bool steady);

#endif
