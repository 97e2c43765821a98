/* SPDX-License-Identifier: MIT */
/* objects_stream: handlers of object 0x2060, for the table and the hooks in objects.c: a chunk (sub 1, a DOMAIN), the
 * state of the job, its end. Called by objects.c only. They read and change controller->stream, and read the machine.
 * Main loop. */
#ifndef APP_OBJECTS_STREAM_H
#define APP_OBJECTS_STREAM_H

#include "app/controller_state.h"

#define OBJECT_STREAM 0x2060u

/* The reader of the sub-indices from 2 on: two's complement in 64 bits. Under the lock. */
uint64_t object_read_stream(struct controller *controller, const struct od_entry *entry);

/* Refused with SDO_ABORT_STATE while a program that is not a job is on the path, or the drives move by themselves;
 * SDO_ABORT_MEMORY when there is no room now. */
uint32_t object_chunk_begin(struct controller *controller, uint32_t size);
uint32_t object_chunk_write(struct controller *controller, uint32_t offset, const uint8_t *data,
                            uint32_t size);
/* Checks the chunk; SDO_ABORT_VALUE when it is refused (subs 5 and 6 have the reason). */
uint32_t object_chunk_end(struct controller *controller, uint32_t size);
void object_chunk_abort(struct controller *controller);

/* Sub 16: whether optional program stops take effect. */
uint32_t object_write_optional_stop(struct controller *controller, const struct od_entry *entry,
                                    uint64_t number);

/* Sub 15 closes the job; SDO_ABORT_STATE while it is on the path. */
uint32_t object_write_stream_close(struct controller *controller, const struct od_entry *entry,
                                   uint64_t number);

#endif
