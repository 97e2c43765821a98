/* SPDX-License-Identifier: MIT */
/* Implements app/objects_program.h (see there): handlers of object 0x2000, for the table and the hooks in objects.c.
 * Called by objects.c only. They read and change controller->slot, which writes the store; a new program closes
 * controller->stream. `context` is the controller. Main loop. */
#include "app/objects_program.h"

#include <string.h>

#include "canopen/sdo_abort.h"
#include "core/first_axis.h"
#include "port/port.h"

/* ---- Sub 1: the image ---- */

uint32_t object_program_begin(void *context, const struct od_entry *entry, uint32_t size)
{
    struct controller *controller = context;
    (void)entry;
    if (controller_moving(controller)) {
        controller->refusal = MACHINE_MOVING;
        return SDO_ABORT_STATE;
    }
    return program_slot_begin(&controller->slot, size) == 0 ? SDO_OK : SDO_ABORT_MEMORY;
}

uint32_t object_program_write(void *context, const struct od_entry *entry, uint32_t offset,
                              const uint8_t *data, uint32_t size)
{
    struct controller *controller = context;
    (void)entry;
    return program_slot_write(&controller->slot, offset, data, size) == 0 ? SDO_OK
                                                                          : SDO_ABORT_MEMORY;
}

/* One SDO channel serves commands and upload, so nothing can have been started since the beginning.
 */
uint32_t object_program_end(void *context, const struct od_entry *entry, uint32_t size)
{
    struct controller *controller = context;
    (void)entry;
    const int result = program_slot_finish(&controller->slot, size, &controller->config);
    if (result != 0) {
        return SDO_ABORT_VALUE;
    }
    stream_close(&controller->stream);
    return SDO_OK;
}

void object_program_abort(void *context, const struct od_entry *entry)
{
    struct controller *controller = context;
    (void)entry;
    program_slot_abandon(&controller->slot);
}

uint32_t object_program_size(void *context, const struct od_entry *entry, uint32_t *size)
{
    const struct controller *controller = context;
    (void)entry;
    if (!controller->slot.present) {
        return SDO_ABORT_NO_DATA;
    }
    *size = controller->slot.program.header.image_size;
    return SDO_OK;
}

uint32_t object_program_read(void *context, const struct od_entry *entry, uint32_t offset,
                             uint8_t *data, uint32_t size)
{
    const struct controller *controller = context;
    (void)entry;
    memcpy(data, controller->slot.program.image + offset, size);
    return SDO_OK;
}

/* ---- From sub 2 on: state of the upload, properties of the program ---- */

static uint64_t header_number(const struct program_slot *slot, uint8_t sub)
{
    const struct program_header *header = &slot->program.header;
    switch (sub) {
    case 5:
        return header->crc32;
    case 6:
        return header->image_size;
    case 7:
        return header->segment_count;
    case 8:
        return header->piece_count;
    case 9:
        return program_ticks(&slot->program);
    case 10:
        return header->duration_q32_s;
    case 11:
        return (uint64_t)header->length_q40_mm;
    default:
        return 0;
    }
}

#define STOPS_FIRST 16u /* four numbers of the longest hold, four of the longest fault stop */
#define FAULT_FIRST 20u
#define AXES_NUMBER 24u /* then start and end of the axes after the plane */
#define START_REST  25u
#define END_REST    (START_REST + AXES_MAX - PROGRAM_PLANE) /* the same of its end */

/* The first piece whose stop time bound is the longest one, which the header holds. */
static uint32_t longest_piece(const struct program *p, enum program_stop_kind kind,
                              uint32_t worst_us)
{
    const uint32_t last = p->header.piece_count - 1u;
    for (uint32_t i = 0; i < last; ++i) {
        struct program_stop stop;
        program_stop_get(p, i, kind, &stop);
        if (stop.bound_us == worst_us) {
            return i;
        }
    }
    return last;
}

/* An arc length is below 2^22 mm. */
static uint32_t start_um(const struct program *p, uint32_t piece)
{
    const uint64_t start_q20_mm = (uint64_t)program_piece_start(p, piece) >> 20;
    return (uint32_t)((start_q20_mm * 1000u + (1u << 19)) >> 20);
}

static uint64_t stop_number(const struct program *p, uint8_t sub)
{
    const struct program_header *header = &p->header;
    const bool fault = sub >= FAULT_FIRST;
    const uint32_t worst_us = fault ? header->fault_worst_us : header->hold_worst_us;
    const uint8_t number = (uint8_t)(sub - (fault ? FAULT_FIRST : STOPS_FIRST));
    if (number == 0u) {
        return worst_us;
    }
    if (number == 1u) {
        return fault ? header->fault_worst_um : header->hold_worst_um;
    }
    const uint32_t piece =
        longest_piece(p, fault ? PROGRAM_STOP_FAULT : PROGRAM_STOP_HOLD, worst_us);
    return number == 2u ? piece : start_um(p, piece);
}

/* While axes move the main loop has no time for a check: a job in chunks needs it, and homing, and stop commands. */
static uint64_t place_number(struct controller *controller, uint8_t sub)
{
    struct program_slot *slot = &controller->slot;
    if (!program_slot_is_checked(slot, &controller->config) && controller_moving(controller)) {
        return 0;
    }
    program_slot_refresh(slot, &controller->config);
    const uint32_t first = first_axis(&slot->program.header);
    if (sub >= START_REST) {
        const int32_t *counts = sub < END_REST ? slot->start_counts : slot->end_counts;
        const uint32_t axis = PROGRAM_PLANE + (sub - START_REST) % (AXES_MAX - PROGRAM_PLANE);
        return axis < slot->program.header.axis_count ? (uint64_t)(int64_t)counts[first + axis]
                                                      : 0u;
    }
    const int32_t *counts = sub < 14u ? slot->start_counts : slot->end_counts;
    return (uint64_t)(int64_t)counts[first + (sub & 1u)];
}

uint64_t object_read_program(struct controller *controller, const struct od_entry *entry)
{
    const uint8_t sub = entry->sub;
    const struct program_slot *slot = &controller->slot;
    switch (sub) {
    case 2:
        return (uint64_t)program_slot_state(slot);
    case 3:
        return (uint64_t)(int64_t)slot->refused.code;
    case 4:
        return slot->refused.index;
    default:
        break;
    }
    if (!slot->present) {
        return 0;
    }
    if (sub == AXES_NUMBER) {
        return slot->program.header.axis_count;
    }
    if (sub > AXES_NUMBER) {
        return place_number(controller, sub);
    }
    if (sub >= STOPS_FIRST) {
        return stop_number(&slot->program, sub);
    }
    return sub < 12u ? header_number(slot, sub) : place_number(controller, sub);
}
