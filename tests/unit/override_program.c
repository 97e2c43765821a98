/* SPDX-License-Identifier: MIT */
/* Implements override_program.h (see there): programs for the override's property test. Part of the C tests and fuzz
 * harnesses; reads files of tests/data. */
#include "override_program.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/little_endian.h"
#include "golden.h"
#include "stop_table.h"
#include "unity.h"

#define Q40        1099511627776.0
#define Q32        4294967296.0
#define SAMPLES    400
#define SEGMENT_MM 31.0

double override_random(uint64_t *random, double low, double high)
{
    return low + (high - low) * (double)(golden_random(random) >> 11) / 9007199254740992.0;
}

static void put(uint8_t *at, uint64_t value, int bytes)
{
    for (int i = 0; i < bytes; i++) {
        at[i] = (uint8_t)(value >> (8 * i));
    }
}

static uint8_t *piece_at(const struct override_program *p, uint32_t i)
{
    const struct program_header *header = &p->program.header;
    return p->image + header->header_size +
           (size_t)header->segment_count * program_segment_size(header->axis_count) +
           (size_t)i * PROGRAM_PIECE_SIZE;
}

void override_program_feed(const struct override_program *p, uint32_t i, double time_s,
                           double derivative[4])
{
    const double *c = p->pieces[i].c;
    double t = time_s - p->pieces[i].start_s;
    memset(derivative, 0, 4 * sizeof *derivative);
    for (int k = 7; k >= 0; k--) {
        derivative[3] = derivative[3] * t + 3.0 * derivative[2];
        derivative[2] = derivative[2] * t + 2.0 * derivative[1];
        derivative[1] = derivative[1] * t + derivative[0];
        derivative[0] = derivative[0] * t + c[k];
    }
}

static double greater(double a, double b)
{
    return a > b ? a : b;
}

/* Coefficients and peaks of a piece whose times are known. */
static void read_piece(struct override_piece *piece, const struct program_piece *raw)
{
    static struct override_program one;
    double d[4];
    piece->c[0] = (double)raw->start_q40_mm / Q40;
    for (int k = 1; k < 8; k++) {
        piece->c[k] = ldexp((double)raw->c_q40_mm[k - 1],
                            -40 - k * program_piece_exponent(raw->duration_q32_s));
    }
    one.pieces[0] = *piece;
    for (int n = 0; n <= SAMPLES; n++) {
        override_program_feed(&one, 0,
                              piece->start_s + (piece->end_s - piece->start_s) * n / SAMPLES, d);
        piece->feed = greater(piece->feed, fabs(d[1]));
        piece->acceleration = greater(piece->acceleration, fabs(d[2]));
        piece->jerk = greater(piece->jerk, fabs(d[3]));
    }
    piece->feed = piece->feed * 1.0001 + 1e-6;
    piece->acceleration = piece->acceleration * 1.0001 + 1e-4;
    piece->jerk = piece->jerk * 1.0001 + 1e-2;
}

/* Doubles and peaks from the image. */
static void read_pieces(struct override_program *p)
{
    double start_s = 0;
    memset(&p->peak, 0, sizeof p->peak);
    TEST_ASSERT_TRUE(p->program.header.piece_count <= OVERRIDE_PIECES);
    for (uint32_t i = 0; i < p->program.header.piece_count; i++) {
        struct override_piece *piece = &p->pieces[i];
        struct program_piece raw;
        memset(piece, 0, sizeof *piece);
        program_piece_get(&p->program, i, &raw);
        piece->start_s = start_s;
        piece->end_s = start_s += (double)raw.duration_q32_s / Q32;
        read_piece(piece, &raw);
        p->peak.feed = greater(p->peak.feed, piece->feed);
        p->peak.acceleration = greater(p->peak.acceleration, piece->acceleration);
        p->peak.jerk = greater(p->peak.jerk, piece->jerk);
    }
}

/* The greatest code whose number is at most this. */
static uint8_t stored(double value, double scale)
{
    const double number = value * (1.0 - 1e-9) * scale;
    uint8_t code = 1;
    while (code < 255 && (double)program_number((uint8_t)(code + 1)) <= number) {
        code++;
    }
    return code;
}

/* docs/theory/feed.md section 7; no program limits but those of the controller. */
static void set_bounds(const struct override_limits *limit, struct override_piece *piece,
                       uint8_t *at)
{
    double v = piece->feed;
    double a = piece->acceleration;
    double j = piece->jerk;
    double f = fmin(2.0, limit->feed / v);
    f = fmin(f, sqrt((a + limit->acceleration) / (2.0 * a)));
    f = greater(1.0, fmin(f, cbrt((j + limit->jerk) / (2.0 * j))));
    uint32_t factor = (uint32_t)greater(16384.0, floor(f * (1.0 - 1e-9) * 16384.0));
    piece->rates[PROGRAM_LEVEL_FULL] = factor / 16384.0;
    put(at + 72, factor, 2);
    for (uint32_t k = 0; k < PROGRAM_LEVELS; k++) {
        piece->rates[k] = k == PROGRAM_LEVEL_FULL ? factor / 16384.0 : program_level_q9(k) / 512.0;
        f = piece->rates[k];
        double room_j = limit->jerk - f * f * f * j;
        at[74 + k] = stored(fmin((limit->acceleration - f * f * a) / v, room_j / (6.0 * f * a)),
                            4294967296.0);
        piece->slopes[k] = ldexp((double)program_number(at[74 + k]), -32);
        at[74 + PROGRAM_LEVELS + k] =
            stored((room_j - 3.0 * f * piece->slopes[k] * a) / v, 16777216.0);
        piece->seconds[k] = ldexp((double)program_number(at[74 + PROGRAM_LEVELS + k]), -24);
    }
}

/* The greatest code of at most this: 1 mm/s^2 or 64 mm/s^3 is 64, eight to a factor of 2. */
static uint8_t code_of(double value)
{
    return (uint8_t)fmin(255, floor(64 + 8 * log2(value) - 1e-3));
}

/* A hold brakes inside the limits, a fault stop inside twice of them. */
void override_program_codes(const struct override_limits *limit, uint8_t codes[6])
{
    const uint8_t jerk = code_of(limit->jerk / 64);
    const uint8_t acceleration = code_of(limit->acceleration);
    for (int kind = 0; kind < 2; kind++) {
        codes[3 * kind] = (uint8_t)(jerk + 8 * kind);
        codes[3 * kind + 1] = (uint8_t)(acceleration + 8 * kind);
        codes[3 * kind + 2] = (uint8_t)(jerk + 8 * kind);
    }
}

static void set_stops(struct override_program *p)
{
    uint8_t codes[6];
    override_program_codes(&p->limit, codes);
    stop_table_fill(&p->program, p->image, codes);
}

void override_program_limits(struct override_program *p, uint64_t *random)
{
    p->limit.feed = p->peak.feed * override_random(random, 1.0, 2.5);
    p->limit.acceleration = p->peak.acceleration * override_random(random, 1.05, 3.0);
    p->limit.jerk = p->peak.jerk * override_random(random, 1.05, 3.0);
    for (uint32_t i = 0; i < p->program.header.piece_count; i++) {
        set_bounds(&p->limit, &p->pieces[i], piece_at(p, i));
    }
    set_stops(p);
}

void override_program_bound(const struct override_limits *limit, uint8_t *piece_bytes)
{
    struct override_piece piece = {0};
    struct program_piece raw = {0};
    raw.duration_q32_s = read_u64(piece_bytes);
    raw.start_q40_mm = read_i64(piece_bytes + 8);
    for (int k = 0; k < 7; k++) {
        raw.c_q40_mm[k] = read_i64(piece_bytes + 16 + 8 * k);
    }
    piece.end_s = (double)raw.duration_q32_s / Q32;
    read_piece(&piece, &raw);
    set_bounds(limit, &piece, piece_bytes);
}

/* v0 + (v1 - v0) (10 x^3 - 15 x^4 + 6 x^5), x = t/T, as F' of a piece that begins at t = a. */
static void ramp_derivatives(double v0, double v1, double ramp_s, double a, double d[8])
{
    const double c[6] = {v0, 0, 0, 10 * (v1 - v0), -15 * (v1 - v0), 6 * (v1 - v0)};
    double x = a / ramp_s;
    for (int k = 1; k < 8; k++) { /* derivative k of F over k! */
        double sum = 0;
        for (int n = 5; n >= k - 1; n--) {
            double factor = 1;
            for (int m = 0; m < k - 1; m++) {
                factor *= (n - m) / ramp_s;
            }
            sum = sum * x + factor * c[n];
        }
        d[k] = sum / tgamma(k + 1.0);
    }
}

struct builder {
    struct override_program *p;
    uint32_t count;
    int64_t arc_q40;
    uint8_t bytes[OVERRIDE_PIECES][PROGRAM_PIECE_SIZE];
};

static void add_piece(struct builder *b, double v0, double v1, double ramp_s, double from_s,
                      double length_s)
{
    uint64_t duration = (uint64_t)(length_s * Q32 + 0.5);
    double d[8];
    double sum = 0;
    double h = (double)duration / Q32;
    uint8_t *at = b->bytes[b->count++];
    memset(at, 0, PROGRAM_PIECE_SIZE);
    ramp_derivatives(v0, v1, ramp_s, from_s, d);
    put(at, duration, 8);
    put(at + 8, (uint64_t)b->arc_q40, 8);
    for (int k = 1; k < 8; k++) {
        double c = nearbyint(ldexp(d[k], 40 + k * program_piece_exponent(duration)));
        put(at + 8 + 8 * k, (uint64_t)(int64_t)c, 8);
        sum += ldexp(c, -k * program_piece_exponent(duration)) * pow(h, k);
    }
    b->arc_q40 += (int64_t)nearbyint(sum);
    b->p->program.header.duration_q32_s += duration;
}

static void add_ramp(struct builder *b, double v0, double v1, double ramp_s, double shortest_s,
                     uint64_t *random)
{
    double from_s = 0;
    double most_s = 31.0 / (greater(v0, v1) + 1.0);
    while (ramp_s - from_s > 1e-9) {
        double length = shortest_s * exp(override_random(random, 0, 5));
        length = fmin(length, most_s);
        length = ramp_s - from_s - length < shortest_s ? ramp_s - from_s : length;
        length = length > most_s ? length / 2 : length;
        add_piece(b, v0, v1, ramp_s, from_s, length);
        from_s += length;
    }
}

static void set_line(struct override_program *p, int64_t length_q40)
{
    int64_t start = 0;
    int64_t step = (int64_t)(SEGMENT_MM * Q40);
    for (uint32_t i = 0; i < p->program.header.segment_count; i++) {
        uint8_t *at = p->image + PROGRAM_HEADER_SIZE + (size_t)i * PROGRAM_SEGMENT_SIZE;
        int64_t length = i + 1 < p->program.header.segment_count ? step : length_q40 - start;
        uint64_t u = (uint64_t)(sqrt((double)length / Q40) * 17592186044416.0 + 0.5);
        put(at, (uint64_t)start, 8);
        put(at + 8, (uint64_t)start, 8);
        for (int k = 0; k < 3; k++) {
            put(at + 24 + 16 * k, u, 8);
        }
        start += length;
    }
}

void override_program_random(struct override_program *p, uint32_t period_us, uint64_t *random)
{
    static struct builder b;
    double shortest_s = period_us * 1.05e-6;
    double v0 = 0;
    memset(p, 0, sizeof *p);
    memset(&b, 0, sizeof b);
    b.p = p;
    p->program.header.period_us = period_us;
    int ramps = 1 + (int)(golden_random(random) % 4u);
    for (int i = 0; i <= ramps; i++) {
        double v1 = i == ramps ? 0 : exp(override_random(random, 1.5, 5.5));
        add_ramp(&b, v0, v1, override_random(random, 30, 150) * shortest_s, shortest_s, random);
        add_ramp(&b, v1, v1, v1 == 0 ? 0 : override_random(random, 3, 300) * shortest_s, shortest_s,
                 random);
        v0 = v1;
    }
    struct program_header *header = &p->program.header;
    header->version = PROGRAM_VERSION;
    header->header_size = PROGRAM_HEADER_SIZE;
    header->axis_count = PROGRAM_PLANE;
    header->piece_count = b.count;
    header->length_q40_mm = b.arc_q40;
    header->segment_count = (uint32_t)((double)b.arc_q40 / Q40 / SEGMENT_MM) + 1u;
    p->program.size = header->image_size = PROGRAM_HEADER_SIZE +
                                           header->segment_count * PROGRAM_SEGMENT_SIZE +
                                           b.count * (PROGRAM_PIECE_SIZE + PROGRAM_STOP_SIZE);
    p->image = calloc(1, p->program.size);
    TEST_ASSERT_NOT_NULL(p->image);
    p->program.image = p->image;
    set_line(p, b.arc_q40);
    memcpy(piece_at(p, 0), b.bytes, (size_t)b.count * PROGRAM_PIECE_SIZE);
    read_pieces(p);
}

void override_program_image(struct override_program *p, uint8_t *image, uint32_t size)
{
    memset(p, 0, sizeof *p);
    p->image = image;
    TEST_ASSERT_EQUAL_INT(0, program_open(&p->program, p->image, size));
    read_pieces(p);
}

void override_program_golden(struct override_program *p, const char *name)
{
    uint32_t size = 0;
    uint8_t *image = golden_load(name, &size);
    TEST_ASSERT_NOT_NULL_MESSAGE(image, name);
    override_program_image(p, image, size);
}

void override_program_close(struct override_program *p)
{
    free(p->image);
    p->image = NULL;
}

int override_trace_add(struct override_trace *trace, int64_t arc_q40_mm, double h,
                       struct override_differences *out)
{
    double *arc = trace->arc_mm;
    memmove(arc, arc + 1, 3 * sizeof *arc);
    arc[3] = (double)arc_q40_mm / 1099511627776.0;
    if (++trace->known < 4) {
        return 0;
    }
    out->jerk = fabs(arc[3] - 3 * arc[2] + 3 * arc[1] - arc[0]) / (h * h * h);
    out->acceleration = fabs(arc[3] - 2 * arc[2] + arc[1]) / (h * h);
    out->back_mm = arc[2] - arc[3];
    return 1;
}

double override_distance_q40(struct interpolator *exact, const struct interpolator_point *point)
{
    struct interpolator_point right;
    while (interpolator_at_arc_length(exact, point->arc_length_q40_mm, &right) < 0) {
        TEST_ASSERT_TRUE(exact->segment->to_q40_mm != INT64_MAX);
        (void)interpolator_at_arc_length(exact, exact->segment->to_q40_mm, &right);
    }
    double sum = 0;
    for (uint32_t axis = 0; axis < exact->program->header.axis_count; axis++) {
        const double off = (double)(right.position_q40[axis] - point->position_q40[axis]);
        sum += off * off;
    }
    return sqrt(sum);
}
