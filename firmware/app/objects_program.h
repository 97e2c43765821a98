/* SPDX-License-Identifier: MIT */
/* objects_program: handlers of object 0x2000, for the table and the hooks in objects.c: the image (sub 1, a DOMAIN),
 * state of the upload, data of the program in the slot. Called by objects.c only. They read and change
 * controller->slot, which writes the store; a new program closes controller->stream. `context` is the controller. Main
 * loop. */
#ifndef APP_OBJECTS_PROGRAM_H
#define APP_OBJECTS_PROGRAM_H

#include "app/controller_state.h"

/* The reader of the sub-indices from 2 on: two's complement in 64 bits; 0 if the value needs a program and there is
 * none. Checks the program anew if the configuration has changed (program_slot_refresh), but not while axes move: start
 * and end are then 0. Not under the lock. */
uint64_t object_read_program(struct controller *controller, const struct od_entry *entry);

/* Refused with SDO_ABORT_STATE while a program runs, SDO_ABORT_MEMORY when it cannot fit. */
uint32_t object_program_begin(void *context, const struct od_entry *entry, uint32_t size);
uint32_t object_program_write(void *context, const struct od_entry *entry, uint32_t offset,
                              const uint8_t *data, uint32_t size);
/* Checks the image; SDO_ABORT_VALUE when it is refused (0x2000 subs 3 and 4 have the reason). */
uint32_t object_program_end(void *context, const struct od_entry *entry, uint32_t size);
void object_program_abort(void *context, const struct od_entry *entry);

/* Upload of the active image to the host; SDO_ABORT_NO_DATA when there is none. */
uint32_t object_program_size(void *context, const struct od_entry *entry, uint32_t *size);
uint32_t object_program_read(void *context, const struct od_entry *entry, uint32_t offset,
                             uint8_t *data, uint32_t size);

#endif
