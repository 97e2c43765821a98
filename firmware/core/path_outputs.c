/* SPDX-License-Identifier: MIT */
/* Implements core/path_outputs.h (see there): the outputs of the path at each setpoint. Used by app/machine,
 * sim/offline and host tools. Main loop or tick, as each function states. Changes only its struct; no I/O. */
#include "core/path_outputs.h"

#include <string.h>

#include "core/qmath.h"

#define MOST_FEED_Q16 INT64_C(0x7FFFFFFF) /* 32 m/s: its product with a gain has 62 bits */

void path_outputs_clear(struct path_outputs *outputs)
{
    memset(outputs, 0, sizeof *outputs);
}

void path_outputs_set(struct path_outputs *outputs, const struct path_outputs_values *values)
{
    path_outputs_clear(outputs);
    outputs->values = *values;
}

/* Reads the place of event number `next`, if it exists. */
static void read_next(struct path_outputs *outputs, const struct program *program)
{
    const int is_left = outputs->next < program->header.event_count;
    outputs->program = is_left ? program : NULL;
    outputs->next_place_q40_mm = is_left ? program_event_place(program, outputs->next) : 0;
}

static void act(struct path_outputs *outputs, const struct program_event *event)
{
    if (event->kind == PROGRAM_EVENT_DIGITAL) {
        const uint32_t others = outputs->values.digital & ~(uint32_t)event->mask;
        outputs->values.digital = (uint16_t)(others | (uint32_t)event->value);
    } else if (event->kind == PROGRAM_EVENT_ANALOGUE) {
        outputs->values.analogue[event->channel] = (int16_t)event->value;
        outputs->proportional &= ~(1u << event->channel);
    } else {
        outputs->gain_q16[event->channel] = event->value;
        outputs->proportional |= 1u << event->channel;
    }
}

static int acts_until(struct path_outputs *outputs, int64_t arc_length_q40_mm)
{
    const struct program *program = outputs->program;
    if (program == NULL || outputs->next_place_q40_mm > arc_length_q40_mm) {
        return 0;
    }
    struct program_event event;
    program_event_get(program, outputs->next, &event);
    act(outputs, &event);
    outputs->next++;
    read_next(outputs, program);
    return 1;
}

/* gain * feed, to nearest, held inside 16 bits. */
static int16_t proportional_value(int32_t gain_q16, int64_t feed_q32_mm_s)
{
    const int64_t feed_q16 =
        feed_q32_mm_s < 0 ? 0 : qmath_lesser(feed_q32_mm_s >> 16, MOST_FEED_Q16);
    const int64_t value = (gain_q16 * feed_q16 + INT64_C(0x80000000)) >> 32;
    if (value > INT16_MAX) {
        return INT16_MAX;
    }
    return value < INT16_MIN ? INT16_MIN : (int16_t)value;
}

static void follow_feed(struct path_outputs *outputs, int64_t feed_q32_mm_s)
{
    for (uint32_t i = 0; i < PROGRAM_ANALOGUES; i++) {
        if ((outputs->proportional >> i & 1u) != 0u) {
            outputs->values.analogue[i] = proportional_value(outputs->gain_q16[i], feed_q32_mm_s);
        }
    }
}

void path_outputs_begin(struct path_outputs *outputs, const struct program *program,
                        int64_t arc_length_q40_mm)
{
    path_outputs_clear(outputs);
    read_next(outputs, program);
    while (acts_until(outputs, arc_length_q40_mm)) {
    }
}

void path_outputs_carry(struct path_outputs *outputs, const struct program *before,
                        const struct program *program, int64_t arc_shift_q40_mm)
{
    const uint32_t left_out = program_first_event_from(before, arc_shift_q40_mm);
    outputs->next = outputs->next > left_out ? outputs->next - left_out : 0u;
    read_next(outputs, program);
}

void path_outputs_begin_next(struct path_outputs *outputs, const struct program *program)
{
    outputs->next = 0;
    read_next(outputs, program);
}

void path_outputs_step(struct path_outputs *outputs, int64_t arc_length_q40_mm,
                       int64_t feed_q32_mm_s)
{
    for (uint32_t i = 0; i < PROGRAM_EVENTS_A_TICK; i++) {
        if (!acts_until(outputs, arc_length_q40_mm)) {
            break;
        }
    }
    if (outputs->proportional != 0u) {
        follow_feed(outputs, feed_q32_mm_s);
    }
}
