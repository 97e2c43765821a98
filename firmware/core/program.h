/* SPDX-License-Identifier: MIT */
/*
 * program: reads the program image: its header, segments, feed pieces, stop table and events. Used by firmware/core,
 * firmware/app, sim/offline and host tools.
 *
 * The format is docs/reference/protocol.md section 1: little-endian scaled integers at any alignment. The image is
 * never copied; it must stay unchanged as long as a struct program or a struct interpolator refers to it.
 * `program_open` checks what is needed to read without leaving the image (sizes, counts, CRC); `program_check`
 * (core/program_check.h) checks everything else, and has to pass before a program is interpolated.
 *
 * No heap, no globals. Any context. Reads the image, changes only its arguments; no I/O.
 */
#ifndef HODOGRAPH_CORE_PROGRAM_H
#define HODOGRAPH_CORE_PROGRAM_H

#include <stdint.h>

#include "core/program_rules.h"

struct kernel; /* core/kernel.h */

#define PROGRAM_PLANE  2u /* path axes of a planar program: x, y */
#define PROGRAM_SPACE  3u /* at least, of a spatial one: x, y, z; those after z are extra axes */
#define PROGRAM_EXTRAS (PROGRAM_AXES - PROGRAM_SPACE)
#define PROGRAM_HEADER_SIZE          128u /* and 8 for each path axis after y */
#define PROGRAM_SEGMENT_SIZE         72u  /* of a planar program */
#define PROGRAM_SPACE_SIZE           104u /* of a segment of a spatial one, */
#define PROGRAM_EXTRA_SIZE           38u  /* and for each extra axis */
#define PROGRAM_PIECE_SIZE           88u
#define PROGRAM_STOP_SIZE            16u
#define PROGRAM_EVENT_SIZE           16u
#define PROGRAM_COMPACT_SEGMENT_SIZE 57u  /* of a compact planar program, */
#define PROGRAM_COMPACT_SPACE_SIZE   100u /* of a compact spatial one, */
#define PROGRAM_COMPACT_EXTRA_SIZE   37u  /* and for each extra axis */
#define PROGRAM_COMPACT_PIECE_SIZE   69u
#define PROGRAM_COMPACT_STOP_SIZE    12u
#define PROGRAM_VERSION              2u
#define PROGRAM_FLAG_CLOSED          1u
#define PROGRAM_FLAG_MOVING          2u  /* begins in motion: only in a chunk (core/chunk.h) */
#define PROGRAM_FLAG_COMPACT         4u  /* its records have fewer bytes: only in a chunk */
#define PROGRAM_DIGITALS             16u /* outputs that events can switch: digital ones, */
#define PROGRAM_ANALOGUES            3u  /* and analogue ones, so that all fit in one PDO */
#define PROGRAM_EVENTS_A_TICK        16u /* the most that a tick can pass */

/* Header of the image, protocol.md 1.1; field names carry the units. */
struct program_header {
    uint16_t version;
    uint16_t header_size;
    uint32_t image_size;
    uint32_t crc32;
    uint32_t period_us;
    uint32_t segment_count;
    uint32_t piece_count;
    uint16_t flags;      /* PROGRAM_FLAG_... */
    uint16_t axis_count; /* PROGRAM_PLANE ... PROGRAM_AXES */
    uint32_t event_count;
    uint64_t duration_q32_s;
    int64_t length_q40_mm;
    /* work offset, for information: already contained in the coordinates; 0 beyond axis_count */
    int64_t offset_q40_mm[PROGRAM_AXES];
    uint32_t feed_limit_um_s;
    uint32_t acceleration_limit_um_s2;
    uint32_t jerk_limit_mm_s3;
    char name[33];          /* UTF-8, always terminated */
    uint32_t hold_worst_us; /* longest stop of each kind, and the longest distance of one */
    uint32_t hold_worst_um;
    uint32_t fault_worst_us;
    uint32_t fault_worst_um;
};

/* Components of the preimage A = u + v i + p j + q k, whose hodograph is A i A*. That of a planar program has u and q
 * only: w = u + iq. */
enum program_component { PROGRAM_U, PROGRAM_V, PROGRAM_P, PROGRAM_Q };
#define PROGRAM_COMPONENTS 4u

/* An extra axis along a segment: a quintic in the parameter of the curve, in mm or degrees. */
struct program_extra {
    int64_t start_q40;
    int64_t b_q40[5]; /* Bezier coefficients 1 ... 5, from the start; number 0 is 0 */
};

/* A PH segment, protocol.md 1.2. The preimage is in Bernstein form, mm^(1/2). */
struct program_segment {
    int64_t start_q40_mm;                /* arc length at its start */
    int64_t point_q40_mm[PROGRAM_SPACE]; /* start point; z is 0 in a planar program */
    /* by enum program_component; v and p are 0 in a planar program */
    int64_t a_q44[PROGRAM_COMPONENTS][3];
    struct program_extra extra[PROGRAM_EXTRAS]; /* the first axis_count - 3 */
    uint32_t axis_count;                        /* of the program */
};

/* Components of the preimage of a program are 0, `step`, ... below PROGRAM_COMPONENTS: u and q, or all. */
static inline uint32_t program_component_step(uint32_t axis_count)
{
    return axis_count > PROGRAM_PLANE ? 1u : (uint32_t)PROGRAM_Q;
}

static inline uint32_t program_extra_axes(uint32_t axis_count)
{
    return axis_count > PROGRAM_SPACE ? axis_count - PROGRAM_SPACE : 0u;
}

/* Coordinates of the curve itself: x, y, or x, y, z. */
static inline uint32_t program_curve_axes(uint32_t axis_count)
{
    return axis_count > PROGRAM_PLANE ? PROGRAM_SPACE : PROGRAM_PLANE;
}

#define PROGRAM_LEVELS     7u /* of the override bounds: overrides up to which they hold */
#define PROGRAM_LEVEL_FULL (PROGRAM_LEVELS - 1u) /* the factor */

/* Override bounds, protocol.md 1.3: program_number of a code is the greatest override rate in 2^-32 /s, and the
 * greatest override acceleration in 2^-24 /s^2, as long as the override is at most that of the level. */
struct program_override {
    uint16_t factor_q14;
    uint8_t rate[PROGRAM_LEVELS];
    uint8_t second[PROGRAM_LEVELS];
};

/* A feed piece, protocol.md 1.3: F = start + sum of c[k-1] tau^k, tau = t / 2^e. */
struct program_piece {
    uint64_t duration_q32_s;
    int64_t start_q40_mm;
    int64_t c_q40_mm[7];
    uint32_t override_factor_q24;
    uint32_t override_rate_q16_per_s; /* of the full level, rounded down */
    uint32_t override_second_q8_per_s2;
    struct program_override override; /* the same, and those of the other levels */
};

enum program_stop_kind {
    PROGRAM_STOP_HOLD = 0,  /* feed hold and stop: inside the program's limits */
    PROGRAM_STOP_FAULT = 1, /* fault stop: inside the machine's */
};

/* Stop parameters of a piece, protocol.md 1.4: codes, decoded by core/path_brake. All of them 0: no path stop may begin
 * in this piece. */
struct program_stop {
    uint8_t jerk_down;
    uint8_t deceleration;
    uint8_t jerk_up;
    uint16_t reserved;
    uint32_t bound_us; /* stop time bound: from a command in this piece to standstill */
};

/* What an event does, protocol.md 1.8. */
enum program_event_kind {
    PROGRAM_EVENT_DIGITAL = 1,
    PROGRAM_EVENT_ANALOGUE = 2,
    PROGRAM_EVENT_PROPORTIONAL = 3,
};

/* An event on the path: outputs that switch at an arc length. */
struct program_event {
    int64_t place_q40_mm;
    uint8_t kind;    /* enum program_event_kind, of an image that passed program_check */
    uint8_t channel; /* of an analogue output; 0 for digital ones */
    uint16_t mask;   /* digital: the outputs that change; else 0 */
    /* digital: their levels; analogue: the value; proportional: q16, for each mm/s */
    int32_t value;
};

struct program {
    const uint8_t *image;
    uint32_t size;
    struct program_header header;
    const uint8_t *coefficients;           /* records of core/coefficients.h, if there are any, */
    const struct kernel *coefficients_for; /* for this kernel; else NULL */
};

/* Opens an image of `size` bytes: magic, version, axis count, header size, counts against the size, CRC. The
 * buffer may be longer than the size in the header (a fixed store); never shorter. Cost: the CRC, linear in
 * the size. Returns 0 or a negative PROGRAM_ERR_... of core/program_rules.h; *p is then not usable.
 */
int program_open(struct program *p, const uint8_t *image, uint32_t size);

/* Bytes of the header, and of each segment, of a program with so many path axes. */
uint32_t program_header_size(uint32_t axis_count);
uint32_t program_segment_size(uint32_t axis_count);
/* The same of a segment with PROGRAM_FLAG_COMPACT. */
uint32_t program_compact_segment_size(uint32_t axis_count);

/* Reads segment or piece number i; i must be below the count of the header. Constant time. */
void program_segment_get(const struct program *p, uint32_t i, struct program_segment *out);
void program_piece_get(const struct program *p, uint32_t i, struct program_piece *out);

/* The stop of a kind that is requested in piece i, which must be below the count. Constant time. */
void program_stop_get(const struct program *p, uint32_t i, enum program_stop_kind kind,
                      struct program_stop *out);

/* Event number i, which must be below the count. Constant time. */
void program_event_get(const struct program *p, uint32_t i, struct program_event *out);
int64_t program_event_place(const struct program *p, uint32_t i);

/* Number of the first event at or past an arc length; the count of events if there is none. At most some 32 steps. */
uint32_t program_first_event_from(const struct program *p, int64_t arc_length_q40_mm);

/* Cheaper than reading the whole record: the start (arc length) of a segment, the duration and the start of a piece. */
int64_t program_segment_start(const struct program *p, uint32_t i);
uint64_t program_piece_duration(const struct program *p, uint32_t i);
int64_t program_piece_start(const struct program *p, uint32_t i);

/* Whether segment or piece i of program a equals number k of program b in all but the arc length of its start. Both
 * have the same number of path axes; one may be compact and the other not. */
int program_segment_alike(const struct program *a, uint32_t i, const struct program *b, uint32_t k);
int program_piece_alike(const struct program *a, uint32_t i, const struct program *b, uint32_t k);

/* Only its override bounds. */
void program_piece_override(const struct program *p, uint32_t i, struct program_override *out);

/* The number below 2^48 that a code of 8 bits stands for (protocol.md 1.4), also code 0: 2^16, in steps of an eighth of
 * an octave. */
uint64_t program_number(uint8_t code);

/* Override of a level below the full one, in 2^-9. */
static inline uint32_t program_level_q9(uint32_t level)
{
    static const uint16_t overrides_q9[PROGRAM_LEVEL_FULL] = {320, 448, 488, 504, 509, 511};
    return overrides_q9[level];
}

/* Setpoints of the program: ceil(duration / period) + 1, with the period of the header. Needs a
 * program that passed program_check. */
uint32_t program_ticks(const struct program *p);

/* Time scale of a piece: the smallest e with 2^e s not below the duration; -32 ... 31 (above: 31). A duration of 0
 * gives -32. */
int program_piece_exponent(uint64_t duration_q32_s);

#endif
