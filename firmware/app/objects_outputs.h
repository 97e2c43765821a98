/* SPDX-License-Identifier: MIT */
/*
 * objects_outputs: handlers of the objects of the outputs on the I/O module, for the table in objects.c.
 *
 *   0x180C, 0x1A0C      parameters of TPDO13, which is RPDO1 of the I/O module. Bit 31 of the COB-ID: there is no module
 *   0x2036              the outputs that TPDO13 sends
 *   0x2058 subs 1 to 5  the outputs at standstill, and all of them at once in sub 7
 *          sub 6        whether they keep their values at the end of a program
 *
 * Of 0x2036 and 0x2058, subs 1 and 2 are bytes of digital outputs, subs 3 to 5 analogue outputs.
 *
 * Readers return the value of the entry, two's complement in 64 bits, and change nothing. Writers change the outputs of
 * the machine at standstill, or its outputs_stay. Called by objects.c only. Main loop: readers under the lock, writers
 * take it.
 */
#ifndef APP_OBJECTS_OUTPUTS_H
#define APP_OBJECTS_OUTPUTS_H

#include <stdint.h>

#include "app/controller_state.h"

/* TPDO13 and the outputs in it (0x2036). */
uint64_t object_read_outputs_cob_id(struct controller *controller, const struct od_entry *entry);
uint64_t object_read_outputs_mapping(struct controller *controller, const struct od_entry *entry);
uint64_t object_read_outputs(struct controller *controller, const struct od_entry *entry);

/* 0x2058 subs 1 to 5 and 7. SDO_ABORT_STATE: the outputs may not be changed now. */
uint64_t object_read_rest_outputs(struct controller *controller, const struct od_entry *entry);
uint32_t object_write_rest_outputs(struct controller *controller, const struct od_entry *entry,
                                   uint64_t number);

/* 0x2058 sub 6 is in its field. While a program runs, the value is for this one and not for the next. */
void object_written_outputs_stay(struct controller *controller);

#endif
