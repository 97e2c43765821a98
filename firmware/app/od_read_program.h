/* SPDX-License-Identifier: MIT */
/* od_read_program: object 0x2000 beside its image: state of the upload, what the program in the slot says of itself.
 * Mainline. */
#ifndef APP_OD_READ_PROGRAM_H
#define APP_OD_READ_PROGRAM_H

#include "app/controller.h"

/* Value of a sub-index from 2 on, two's complement in 64 bits; 0 where it needs a program and there is none. Checks the
 * program anew when the configuration has changed since (program_slot_refresh). */
uint64_t od_read_program(struct controller *controller, uint8_t sub);

#endif
