/* SPDX-License-Identifier: MIT */
/* Implements core/program_check.h (see there): all checks of a program before it may run, and the texts of refusals.
 * Used by app/program_slot, core/chunk and host tools. Main loop, never an interrupt. Reads the image, and changes only
 * the reported fault; no I/O. */
#include "core/program_check.h"

#include "core/event_check.h"
#include "core/first_axis.h"
#include "core/limit_check.h"
#include "core/piece_check.h"
#include "core/segment_check.h"
#include "core/segment_length_check.h"
#include "core/stop_check.h"

#define NAME_FROM 80u /* offset of the name in the header */
#define NAME_SIZE 32u /* bytes */
/* flags that only the program of a chunk may have */
#define FLAGS_IN_CHUNK (PROGRAM_FLAG_MOVING | PROGRAM_FLAG_COMPACT)

static int bytes_are_zero(const uint8_t *b, uint32_t size)
{
    for (uint32_t i = 0; i < size; i++) {
        if (b[i] != 0) {
            return 0;
        }
    }
    return 1;
}

static int name_is_padded(const uint8_t *name)
{
    uint32_t i = 0;
    while (i < NAME_SIZE && name[i] != 0) {
        i++;
    }
    return bytes_are_zero(name + i, NAME_SIZE - i);
}

static int check_period(uint32_t period_us, uint32_t configured_us)
{
    if (period_us != 1000 && period_us != 2000 && period_us != 4000 && period_us != 8000) {
        return PROGRAM_ERR_PERIOD;
    }
    return configured_us == 0 || configured_us == period_us ? 0 : PROGRAM_ERR_PERIOD_USED;
}

static int check_header(const struct program *p, const struct program_limits *limits)
{
    const struct program_header *h = &p->header;
    int code = check_period(h->period_us, limits->period_us);
    if (code != 0) {
        return code;
    }
    const uint32_t flags =
        PROGRAM_FLAG_CLOSED | FIRST_AXIS_FLAGS | (limits->chunk != 0 ? FLAGS_IN_CHUNK : 0u);
    if ((h->flags & ~flags) != 0) {
        return PROGRAM_ERR_FLAGS;
    }
    const uint32_t axes = limits->axis_count;
    if (first_axis_end(h) > PROGRAM_AXES ||
        (axes != 0 && (axes != h->axis_count || first_axis(h) != 0))) {
        return PROGRAM_ERR_AXES;
    }
    if (h->length_q40_mm <= 0 || h->length_q40_mm >= (int64_t)1 << 62) {
        return PROGRAM_ERR_LENGTH;
    }
    return name_is_padded(p->image + NAME_FROM) ? 0 : PROGRAM_ERR_NAME;
}

int program_check(const struct program *p, const struct program_limits *limits,
                  struct program_fault *fault)
{
    fault->index = 0;
    fault->code = check_header(p, limits);
    if (fault->code == 0) {
        fault->code = segment_check_all(p, limits, &fault->index);
    }
    if (fault->code == 0) {
        fault->code = piece_check_all(p, limits, &fault->index);
    }
    if (fault->code == 0) {
        fault->code = segment_length_check_all(p, &fault->index);
    }
    if (fault->code == 0) {
        fault->code = limit_check_all(p, limits, &fault->index);
    }
    if (fault->code == 0) {
        fault->code = stop_check_all(p, limits, &fault->index);
    }
    if (fault->code == 0) {
        fault->code = event_check_all(p, &fault->index);
    }
    return fault->code;
}

/* --- Texts of the codes --- */

struct text {
    int code;
    const char *text;
};

static const struct text texts[] = {
    {0, "no error"},
    {PROGRAM_ERR_SIZE, "truncated, or sizes and counts do not fit each other"},
    {PROGRAM_ERR_MAGIC, "does not begin with 'HDGP'"},
    {PROGRAM_ERR_VERSION, "version or header size unknown"},
    {PROGRAM_ERR_CRC, "CRC-32 of the contents is wrong"},
    {PROGRAM_ERR_COUNT, "no segment or no piece"},
    {PROGRAM_ERR_STORE, "the program store did not keep it"},
    {PROGRAM_ERR_ROOM, "with its precomputed coefficients too large for the program store"},
    {PROGRAM_ERR_KERNEL, "the controller does not have the kernel configured"},
    {PROGRAM_ERR_PERIOD, "period not 1000, 2000, 4000 or 8000 us"},
    {PROGRAM_ERR_PERIOD_USED, "period is not the one configured in the controller"},
    {PROGRAM_ERR_FLAGS, "unknown flag, or one that only a chunk may have"},
    {PROGRAM_ERR_AXES, "axis count not 2 ... 6, or not that of the machine"},
    {PROGRAM_ERR_DURATION, "not the sum of the pieces, or not below 2^22 s"},
    {PROGRAM_ERR_LENGTH, "length not in (0, 2^22) mm"},
    {PROGRAM_ERR_NAME, "name not padded with zeros"},
    {PROGRAM_ERR_W_RANGE, "|u| or |v| is 64 or more"},
    {PROGRAM_ERR_POINT_RANGE, "coordinate is 4096 mm or more"},
    {PROGRAM_ERR_ARC_RANGE, "arc length is negative or 2^22 mm or more"},
    {PROGRAM_ERR_SIGMA, "a Bernstein coefficient of the parametric speed is not positive"},
    {PROGRAM_ERR_SIGMA_RATIO, "the largest is more than twice the smallest"},
    {PROGRAM_ERR_SEGMENT_LONG, "longer than 32 mm"},
    {PROGRAM_ERR_SEGMENT_FIRST, "the first segment does not start at arc length 0"},
    {PROGRAM_ERR_JOIN_POINT, "points differ by more than 2^-34 mm"},
    {PROGRAM_ERR_JOIN_ARC, "arc lengths differ by more than 2^-34 mm"},
    {PROGRAM_ERR_JOIN_DIRECTION, "directions differ by more than 2^-20 rad"},
    {PROGRAM_ERR_SEGMENT_END, "the last segment does not end at the length of the header"},
    {PROGRAM_ERR_NOT_CLOSED, "flag 'closed', but end and start are more than 2^-24 mm apart"},
    {PROGRAM_ERR_SEGMENT_SHORT, "a tick at 200 % could cross more than two segment ends"},
    {PROGRAM_ERR_TRAVEL, "leaves the travel limits"},
    {PROGRAM_ERR_PIECE_DURATION, "duration 0, or above 2^22 s"},
    {PROGRAM_ERR_COEFFICIENT, "a coefficient is above 2^14 mm"},
    {PROGRAM_ERR_PIECE_LONG, "longer than 32 mm"},
    {PROGRAM_ERR_PIECE_FIRST, "the first piece does not start at arc length 0"},
    {PROGRAM_ERR_JOIN_LENGTH, "F differs by more than 2^-34 mm"},
    {PROGRAM_ERR_JOIN_FEED, "F' differs by more than 2^-16 mm/s"},
    {PROGRAM_ERR_JOIN_ACCELERATION, "F'' differs by more than 2^-6 mm/s^2"},
    {PROGRAM_ERR_START_MOVING, "the program does not begin at rest"},
    {PROGRAM_ERR_END_MOVING, "the program does not end at rest"},
    {PROGRAM_ERR_PIECE_END, "the last piece does not end at the length of the header"},
    {PROGRAM_ERR_PIECE_SHORT, "two adjacent pieces last two periods or less"},
    {PROGRAM_ERR_BACKWARDS, "feed below -2^-10 mm/s"},
    {PROGRAM_ERR_FEED, "above the feed limit of the controller"},
    {PROGRAM_ERR_ACCELERATION, "above its acceleration limit"},
    {PROGRAM_ERR_JERK, "above its jerk limit"},
    {PROGRAM_ERR_OVERRIDE, "override factor not in 1.0 ... 2.0, or an override bound is 0"},
    {PROGRAM_ERR_STOP_ENTRY,
     "some codes of a stop are 0 and some are not, or a reserved field is not 0"},
    {PROGRAM_ERR_STOP_NUMBERS, "a path stop would be above the limits of the controller"},
    {PROGRAM_ERR_STOP_BOUND, "a stop can take longer than its bound"},
    {PROGRAM_ERR_STOP_LONG, "a fault stop can take longer than the controller allows"},
    {PROGRAM_ERR_STOP_WORST, "the worst stops of the header are not those of the table"},
    {PROGRAM_ERR_EVENT_KIND, "kind or channel of an event is unknown"},
    {PROGRAM_ERR_EVENT_VALUE,
     "an event changes outputs outside its mask, or its value is too large"},
    {PROGRAM_ERR_EVENT_PLACE, "an event is before the one before it, or not on the path"},
    {PROGRAM_ERR_EVENT_DENSE, "a tick at 200 % could pass more than 16 events"},
    {PROGRAM_ERR_CHUNK_FORMAT,
     "chunk: wrong magic, version, size or flag, or a reserved field is not 0"},
    {PROGRAM_ERR_CHUNK_CRC, "chunk: CRC-32 is wrong"},
    {PROGRAM_ERR_CHUNK_JOB, "chunk: of another job, or job 0"},
    {PROGRAM_ERR_CHUNK_SEQUENCE, "chunk: sequence number is not the next one"},
    {PROGRAM_ERR_CHUNK_FIRST, "chunk: its flag 'first' contradicts its predecessor or its start"},
    {PROGRAM_ERR_CHUNK_PROGRAM,
     "chunk: period, axis count or first axis is not that of its predecessor"},
    {PROGRAM_ERR_CHUNK_SHARED, "chunk: shifts or shared counts do not fit its predecessor"},
    {PROGRAM_ERR_CHUNK_SEGMENT, "chunk: a shared segment is not that of its predecessor"},
    {PROGRAM_ERR_CHUNK_PIECE, "chunk: a shared piece is not that of its predecessor"},
    {PROGRAM_ERR_CHUNK_OVER,
     "chunk: of a job that is over, or checked under another configuration"},
    {PROGRAM_ERR_CHUNK_REST, "chunk: does not begin at rest where its predecessor ends"},
    {PROGRAM_ERR_CHUNK_EVENT, "chunk: events of the shared part are not those of its predecessor"},
    {PROGRAM_ERR_AXIS_VELOCITY, "above the velocity limit of an axis"},
    {PROGRAM_ERR_AXIS_ACCELERATION, "above the acceleration limit of an axis"},
    {PROGRAM_ERR_AXIS_JERK, "above the jerk limit of an axis"},
    {PROGRAM_ERR_AXIS_STEP, "velocity or acceleration of an axis jumps at a joint"},
};

const char *program_error_text(int code)
{
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        if (texts[i].code == code) {
            return texts[i].text;
        }
    }
    return "unknown error";
}
