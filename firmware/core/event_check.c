/* SPDX-License-Identifier: MIT */
/* Implements core/event_check.h (see there): the checks of the events of a program. A part of program_check. Pure,
 * main loop. */
#include "core/event_check.h"

#include "core/segment_length_check.h"

static int check_kind(const struct program_event *event)
{
    const uint32_t channels =
        event->kind == PROGRAM_EVENT_DIGITAL ? 1u : (uint32_t)PROGRAM_ANALOGUES;
    return event->kind >= PROGRAM_EVENT_DIGITAL && event->kind <= PROGRAM_EVENT_PROPORTIONAL &&
                   event->channel < channels
               ? 0
               : PROGRAM_ERR_EVENT_KIND;
}

static int check_value(const struct program_event *event)
{
    int good = event->mask == 0u;
    if (event->kind == PROGRAM_EVENT_DIGITAL) {
        good = event->mask != 0u && ((uint32_t)event->value & ~(uint32_t)event->mask) == 0u;
    } else if (event->kind == PROGRAM_EVENT_ANALOGUE) {
        good = good && event->value >= INT16_MIN && event->value <= INT16_MAX;
    }
    return good ? 0 : PROGRAM_ERR_EVENT_VALUE;
}

static int check_event(const struct program *p, uint32_t i)
{
    struct program_event event;
    program_event_get(p, i, &event);
    const int64_t least = i > 0u ? program_event_place(p, i - 1u) : 0;
    int code = check_kind(&event);
    code = code != 0 ? code : check_value(&event);
    if (code == 0 && (event.place_q40_mm < least || event.place_q40_mm > p->header.length_q40_mm)) {
        code = PROGRAM_ERR_EVENT_PLACE;
    }
    return code;
}

/* Any 17 events in a row are further apart than a tick at 200 % of the highest feed there. */
static int check_density(const struct program *p, uint32_t *index)
{
    uint32_t piece = 0;
    for (*index = PROGRAM_EVENTS_A_TICK; *index < p->header.event_count; (*index)++) {
        const int64_t from_q40_mm = program_event_place(p, *index - PROGRAM_EVENTS_A_TICK);
        if (!length_exceeds_tick(p, from_q40_mm, program_event_place(p, *index), &piece)) {
            return PROGRAM_ERR_EVENT_DENSE;
        }
    }
    *index = 0;
    return 0;
}

int event_check_all(const struct program *p, uint32_t *index)
{
    for (*index = 0; *index < p->header.event_count; (*index)++) {
        const int code = check_event(p, *index);
        if (code != 0) {
            return code;
        }
    }
    return check_density(p, index);
}
