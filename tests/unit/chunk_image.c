/* SPDX-License-Identifier: MIT */
/* Implements chunk_image.h (see there): chunks of a job that is small enough to be written by hand. Part of the C
 * tests; no I/O. */
#include "chunk_image.h"

#include <string.h>

#include "canopen/cob.h"
#include "core/chunk.h"
#include "core/crc32.h"
#include "stop_table.h"

#define Q32        (UINT64_C(1) << 32)
#define Q40        (INT64_C(1) << 40)
#define Q44        (INT64_C(1) << 44)
#define SEGMENT_MM 4
#define RAMP_MM    4
#define RAMP_Q32_S (Q32 / 2)
#define EVEN_Q32_S (Q32 / 32)

static void put_i64(uint8_t *at, int64_t value)
{
    cob_put(at, (uint64_t)value, 8);
}

/* Where a piece of the job begins. */
static int64_t piece_q40_mm(uint32_t piece)
{
    return piece == 0 ? 0 : RAMP_MM * Q40 + (int64_t)(piece - 1u) * (Q40 / 2);
}

static uint64_t piece_q32_s(uint32_t piece)
{
    return piece == 0 ? 0 : RAMP_Q32_S + (uint64_t)(piece - 1u) * EVEN_Q32_S;
}

static uint32_t segment_of(uint32_t piece)
{
    return (uint32_t)(piece_q40_mm(piece) / (SEGMENT_MM * Q40));
}

static void put_segment(uint8_t *at, uint32_t i, int64_t x_q40_mm, int32_t y_mm)
{
    put_i64(at, (int64_t)i * SEGMENT_MM * Q40);
    put_i64(at + 8, x_q40_mm + (int64_t)i * SEGMENT_MM * Q40);
    put_i64(at + 16, y_mm * Q40);
    for (uint32_t k = 0; k < 3u; ++k) {
        put_i64(at + 24 + 16u * k, 2 * Q44);
    }
}

/* c: of tau to the power of 1, 4, 5, 6. */
static uint8_t *put_piece(uint8_t *at, uint64_t duration_q32_s, int64_t start_q40_mm,
                          const int64_t c_mm[4])
{
    put_i64(at, (int64_t)duration_q32_s);
    put_i64(at + 8, start_q40_mm);
    put_i64(at + 16, c_mm[0] * Q40);
    for (uint32_t k = 1; k < 4u; ++k) {
        put_i64(at + 32u + 8u * k, c_mm[k] * Q40);
    }
    cob_put(at + 72, (1u << 14) + (1u << 13), 2);
    memset(at + 74, 152, PROGRAM_LEVELS); /* 8 /s */
    memset(at + 81, 125, PROGRAM_LEVELS); /* 198 /s^2 */
    return at + PROGRAM_PIECE_SIZE;
}

static void put_pieces(uint8_t *at, const struct chunk_plan *plan)
{
    static const int64_t up_mm[4] = {0, 20, -24, 8};
    static const int64_t down_mm[4] = {8, -20, 24, -8};
    const int64_t zero_q40_mm = (int64_t)segment_of(plan->from) * SEGMENT_MM * Q40;
    for (uint32_t i = plan->from; i < plan->to; ++i) {
        if (i == 0u) {
            at = put_piece(at, RAMP_Q32_S, 0, up_mm);
        } else {
            at = put_piece(at, EVEN_Q32_S, piece_q40_mm(i) - zero_q40_mm, (const int64_t[4]){0});
            put_i64(at - PROGRAM_PIECE_SIZE + 16, Q40 / 2);
        }
    }
    (void)put_piece(at, RAMP_Q32_S, piece_q40_mm(plan->to) - zero_q40_mm, down_mm);
}

static uint32_t segments_of(const struct chunk_plan *plan)
{
    return segment_of(plan->to) + RAMP_MM / SEGMENT_MM - segment_of(plan->from);
}

static uint32_t put_program(uint8_t *image, const struct chunk_plan *plan, int32_t x_mm,
                            int32_t y_mm)
{
    static const uint8_t stops[6] = {118, 124, 118, 134, 132, 134};
    const uint32_t segments = segments_of(plan);
    const uint32_t pieces = plan->to + 1u - plan->from;
    const uint32_t size = PROGRAM_HEADER_SIZE + segments * PROGRAM_SEGMENT_SIZE +
                          pieces * (PROGRAM_PIECE_SIZE + PROGRAM_STOP_SIZE);
    const int64_t x_q40_mm = x_mm * Q40 + (int64_t)segment_of(plan->from) * SEGMENT_MM * Q40;
    memset(image, 0, size);
    memcpy(image, "HDGP", 4);
    cob_put(image + 4, PROGRAM_VERSION, 2);
    cob_put(image + 6, PROGRAM_HEADER_SIZE, 2);
    cob_put(image + 8, size, 4);
    cob_put(image + 16, 1000, 4);
    cob_put(image + 20, segments, 4);
    cob_put(image + 24, pieces, 4);
    cob_put(image + 28, plan->from > 0u ? PROGRAM_FLAG_MOVING : 0u, 2);
    cob_put(image + 30, PROGRAM_PLANE, 2);
    put_i64(image + 32, (int64_t)(piece_q32_s(plan->to) + RAMP_Q32_S - piece_q32_s(plan->from)));
    put_i64(image + 40, (int64_t)segments * SEGMENT_MM * Q40);
    for (uint32_t i = 0; i < segments; ++i) {
        put_segment(image + PROGRAM_HEADER_SIZE + (size_t)i * PROGRAM_SEGMENT_SIZE, i, x_q40_mm,
                    y_mm);
    }
    put_pieces(image + PROGRAM_HEADER_SIZE + (size_t)segments * PROGRAM_SEGMENT_SIZE, plan);
    stop_table_write(image, size, stops);
    return size;
}

static void put_shifts(uint8_t *bytes, const struct chunk_plan *plan)
{
    const uint32_t segment_shift = segment_of(plan->from) - segment_of(plan->previous);
    const uint32_t before_end = segment_of(plan->joint) + RAMP_MM / SEGMENT_MM;
    cob_put(bytes + 24, plan->from - plan->previous, 4);
    cob_put(bytes + 28, segment_shift, 4);
    cob_put(bytes + 32, plan->joint - plan->from, 4);
    cob_put(bytes + 36, before_end - segment_of(plan->from), 4);
    put_i64(bytes + 40, (int64_t)segment_shift * SEGMENT_MM * Q40);
    put_i64(bytes + 48, (int64_t)(piece_q32_s(plan->from) - piece_q32_s(plan->previous)));
}

static uint32_t remaining_ms(const struct chunk_plan *plan)
{
    const uint64_t left_q32_s = piece_q32_s(plan->whole_to) + RAMP_Q32_S - piece_q32_s(plan->joint);
    return plan->whole_to == 0u ? CHUNK_TIME_UNKNOWN : (uint32_t)(left_q32_s * 1000u >> 32);
}

uint32_t chunk_image_make(uint8_t *bytes, const struct chunk_plan *plan, int32_t x_mm, int32_t y_mm)
{
    const uint32_t size =
        CHUNK_HEADER_SIZE + put_program(bytes + CHUNK_HEADER_SIZE, plan, x_mm, y_mm);
    memset(bytes, 0, CHUNK_HEADER_SIZE);
    memcpy(bytes, "HDGC", 4);
    cob_put(bytes + 4, CHUNK_VERSION, 2);
    cob_put(bytes + 6, plan->flags, 2);
    cob_put(bytes + 8, size, 4);
    cob_put(bytes + 16, plan->job, 4);
    cob_put(bytes + 20, plan->sequence, 4);
    if ((plan->flags & (CHUNK_FLAG_FIRST | CHUNK_FLAG_REST)) == 0u) {
        put_shifts(bytes, plan);
    }
    put_i64(bytes + 56, (plan->job_mm + (int64_t)segment_of(plan->from) * SEGMENT_MM) * Q40);
    cob_put(bytes + 64, 100u + plan->sequence, 4);
    cob_put(bytes + 68, remaining_ms(plan), 4);
    cob_put(bytes + 72, plan->rest_ms, 4);
    cob_put(bytes + 76, plan->rest_flags, 4);
    chunk_image_seal(bytes);
    return size;
}

static void put_event(uint8_t *at, const struct program_event *event, int64_t place_q40_mm)
{
    put_i64(at, place_q40_mm);
    at[8] = event->kind;
    at[9] = event->channel;
    cob_put(at + 10, event->mask, 2);
    cob_put(at + 12, (uint32_t)event->value, 4);
}

uint32_t chunk_image_switch(uint8_t *bytes, const struct program_event *events, uint32_t count)
{
    uint8_t *image = bytes + CHUNK_HEADER_SIZE;
    const int64_t start_q40_mm = (int64_t)cob_get(bytes + 56, 8);
    const int64_t length_q40_mm = (int64_t)cob_get(image + 40, 8);
    uint32_t size = (uint32_t)cob_get(bytes + 8, 4);
    uint32_t own = 0;
    for (uint32_t i = 0; i < count; ++i) {
        const int64_t place_q40_mm = events[i].place_q40_mm - start_q40_mm;
        if (place_q40_mm >= 0 && place_q40_mm <= length_q40_mm) {
            put_event(bytes + size, &events[i], place_q40_mm);
            size += PROGRAM_EVENT_SIZE;
            own++;
        }
    }
    cob_put(bytes + 8, size, 4);
    cob_put(image + 8, size - CHUNK_HEADER_SIZE, 4);
    cob_put(image + 76, own, 4);
    chunk_image_seal(bytes);
    return size;
}

void chunk_image_seal(uint8_t *bytes)
{
    const uint32_t size = (uint32_t)cob_get(bytes + 8, 4);
    uint8_t *image = bytes + CHUNK_HEADER_SIZE;
    cob_put(image + 12, crc32_update(0, image + 16, size - CHUNK_HEADER_SIZE - 16u), 4);
    cob_put(bytes + 12, crc32_update(crc32_update(0, bytes + 4, 8), bytes + 16, size - 16u), 4);
}
