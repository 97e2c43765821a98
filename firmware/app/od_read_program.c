/* SPDX-License-Identifier: MIT */
#include "app/od_read_program.h"

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

static uint64_t place_number(struct controller *controller, uint8_t sub)
{
    struct program_slot *slot = &controller->slot;
    program_slot_refresh(slot, &controller->config);
    const int32_t *counts = sub < 14u ? slot->start_counts : slot->end_counts;
    return (uint64_t)(int64_t)counts[sub & 1u];
}

uint64_t od_read_program(struct controller *controller, uint8_t sub)
{
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
    return sub < 12u ? header_number(slot, sub) : place_number(controller, sub);
}
