/* SPDX-License-Identifier: MIT */
/* home_seek: the homing methods of CiA 402-2 that the simulated drive has: which way to go, and when it
 * is home.
 *
 *     17, 18   to the negative, positive limit switch, home where it goes off again
 *     19, 20   home switch on in the positive direction: home where it goes off going negative, on
 *              going positive
 *     21, 22   the mirror of 19, 20
 *     35, 37   home is here
 *
 * Edges are seen once a period: the slow speed decides how exact home is. A pure state machine: the
 * caller moves the axis and keeps the position of the edge. All in one context.
 */
#ifndef NODE_HOME_SEEK_H
#define NODE_HOME_SEEK_H

#include <stdbool.h>
#include <stdint.h>

enum home_seek_phase {
    HOME_SEEK_IDLE,     /* not begun, or interrupted */
    HOME_SEEK_SEARCH,   /* fast, until the switch comes on */
    HOME_SEEK_BACK,     /* slowly, until it goes off */
    HOME_SEEK_APPROACH, /* slowly, until it comes on again */
    HOME_SEEK_STOP,     /* home was passed: coming to rest */
    HOME_SEEK_DONE,
    HOME_SEEK_FAILED /* coming to rest, or at rest */
};

struct home_seek {
    enum home_seek_phase phase;
    int8_t method;
    uint32_t inputs_switch; /* the method's switch, bits of 0x60FD */
    int direction;          /* of the search: -1, 1 */
    bool entering;          /* home is where the switch comes on */
};

enum home_seek_event {
    HOME_SEEK_NOTHING,
    HOME_SEEK_EDGE /* home is where the axis is now */
};

bool home_seek_supports(int8_t method);

/* Begins; a method that does not exist fails at once. Methods 35 and 37 are at HOME_SEEK_STOP, home
 * being where the axis is. */
void home_seek_begin(struct home_seek *homing, int8_t method);

/* After each period: looks at the switches (bits of 0x60FD). */
enum home_seek_event home_seek_look(struct home_seek *homing, uint32_t inputs);

/* The speed wanted now: -2, 2 fast, -1, 1 slow, 0 rest. */
int home_seek_speed(const struct home_seek *homing);

#endif
