/* SPDX-License-Identifier: MIT */
/* Implements chunked.h (see there): a planar program cut into the chunks of a job, for tests. Part of the C tests;
 * no I/O. */
#include "chunked.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "compact_image.h"
#include "core/crc32.h"
#include "core/little_endian.h"
#include "golden.h"
#include "stop_table.h"
#include "unity.h"

#define Q40              1099511627776.0
#define Q32              4294967296.0
#define SAMPLES          200
#define MOST_DISTANCE_MM 28.0
#define JOB              0x5EEDu

static void put(uint8_t *at, uint64_t value, int bytes)
{
    for (int i = 0; i < bytes; i++) {
        at[i] = (uint8_t)(value >> (8 * i));
    }
}

/* --- A piece from derivatives by time --- */

/* Coefficients c[k] of t^k, t from 0; gives the arc length at its end. */
static int64_t write_piece(const double c[8], uint64_t duration_q32, int64_t start_q40, uint8_t *at)
{
    const int exponent = program_piece_exponent(duration_q32);
    const double h = (double)duration_q32 / Q32;
    double sum = 0;
    memset(at, 0, PROGRAM_PIECE_SIZE);
    put(at, duration_q32, 8);
    put(at + 8, (uint64_t)start_q40, 8);
    for (int k = 1; k < 8; k++) {
        const double coefficient = nearbyint(ldexp(c[k], 40 + k * exponent));
        put(at + 8 + 8 * k, (uint64_t)(int64_t)coefficient, 8);
        sum += ldexp(coefficient, -k * exponent) * pow(h, k);
    }
    return start_q40 + (int64_t)nearbyint(sum);
}

/* A polynomial from t on. */
static void shift(double out[8], const double c[8], double t)
{
    memcpy(out, c, 8 * sizeof *out);
    for (int i = 0; i < 7; i++) {
        for (int k = 6; k >= i; k--) {
            out[k] += t * out[k + 1];
        }
    }
}

/* Where the pieces of a program with such an image begin. */
static uint8_t *pieces_of(const struct program *p, uint8_t *image)
{
    return image + p->header.header_size +
           (size_t)p->header.segment_count * program_segment_size(p->header.axis_count);
}

void chunked_refine(struct override_program *p, double longest_s)
{
    const struct program *old = &p->program;
    const uint32_t most = old->size + OVERRIDE_PIECES * (PROGRAM_PIECE_SIZE + PROGRAM_STOP_SIZE);
    uint8_t *image = calloc(1, most);
    TEST_ASSERT_NOT_NULL(image);
    uint8_t *at = pieces_of(old, image);
    uint32_t count = 0;
    memcpy(image, old->image, (size_t)(at - image));
    for (uint32_t i = 0; i < old->header.piece_count; i++) {
        const uint64_t duration = program_piece_duration(old, i);
        const uint32_t parts = (uint32_t)ceil((double)duration / Q32 / longest_s);
        int64_t arc_q40 = program_piece_start(old, i);
        for (uint32_t k = 0; k < parts; k++) {
            const uint64_t from = duration * k / parts;
            double c[8];
            shift(c, p->pieces[i].c, (double)from / Q32);
            arc_q40 = write_piece(c, duration * (k + 1u) / parts - from, arc_q40, at);
            override_program_bound(&p->peak, at);
            at += PROGRAM_PIECE_SIZE;
            TEST_ASSERT_TRUE(++count <= OVERRIDE_PIECES);
        }
    }
    const uint32_t size = (uint32_t)(at - image) + count * PROGRAM_STOP_SIZE;
    put(image + 8, size, 4);
    put(image + 24, count, 4);
    golden_seal(image, size);
    override_program_close(p);
    override_program_image(p, image, size);
}

/* --- Events --- */

static int by_place(const void *a, const void *b)
{
    const int64_t one = *(const int64_t *)a;
    const int64_t other = *(const int64_t *)b;
    return (one > other) - (one < other);
}

static int64_t any_place(const struct program *p, uint64_t *random)
{
    const uint64_t length_q40 = (uint64_t)p->header.length_q40_mm;
    if (golden_random(random) % 4u != 0u) {
        return (int64_t)(golden_random(random) % (length_q40 + 1u));
    }
    return program_segment_start(p, (uint32_t)(golden_random(random) % p->header.segment_count));
}

static void put_event(uint8_t *at, const struct program_event *event)
{
    put(at, (uint64_t)event->place_q40_mm, 8);
    at[8] = event->kind;
    at[9] = event->channel;
    put(at + 10, event->mask, 2);
    put(at + 12, (uint32_t)event->value, 4);
}

void chunked_add_events(struct override_program *p, uint32_t count, uint64_t *random)
{
    int64_t places[CHUNKED_EVENTS];
    const uint32_t size = p->program.size + count * PROGRAM_EVENT_SIZE;
    TEST_ASSERT_TRUE(count >= 2u && count <= CHUNKED_EVENTS);
    places[0] = 0;
    places[1] = p->program.header.length_q40_mm;
    for (uint32_t i = 2; i < count; i++) {
        places[i] =
            golden_random(random) % 8u == 0u ? places[i - 1u] : any_place(&p->program, random);
    }
    qsort(places, count, sizeof *places, by_place);
    uint8_t *image = calloc(1, size);
    TEST_ASSERT_NOT_NULL(image);
    memcpy(image, p->image, p->program.size);
    for (uint32_t i = 0; i < count; i++) {
        const struct program_event event = {places[i], PROGRAM_EVENT_ANALOGUE, 0, 0,
                                            1 + (int32_t)i};
        put_event(image + p->program.size + (size_t)i * PROGRAM_EVENT_SIZE, &event);
    }
    put(image + 8, size, 4);
    put(image + 76, count, 4);
    free(p->image);
    p->image = image;
    p->program.image = image;
    p->program.size = size;
    p->program.header.image_size = size;
    p->program.header.event_count = count;
}

/* --- Tail: a quintic --- */

struct quintic {
    double c[6]; /* distance from the joint by powers of t / duration */
    double duration_s;
};

/* Distance and its first three derivatives at a part of the duration. */
static void at_part(const struct quintic *q, double x, double d[4])
{
    memset(d, 0, 4 * sizeof *d);
    for (int k = 5; k >= 0; k--) {
        d[3] = d[3] * x + 3 * d[2];
        d[2] = d[2] * x + 2 * d[1];
        d[1] = d[1] * x + d[0];
        d[0] = d[0] * x + q->c[k];
    }
    d[1] /= q->duration_s;
    d[2] /= q->duration_s * q->duration_s;
    d[3] /= q->duration_s * q->duration_s * q->duration_s;
}

static void set_quintic(struct quintic *q, double way_mm, double feed, double acceleration,
                        double duration_s)
{
    const double v = feed * duration_s;
    const double a = acceleration * duration_s * duration_s;
    q->duration_s = duration_s;
    q->c[0] = 0;
    q->c[1] = v;
    q->c[2] = a / 2;
    q->c[3] = 10 * way_mm - 6 * v - 1.5 * a;
    q->c[4] = -15 * way_mm + 8 * v + 1.5 * a;
    q->c[5] = 6 * way_mm - 3 * v - 0.5 * a;
}

static int keeps(const struct quintic *q, const struct override_limits *limit)
{
    for (int n = 0; n <= SAMPLES; n++) {
        double d[4];
        at_part(q, (double)n / SAMPLES, d);
        if (d[1] < -1e-9 || d[1] > 0.99 * limit->feed || fabs(d[2]) > 0.99 * limit->acceleration ||
            fabs(d[3]) > 0.99 * limit->jerk) {
            return 0;
        }
    }
    return 1;
}

/* The shortest of some durations that keeps the limits. */
static int find_duration(struct quintic *q, const struct override_program *w, double way_mm,
                         const double state[4])
{
    for (int i = 0; i < 72; i++) { /* to 17 s */
        set_quintic(q, way_mm, state[1], state[2], 0.02 * pow(1.1, i));
        if (keeps(q, &w->limit)) {
            return 1;
        }
    }
    return 0;
}

static void write_tail(struct chunked_cut *cut, const struct override_program *w,
                       const struct quintic *q, int64_t start_q40)
{
    const double most_mm = fmax(q->duration_s * w->limit.feed, 1e-3);
    const uint32_t count = (uint32_t)fmin(ceil(most_mm / MOST_DISTANCE_MM), CHUNKED_TAIL);
    const uint64_t part_q32 = (uint64_t)(q->duration_s * Q32 / count);
    int64_t arc_q40 = start_q40;
    double whole[8] = {0};
    for (int k = 0; k < 6; k++) {
        whole[k] = q->c[k] / pow(q->duration_s, k);
    }
    for (uint32_t i = 0; i < count; i++) {
        double c[8];
        shift(c, whole, (double)part_q32 * i / Q32);
        arc_q40 = write_piece(c, part_q32, arc_q40, cut->tail[i]);
        override_program_bound(&w->limit, cut->tail[i]);
    }
    cut->tail_count = count;
}

static int64_t segment_end(const struct program *p, uint32_t segment)
{
    return segment + 1u < p->header.segment_count ? program_segment_start(p, segment + 1u)
                                                  : p->header.length_q40_mm;
}

/* The nearest end of a segment, from `least` segments on, that a tail from the joint can rest at. */
static int find_tail(struct chunked_cut *cut, const struct override_program *w, uint32_t least)
{
    const struct program *p = &w->program;
    const int64_t start_q40 = program_piece_start(p, cut->joint);
    double state[4];
    override_program_feed(w, cut->joint, w->pieces[cut->joint].start_s, state);
    for (uint32_t k = least; k < p->header.segment_count; k++) {
        struct quintic q;
        const double way_mm = (double)(segment_end(p, k) - start_q40) / Q40;
        if (way_mm > 4 * MOST_DISTANCE_MM) {
            return 0;
        }
        if (way_mm > 0 && find_duration(&q, w, way_mm, state)) {
            /* to the unit of the format */
            const double whole = floor(q.duration_s * 1024) / 1024;
            set_quintic(&q, way_mm, state[1], state[2], fmax(whole, 0.02));
            if (keeps(&q, &w->limit) &&
                q.duration_s * w->limit.feed <= CHUNKED_TAIL * MOST_DISTANCE_MM) {
                cut->segments = k + 1u;
                write_tail(cut, w, &q, start_q40);
                return 1;
            }
        }
    }
    return 0;
}

/* --- Chunks --- */

static const uint8_t *piece_bytes(const struct override_program *w, uint32_t i)
{
    return pieces_of(&w->program, w->image) + (size_t)i * PROGRAM_PIECE_SIZE;
}

static const uint8_t *segment_bytes(const struct program *p, uint32_t i)
{
    return p->image + p->header.header_size +
           (size_t)i * program_segment_size(p->header.axis_count);
}

static int64_t arc_of(const struct program *p, const struct chunked_cut *cut)
{
    return program_segment_start(p, cut->segment);
}

static uint64_t time_of(const struct program *p, uint32_t piece)
{
    uint64_t sum = 0;
    for (uint32_t i = 0; i < piece; i++) {
        sum += program_piece_duration(p, i);
    }
    return sum;
}

/* Segments and pieces, from the start of the chunk's first segment on. */
static void write_body(uint8_t *at, const struct override_program *w, const struct chunked_cut *cut)
{
    const struct program *p = &w->program;
    const uint64_t arc = (uint64_t)arc_of(p, cut);
    const uint32_t segment_size = program_segment_size(p->header.axis_count);
    for (uint32_t i = cut->segment; i < cut->segments; i++) {
        memcpy(at, segment_bytes(p, i), segment_size);
        put(at, (uint64_t)program_segment_start(p, i) - arc, 8);
        at += segment_size;
    }
    for (uint32_t i = cut->first; i < cut->joint + cut->tail_count; i++) {
        const uint8_t *from = i < cut->joint ? piece_bytes(w, i) : cut->tail[i - cut->joint];
        memcpy(at, from, PROGRAM_PIECE_SIZE);
        put(at + 8, read_u64(from + 8) - arc, 8);
        at += PROGRAM_PIECE_SIZE;
    }
}

static int64_t end_of(const struct program *p, const struct chunked_cut *cut)
{
    return segment_end(p, cut->segments - 1u);
}

/* The number of the first event of a chunk, and how many it has. */
static uint32_t events_of(const struct program *p, const struct chunked_cut *cut, uint32_t *count)
{
    const uint32_t first = program_first_event_from(p, arc_of(p, cut));
    *count = program_first_event_from(p, end_of(p, cut) + 1) - first;
    return first;
}

static void write_events(uint8_t *at, const struct program *p, const struct chunked_cut *cut)
{
    uint32_t count;
    const uint32_t first = events_of(p, cut, &count);
    for (uint32_t i = 0; i < count; i++) {
        struct program_event event;
        program_event_get(p, first + i, &event);
        event.place_q40_mm -= arc_of(p, cut);
        put_event(at + (size_t)i * PROGRAM_EVENT_SIZE, &event);
    }
}

static uint64_t tail_time(const struct chunked_cut *cut)
{
    uint64_t sum = 0;
    for (uint32_t i = 0; i < cut->tail_count; i++) {
        sum += read_u64(cut->tail[i]);
    }
    return sum;
}

static void write_image(uint8_t *image, uint32_t size, const struct override_program *w,
                        const struct chunked_cut *cut)
{
    const struct program *p = &w->program;
    const int64_t end_q40 = end_of(p, cut);
    uint32_t events;
    uint8_t codes[6];
    (void)events_of(p, cut, &events);
    memcpy(image, p->image, p->header.header_size);
    memcpy(image, "HDGP", 4);
    put(image + 4, PROGRAM_VERSION, 2);
    put(image + 6, p->header.header_size, 2);
    put(image + 8, size, 4);
    put(image + 16, p->header.period_us, 4);
    put(image + 20, cut->segments - cut->segment, 4);
    put(image + 24, cut->joint - cut->first + cut->tail_count, 4);
    put(image + 28, cut->first > 0 ? PROGRAM_FLAG_MOVING : 0u, 2);
    put(image + 30, p->header.axis_count, 2);
    put(image + 32, time_of(p, cut->joint) - time_of(p, cut->first) + tail_time(cut), 8);
    put(image + 40, (uint64_t)(end_q40 - arc_of(p, cut)), 8);
    put(image + 76, events, 4);
    write_body(image + p->header.header_size, w, cut);
    write_events(image + size - (size_t)events * PROGRAM_EVENT_SIZE, p, cut);
    override_program_codes(&w->limit, codes);
    stop_table_write(image, size, codes);
}

void chunked_seal(uint8_t *bytes, uint32_t size)
{
    golden_seal(bytes + CHUNK_HEADER_SIZE, size - CHUNK_HEADER_SIZE);
    const uint32_t crc = crc32_update(crc32_update(0, bytes + 4, 8), bytes + 16, size - 16u);
    for (int i = 0; i < 4; i++) {
        bytes[12 + i] = (uint8_t)(crc >> (8 * i));
    }
}

static void write_header(uint8_t *at, uint32_t size, const struct program *p,
                         const struct chunked_cut *cut, uint32_t sequence)
{
    const int last = cut->joint == p->header.piece_count;
    memset(at, 0, CHUNK_HEADER_SIZE);
    memcpy(at, "HDGC", 4);
    put(at + 4, CHUNK_VERSION, 2);
    put(at + 6, (sequence == 0 ? CHUNK_FLAG_FIRST : 0u) | (last ? CHUNK_FLAG_LAST : 0u), 2);
    put(at + 8, size, 4);
    put(at + 16, JOB, 4);
    put(at + 20, sequence, 4);
    put(at + 56, (uint64_t)arc_of(p, cut), 8);
    put(at + 68, CHUNK_TIME_UNKNOWN, 4);
    if (sequence > 0) {
        const struct chunked_cut *before = cut - 1;
        put(at + 24, cut->first - before->first, 4);
        put(at + 28, cut->segment - before->segment, 4);
        put(at + 32, before->joint - cut->first, 4);
        put(at + 36, before->segments - cut->segment, 4);
        put(at + 40, (uint64_t)(arc_of(p, cut) - arc_of(p, before)), 8);
        put(at + 48, time_of(p, cut->first) - time_of(p, before->first), 8);
    }
}

static void write_chunk(struct chunked *c, uint32_t i)
{
    const struct chunked_cut *cut = &c->cuts[i];
    uint32_t events;
    (void)events_of(&c->whole->program, cut, &events);
    const struct program_header *header = &c->whole->program.header;
    const uint32_t image =
        header->header_size +
        (cut->segments - cut->segment) * program_segment_size(header->axis_count) +
        (cut->joint - cut->first + cut->tail_count) * (PROGRAM_PIECE_SIZE + PROGRAM_STOP_SIZE) +
        events * PROGRAM_EVENT_SIZE;
    c->sizes[i] = CHUNK_HEADER_SIZE + image;
    c->bytes[i] = calloc(1, c->sizes[i]);
    TEST_ASSERT_NOT_NULL(c->bytes[i]);
    write_image(c->bytes[i] + CHUNK_HEADER_SIZE, image, c->whole, cut);
    write_header(c->bytes[i], c->sizes[i], &c->whole->program, cut, i);
    chunked_seal(c->bytes[i], c->sizes[i]);
}

static uint32_t segment_of(const struct program *p, int64_t arc_q40)
{
    uint32_t i = 0;
    while (i + 1u < p->header.segment_count && program_segment_start(p, i + 1u) <= arc_q40) {
        i++;
    }
    return i;
}

/* The next chunk: 1 where it can be cut so. */
static int add_cut(struct chunked *c, uint32_t first, uint32_t joint)
{
    const struct program *p = &c->whole->program;
    struct chunked_cut *cut = &c->cuts[c->count];
    memset(cut, 0, sizeof *cut);
    cut->first = first;
    cut->joint = joint;
    cut->segment = segment_of(p, program_piece_start(p, first));
    if (joint == p->header.piece_count) {
        cut->segments = p->header.segment_count;
    } else if (!find_tail(cut, c->whole,
                          c->count > 0 ? c->cuts[c->count - 1].segments - 1u
                                       : segment_of(p, program_piece_start(p, joint)))) {
        return 0;
    }
    c->count++;
    return 1;
}

static void write_all(struct chunked *c)
{
    for (uint32_t i = 0; i < c->count; i++) {
        write_chunk(c, i);
    }
}

int chunked_make(struct chunked *out, const struct override_program *whole, const uint32_t firsts[],
                 const uint32_t joints[], uint32_t count)
{
    memset(out, 0, sizeof *out);
    out->whole = whole;
    for (uint32_t i = 0; i < count; i++) {
        if (!add_cut(out, firsts[i], joints[i])) {
            return 0;
        }
    }
    write_all(out);
    return 1;
}

int chunked_random(struct chunked *out, const struct override_program *whole, uint64_t *random)
{
    const uint32_t pieces = whole->program.header.piece_count;
    const uint32_t shared = 1u + (uint32_t)(golden_random(random) % 24u);
    const uint32_t step = 1u + (uint32_t)(golden_random(random) % (pieces / 2u));
    uint32_t joint = 0;
    uint32_t first = 0;
    memset(out, 0, sizeof *out);
    out->whole = whole;
    while (joint < pieces && out->count + 2u < CHUNKED_MOST) {
        const uint32_t next = joint + 1u + (uint32_t)(golden_random(random) % step);
        if (next >= pieces) {
            break;
        }
        if (!add_cut(out, first, next)) {
            joint++;
            continue;
        }
        joint = next;
        const uint32_t before = first;
        first = joint > shared ? joint - shared : 0;
        first = first < before ? before : first;
    }
    if (out->count == 0) {
        return 0;
    }
    (void)add_cut(out, first, pieces);
    write_all(out);
    return 1;
}

int chunked_make_compact(struct chunked *c, uint32_t number)
{
    uint8_t *wide = c->bytes[number];
    uint8_t *out = malloc(c->sizes[number]);
    TEST_ASSERT_NOT_NULL(out);
    memcpy(out, wide, CHUNK_HEADER_SIZE);
    const uint32_t image = compact_image(out + CHUNK_HEADER_SIZE, wide + CHUNK_HEADER_SIZE);
    if (image == 0u) {
        free(out);
        return 0;
    }
    c->sizes[number] = CHUNK_HEADER_SIZE + image;
    put(out + 8, c->sizes[number], 4);
    chunked_seal(out, c->sizes[number]);
    c->bytes[number] =
        realloc(out, c->sizes[number]); /* so that the sanitizer sees any read beyond */
    TEST_ASSERT_NOT_NULL(c->bytes[number]);
    free(wide);
    return 1;
}

/* All its segments, so that the first one begins at this point. */
static void move_to(uint8_t *image, const int64_t point_q40[PROGRAM_AXES])
{
    struct program p;
    struct program_segment first;
    TEST_ASSERT_EQUAL_INT(0, program_open(&p, image, read_u32(image + 8)));
    program_segment_get(&p, 0, &first);
    const uint32_t axis_count = p.header.axis_count;
    const uint32_t curve_axes = program_curve_axes(axis_count);
    for (uint32_t i = 0; i < p.header.segment_count; i++) {
        uint8_t *segment = image + p.header.header_size + i * program_segment_size(axis_count);
        for (uint32_t axis = 0; axis < curve_axes; axis++) {
            uint8_t *at = segment + 8u + 8u * axis;
            put(at, read_u64(at) + (uint64_t)(point_q40[axis] - first.point_q40_mm[axis]), 8);
        }
        for (uint32_t k = 0; k < program_extra_axes(axis_count); k++) {
            uint8_t *at = segment + PROGRAM_SPACE_SIZE + PROGRAM_EXTRA_SIZE * k;
            const int64_t to_q40 = point_q40[PROGRAM_SPACE + k];
            put(at, read_u64(at) + (uint64_t)(to_q40 - first.extra[k].start_q40), 8);
        }
    }
}

static uint8_t *copy_of(const struct chunked *c, uint32_t number)
{
    uint8_t *out = malloc(c->sizes[number]);
    TEST_ASSERT_NOT_NULL(out);
    memcpy(out, c->bytes[number], c->sizes[number]);
    return out;
}

void chunked_copy(struct chunked *out, const struct chunked *from)
{
    *out = *from;
    for (uint32_t i = 0; i < from->count; i++) {
        out->bytes[i] = copy_of(from, i);
    }
}

void chunked_make_rest(struct chunked *c)
{
    const struct program_limits limits = golden_no_limits();
    struct program_fault fault;
    struct chunk first;
    TEST_ASSERT_EQUAL_INT(0, chunk_open(&first, c->bytes[0], c->sizes[0]));
    TEST_ASSERT_EQUAL_INT(0, chunk_check(&first, NULL, &limits, &fault));
    for (uint32_t i = 1; i < c->count; i++) {
        free(c->bytes[i]);
    }
    c->count = 2;
    c->bytes[1] = copy_of(c, 0);
    c->sizes[1] = c->sizes[0];
    put(c->bytes[1] + 6, CHUNK_FLAG_REST | CHUNK_FLAG_LAST, 2);
    put(c->bytes[1] + 20, 1, 4);
    put(c->bytes[1] + 56, (uint64_t)first.program.header.length_q40_mm, 8);
    move_to(c->bytes[1] + CHUNK_HEADER_SIZE, first.end.position_q40);
    chunked_seal(c->bytes[1], c->sizes[1]);
}

void chunked_close(struct chunked *c)
{
    for (uint32_t i = 0; i < c->count; i++) {
        free(c->bytes[i]);
    }
    c->count = 0;
}
