/* SPDX-License-Identifier: MIT */
/*
 * Fuzz harness of core/program_check.h: a program image, a golden one with changes, or any bytes, always with the CRC
 * that it should have. What program_check accepts for axes with limits runs to its end, or to the end of a stop, under
 * holds, resumes, overrides and stops at any tick. The setpoints keep the limits of each axis at every tick and stay
 * within travel.
 *
 * Input: which image, 6 bytes of limits, commands (16 pairs: ticks to wait, command), then changes.
 *
 * Run by `make fuzz` with libFuzzer, and on its corpus by `make test` and `make unit` (replay.c). Reads files of
 * tests/data; no other I/O, except that a broken rule is printed and aborts the process.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/feed_override.h"
#include "core/interpolator.h"
#include "core/program_check.h"
#include "fuzz.h"
#include "golden.h"

#define SEEDS     9u
#define RAW       255u /* no seed: the bytes themselves */
#define IMAGE_MAX 16384u
#define TICKS_MAX 1500u
#define COMMANDS  16u
#define TRAVEL_MM 300
#define AXES_AT   30u  /* in the header */
#define NOISE_MM  1e-9 /* of the double kernel, docs/theory/numerics.md section 10 */
#define Q40       1099511627776.0

/* In the plane, with events, in space, with six axes. */
static const char *const seed_names[SEEDS] = {
    "line.hdgp",          "line_tiny.hdgp",     "line_slow.hdgp",
    "alpha_minimax.hdgp", "alpha_quintic.hdgp", "star_minimax.hdgp",
    "alpha_events.hdgp",  "space3.hdgp",        "space6.hdgp"};

/* --- Program time: all that this harness knows of holds and overrides --- */

enum time_command { TIME_HOLD, TIME_RESUME, TIME_STOP, TIME_OVERRIDE };

struct program_run {
    struct feed_override feed;
    struct interpolator interp;
};

static void run_begin(struct program_run *run, const struct program *p)
{
    feed_override_begin(&run->feed, p, p->header.period_us, 0);
    FUZZ_CHECK(interpolator_begin(&run->interp, p) == 0);
}

static void run_command(struct program_run *run, enum time_command command, uint32_t percent)
{
    switch (command) {
    case TIME_HOLD:
        feed_override_hold(&run->feed);
        break;
    case TIME_RESUME:
        feed_override_resume(&run->feed);
        break;
    case TIME_STOP:
        feed_override_stop(&run->feed);
        break;
    default:
        feed_override_set(&run->feed, percent);
        break;
    }
}

static void run_step(struct program_run *run, struct interpolator_point *point)
{
    FUZZ_CHECK(feed_override_next(&run->feed, &run->interp, point) >= 0);
}

static bool run_over(const struct program_run *run)
{
    const enum feed_state state = feed_override_state(&run->feed);
    return state == FEED_ENDED || state == FEED_STOPPED;
}

/* --- The image --- */

struct image {
    uint8_t bytes[IMAGE_MAX];
    uint32_t size;
};

static void load_seed(struct image *image, unsigned seed)
{
    static uint8_t *loaded[SEEDS];
    static uint32_t sizes[SEEDS];
    if (loaded[seed] == NULL) {
        loaded[seed] = golden_load(seed_names[seed], &sizes[seed]);
        FUZZ_CHECK(loaded[seed] != NULL && sizes[seed] <= IMAGE_MAX);
    }
    image->size = sizes[seed];
    memcpy(image->bytes, loaded[seed], image->size);
}

static uint64_t get(const struct image *image, uint32_t at, uint32_t bytes)
{
    uint64_t value = 0;
    for (uint32_t i = 0; i < bytes && at + i < image->size; ++i) {
        value |= (uint64_t)image->bytes[(at + i) % IMAGE_MAX] << (8u * i);
    }
    return value;
}

static void put(struct image *image, uint32_t at, uint64_t value, uint32_t bytes)
{
    for (uint32_t i = 0; i < bytes && at + i < image->size; ++i) {
        image->bytes[(at + i) % IMAGE_MAX] = (uint8_t)(value >> (8u * i));
    }
}

/* Any number may be there. */
static uint32_t axes_of(const struct image *image)
{
    const uint32_t axes = (uint32_t)get(image, AXES_AT, 2);
    return axes < 2u ? 2u : axes > PROGRAM_AXES ? PROGRAM_AXES : axes;
}

static uint32_t segment_at(const struct image *image, uint32_t i)
{
    const uint32_t axes = axes_of(image);
    return program_header_size(axes) + program_segment_size(axes) * i;
}

static uint32_t piece_at(const struct image *image, uint32_t i)
{
    return segment_at(image, (uint32_t)get(image, 20, 2)) + PROGRAM_PIECE_SIZE * i;
}

/* Changes that keep a program whole: it is moved, mirrored (in the plane), or all of its time is doubled or halved. */
static void move_path(struct image *image, uint32_t axis, uint64_t by)
{
    const uint32_t count = (uint32_t)get(image, 20, 2);
    for (uint32_t i = 0; i < count; ++i) {
        const uint32_t at = segment_at(image, i) + 8u + 8u * axis;
        put(image, at, get(image, at, 8) + by, 8);
    }
}

static void mirror_path(struct image *image)
{
    const uint32_t count = (uint32_t)get(image, 20, 2);
    for (uint32_t i = 0; i < count; ++i) {
        const uint32_t at = segment_at(image, i);
        put(image, at + 16u, UINT64_C(0) - get(image, at + 16u, 8), 8);
        for (uint32_t k = 0; k < 3u; ++k) {
            put(image, at + 48u + 8u * k, UINT64_C(0) - get(image, at + 48u + 8u * k, 8), 8);
        }
    }
}

static void scale_time(struct image *image, bool slower)
{
    const uint32_t count = (uint32_t)get(image, 24, 2);
    uint64_t sum = 0;
    for (uint32_t i = 0; i < count; ++i) {
        const uint32_t at = piece_at(image, i);
        const uint64_t duration = slower ? get(image, at, 8) << 1 : get(image, at, 8) >> 1;
        put(image, at, duration, 8);
        sum += duration;
    }
    put(image, 32, sum, 8);
}

/* The bounds of the override: of one piece, or of all. */
static void change_bounds(struct image *image, struct fuzz_input *in)
{
    const uint32_t count = (uint32_t)get(image, 24, 2);
    const uint32_t which = fuzz_byte(in);
    const uint32_t field = fuzz_byte(in);
    const uint32_t value = fuzz_number(in, 4);
    for (uint32_t i = 0; i < count; ++i) {
        if (which == 255u || which == i) {
            put(image, piece_at(image, i) + 72u + 4u * (field % 3u), value, 4);
        }
    }
}

static void change_field(struct image *image, struct fuzz_input *in, unsigned kind)
{
    static const uint64_t extremes[] = {0, UINT64_MAX, UINT64_C(1) << 63, UINT64_MAX >> 1,
                                        UINT64_C(1) << 62};
    const uint32_t at = fuzz_number(in, 2) % (image->size + 1u);
    const uint8_t value = fuzz_byte(in);
    const uint32_t field = at & ~7u;
    switch (kind) {
    case 0:
        put(image, at, value, 1);
        break;
    case 1:
        put(image, at, get(image, at, 1) ^ (1u << (value & 7u)), 1);
        break;
    case 2:
        put(image, field, extremes[value % 5u], 8);
        break;
    default:
        put(image, field, get(image, field, 8) + value - 128u, 8);
        break;
    }
}

static void change(struct image *image, struct fuzz_input *in)
{
    const uint8_t what = fuzz_byte(in);
    switch (what % 16u) {
    case 0:
        move_path(image, 0, fuzz_wide(in));
        break;
    case 1:
        move_path(image, 1, fuzz_wide(in));
        break;
    case 2:
        mirror_path(image);
        break;
    case 3:
    case 4:
        scale_time(image, what % 16u == 3u);
        break;
    case 5:
    case 6:
    case 7:
        change_bounds(image, in);
        break;
    case 8:
        put(image, 16, UINT64_C(1000) << (fuzz_byte(in) & 3u), 4); /* the period */
        break;
    case 9:
        image->size = fuzz_number(in, 2) % (image->size + 1u);
        break;
    default:
        change_field(image, in, what % 4u);
        break;
    }
}

static void make_image(struct image *image, struct fuzz_input *in, uint8_t kind)
{
    if (kind == RAW) {
        image->size = 0;
        while (fuzz_left(in) && image->size < IMAGE_MAX) {
            image->bytes[image->size++] = fuzz_byte(in);
        }
        return;
    }
    load_seed(image, kind % SEEDS);
    while (fuzz_left(in)) {
        change(image, in);
    }
}

/* --- Limits --- */

static struct program_limits no_axis_limits(void)
{
    struct program_limits limits = golden_no_limits();
    for (uint32_t axis = 0; axis < PROGRAM_AXES; axis++) {
        limits.min_q40_mm[axis] = -((int64_t)TRAVEL_MM << 40);
        limits.max_q40_mm[axis] = (int64_t)TRAVEL_MM << 40;
    }
    return limits;
}

/* Positions of the last four ticks, the newest first; before the program and after it the axes stand. */
struct trail {
    double mm[4][PROGRAM_AXES];
    double period_s;
    uint32_t axes;
};

static void trail_push(struct trail *trail, const struct interpolator_point *point)
{
    memmove(trail->mm[1], trail->mm[0], 3 * sizeof trail->mm[0]);
    for (uint32_t axis = 0; axis < trail->axes; axis++) {
        trail->mm[0][axis] = (double)point->position_q40[axis] / Q40;
    }
}

static void trail_begin(struct trail *trail, const struct program *p)
{
    static struct interpolator it;
    struct interpolator_point point = {0};
    FUZZ_CHECK(interpolator_begin(&it, p) == 0 && interpolator_at_q42(&it, 0, &point) >= 0);
    memset(trail, 0, sizeof *trail);
    trail->axes = p->header.axis_count;
    trail->period_s = 1e-6 * p->header.period_us;
    for (int i = 0; i < 4; i++) {
        trail_push(trail, &point);
    }
}

/* What a drive sees: differences over period, its square and its cube. */
static void trail_rates(const struct trail *trail, uint32_t axis, double rate[3])
{
    const double (*mm)[PROGRAM_AXES] = trail->mm;
    const double one = mm[0][axis] - mm[1][axis];
    const double two = one - (mm[1][axis] - mm[2][axis]);
    const double three = two - (mm[1][axis] - 2.0 * mm[2][axis] + mm[3][axis]);
    rate[0] = fabs(one) / trail->period_s;
    rate[1] = fabs(two) / pow(trail->period_s, 2.0);
    rate[2] = fabs(three) / pow(trail->period_s, 3.0);
}

static double greater(double a, double b)
{
    return a > b ? a : b;
}

/* At rate 1, up to TICKS_MAX. */
static void find_peaks(const struct program *p, double peak[PROGRAM_AXES][3])
{
    static struct interpolator it;
    struct trail trail;
    struct interpolator_point point = {0};
    const uint64_t period = ((uint64_t)p->header.period_us << 42) / 1000000u;
    trail_begin(&trail, p);
    FUZZ_CHECK(interpolator_begin(&it, p) == 0);
    int result = INTERPOLATOR_OK;
    for (uint32_t k = 0; k < TICKS_MAX && result == INTERPOLATOR_OK; ++k) {
        result = interpolator_at_q42(&it, k * period, &point);
        FUZZ_CHECK(result >= 0);
        trail_push(&trail, &point);
        for (uint32_t axis = 0; axis < trail.axes; axis++) {
            double rate[3];
            trail_rates(&trail, axis, rate);
            for (int i = 0; i < 3; i++) {
                peak[axis][i] = greater(peak[axis][i], rate[i]);
            }
        }
    }
}

/* From a little less than what the program needs at rate 1 to some ten times of it. */
static uint32_t limit_of(double peak, double unit, uint8_t scale)
{
    const double limit = 0.95 * (peak * unit + 1.0) * pow(1.01, scale);
    return limit < 4e9 ? (uint32_t)limit + 1u : 4000000000u;
}

/* The axes after y take the scales of x and y again. */
static void set_limits(struct program_limits *limits, const struct program *p,
                       const uint8_t scale[6])
{
    double peak[PROGRAM_AXES][3] = {{0}};
    find_peaks(p, peak);
    for (uint32_t axis = 0; axis < p->header.axis_count; axis++) {
        const uint8_t *by = scale + 3u * (axis % 2u);
        limits->axis_velocity_um_s[axis] = limit_of(peak[axis][0], 1000.0, by[0]);
        limits->axis_acceleration_um_s2[axis] = limit_of(peak[axis][1], 1000.0, by[1]);
        limits->axis_jerk_mm_s3[axis] = limit_of(peak[axis][2], 1.0, by[2]);
    }
}

/* Steps at joints may use 0.5 % of a limit (docs/guides/limits.md); a difference is a mean. */
static void keeps_limits(const struct trail *trail, const struct program_limits *limits)
{
    for (uint32_t axis = 0; axis < trail->axes; axis++) {
        double rate[3];
        const double noise = NOISE_MM / trail->period_s;
        const int64_t at_q40 = (int64_t)(trail->mm[0][axis] * Q40);
        trail_rates(trail, axis, rate);
        FUZZ_CHECK(rate[0] <= 1e-3 * limits->axis_velocity_um_s[axis] * 1.00001 + noise);
        FUZZ_CHECK(rate[1] <= 1e-3 * limits->axis_acceleration_um_s2[axis] * 1.01 +
                                  2.0 * noise / trail->period_s);
        FUZZ_CHECK(rate[2] <=
                   limits->axis_jerk_mm_s3[axis] * 1.02 + 4.0 * noise / pow(trail->period_s, 2.0));
        FUZZ_CHECK(at_q40 >= limits->min_q40_mm[axis] - (1 << 22));
        FUZZ_CHECK(at_q40 <= limits->max_q40_mm[axis] + (1 << 22));
    }
}

/* --- The run --- */

struct commands {
    uint8_t wait[COMMANDS];
    uint8_t what[COMMANDS];
    unsigned at;
    unsigned waited;
};

static void give_commands(struct commands *commands, struct program_run *run)
{
    while (commands->at < COMMANDS && commands->waited >= commands->wait[commands->at]) {
        const uint8_t what = commands->what[commands->at];
        const enum time_command command = what < 8u    ? TIME_STOP
                                          : what < 28u ? TIME_HOLD
                                          : what < 48u ? TIME_RESUME
                                                       : TIME_OVERRIDE;
        run_command(run, command, what - 48u);
        commands->at++;
        commands->waited = 0;
    }
    commands->waited++;
}

static void run_accepted(const struct program *p, const struct program_limits *limits,
                         struct commands *commands)
{
    static struct program_run run;
    struct trail trail;
    run_begin(&run, p);
    trail_begin(&trail, p);
    unsigned behind = 0;
    for (uint32_t k = 0; k < TICKS_MAX && behind < 4u; ++k) {
        struct interpolator_point point = {0};
        give_commands(commands, &run);
        run_step(&run, &point);
        trail_push(&trail, &point);
        keeps_limits(&trail, limits);
        behind += run_over(&run) ? 1u : 0u;
    }
}

static void harness(struct fuzz_input *in)
{
    static struct image image;
    struct program p;
    struct program_fault fault;
    struct program_limits limits = no_axis_limits();
    struct commands commands = {.at = 0, .waited = 0};
    uint8_t scale[6];
    const uint8_t kind = fuzz_byte(in);
    fuzz_bytes(in, scale, sizeof scale);
    for (unsigned i = 0; i < COMMANDS; ++i) {
        commands.wait[i] = fuzz_byte(in);
        commands.what[i] = fuzz_byte(in);
    }
    make_image(&image, in, kind);
    golden_seal(image.bytes, image.size);
    uint8_t *exact = malloc(image.size + 1u); /* so that the sanitizer sees any read beyond */
    FUZZ_CHECK(exact != NULL);
    memcpy(exact, image.bytes, image.size);
    if (program_open(&p, exact, image.size) == 0 && program_check(&p, &limits, &fault) == 0) {
        struct golden_precomputed precomputed;
        golden_precompute(&precomputed, &p, KERNEL_DOUBLE);
        set_limits(&limits, &precomputed.program, scale);
        if (program_check(&p, &limits, &fault) == 0) {
            run_accepted(&precomputed.program, &limits, &commands);
        }
        golden_discard(&precomputed);
    }
    free(exact);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    return fuzz_run(harness, data, size);
}
