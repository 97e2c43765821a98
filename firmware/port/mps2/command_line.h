/* SPDX-License-Identifier: MIT */
/*
 * command_line: reads the words that the emulator passes on, in place of a board's straps and switches. Used by link
 * and by port_mps2.c at the start. Pure.
 *
 *   node=N            node number of the controller, 1 to 127; default 1
 *   link=fifo|slcan   how CAN frames are exchanged; default slcan
 *   out=PATH in=PATH  the two FIFOs of link=fifo, on the host; default "out" and "in"
 *   pace=real-time|fast   fast: a tick that was requested at once does not wait for the clock; link=fifo only
 *   verbose           notes as well
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

/* Cuts `text` into words. False if one of them is not in the list above: *wrong is this word. */
bool command_line_parse(struct command_line *line, char *text, const char **wrong);

#endif
