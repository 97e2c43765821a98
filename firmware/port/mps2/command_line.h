/* SPDX-License-Identifier: MIT */
/*
 * command_line: the words that the emulator hands on, in place of a board's straps and switches.
 *
 *   node=N            node number of the controller, 1 to 127; default 1
 *   link=fifo|slcan   how CAN frames come and go; default slcan
 *   out=PATH in=PATH  the two FIFOs of link=fifo, on the host; default "out" and "in"
 *   pace=real-time|fast   fast: a hurried tick does not wait for the clock; link=fifo only
 *   verbose           notes, too
 */
#ifndef PORT_MPS2_COMMAND_LINE_H
#define PORT_MPS2_COMMAND_LINE_H

#include <stdbool.h>
#include <stdint.h>

struct command_line {
    const char *out; /* into the text */
    const char *in;
    uint8_t node;
    bool fifo;
    bool fast;
    bool verbose;
};

/* Cuts `text` into words. False when one of them is none of the above: it is *wrong then. */
bool command_line_parse(struct command_line *line, char *text, const char **wrong);

#endif
