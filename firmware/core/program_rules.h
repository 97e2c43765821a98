/* SPDX-License-Identifier: MIT */
/*
 * program_rules: what all parts of the program check share: the codes with which a program is refused (enum
 * program_error), the limits of the controller (struct program_limits), and the place of a fault (struct
 * program_fault). core/program_check.h checks a whole program. Used by firmware/core, firmware/app, sim/offline and
 * host tools. Plain data, any context; program_limits_attend: in the check, main loop.
 */
#ifndef HODOGRAPH_CORE_PROGRAM_RULES_H
#define HODOGRAPH_CORE_PROGRAM_RULES_H

#include <stddef.h>
#include <stdint.h>

#define PROGRAM_AXES 6u /* greatest number of path axes of a program */

/* Refusals. The numbers are part of the protocol (object 0x2000 sub 3): never renumber. */
enum program_error {
    /* found by program_open, which also finds PROGRAM_ERR_AXES */
    PROGRAM_ERR_SIZE = -1,    /* truncated, or sizes and counts do not fit each other */
    PROGRAM_ERR_MAGIC = -2,   /* does not begin with "HDGP" */
    PROGRAM_ERR_VERSION = -3, /* version or header size unknown */
    PROGRAM_ERR_CRC = -4,     /* CRC-32 of the contents is wrong */
    PROGRAM_ERR_COUNT = -5,   /* no segment or no piece */
    PROGRAM_ERR_STORE = -6,   /* the program store did not keep it (app/program_slot) */
    /* image and coefficient cache do not fit the store (app/program_table) */
    PROGRAM_ERR_ROOM = -7,
    PROGRAM_ERR_KERNEL = -8, /* this controller's image does not have the kernel configured */
    /* header */
    PROGRAM_ERR_PERIOD = -10,      /* period not 1000, 2000, 4000 or 8000 us */
    PROGRAM_ERR_PERIOD_USED = -11, /* period is not the one configured in the controller */
    PROGRAM_ERR_FLAGS = -12,       /* unknown flag, or one that only a chunk may have */
    PROGRAM_ERR_AXES = -13,        /* axis count not 2 ... 6, or not that of the machine */
    PROGRAM_ERR_DURATION = -14,    /* not the sum of the pieces, or not below 2^22 s */
    PROGRAM_ERR_LENGTH = -15,      /* length not in (0, 2^22) mm */
    PROGRAM_ERR_NAME = -16,        /* name not padded with zeros */
    /* segments: index = the segment (of a joint: the later one) */
    PROGRAM_ERR_W_RANGE = -20,     /* |u| or |v| is 64 or more */
    PROGRAM_ERR_POINT_RANGE = -21, /* coordinate is 4096 mm or more */
    PROGRAM_ERR_ARC_RANGE = -22,   /* arc length is negative or 2^22 mm or more */
    PROGRAM_ERR_SIGMA = -23, /* a Bernstein coefficient of the parametric speed is not positive */
    PROGRAM_ERR_SIGMA_RATIO = -24,    /* the largest is more than twice the smallest */
    PROGRAM_ERR_SEGMENT_LONG = -25,   /* longer than 32 mm */
    PROGRAM_ERR_SEGMENT_FIRST = -26,  /* the first segment does not start at arc length 0 */
    PROGRAM_ERR_JOIN_POINT = -27,     /* points differ by more than 2^-34 mm */
    PROGRAM_ERR_JOIN_ARC = -28,       /* arc lengths differ by more than 2^-34 mm */
    PROGRAM_ERR_JOIN_DIRECTION = -29, /* directions differ by more than 2^-20 rad */
    PROGRAM_ERR_SEGMENT_END = -30, /* the last segment does not end at the length of the header */
    /* flag "closed", but end and start are more than 2^-24 mm apart */
    PROGRAM_ERR_NOT_CLOSED = -31,
    PROGRAM_ERR_SEGMENT_SHORT = -32, /* a tick at 200 % could cross more than two segment ends */
    PROGRAM_ERR_TRAVEL = -33,        /* leaves the travel limits */
    /* pieces: index = the piece (of a joint: the later one) */
    PROGRAM_ERR_PIECE_DURATION = -40,    /* duration 0, or above 2^22 s */
    PROGRAM_ERR_COEFFICIENT = -41,       /* a coefficient is above 2^14 mm */
    PROGRAM_ERR_PIECE_LONG = -42,        /* longer than 32 mm */
    PROGRAM_ERR_PIECE_FIRST = -43,       /* the first piece does not start at arc length 0 */
    PROGRAM_ERR_JOIN_LENGTH = -44,       /* F differs by more than 2^-34 mm */
    PROGRAM_ERR_JOIN_FEED = -45,         /* F' differs by more than 2^-16 mm/s */
    PROGRAM_ERR_JOIN_ACCELERATION = -46, /* F'' differs by more than 2^-6 mm/s^2 */
    PROGRAM_ERR_START_MOVING = -47,      /* the program does not begin at rest */
    PROGRAM_ERR_END_MOVING = -48,        /* the program does not end at rest */
    PROGRAM_ERR_PIECE_END = -49,    /* the last piece does not end at the length of the header */
    PROGRAM_ERR_PIECE_SHORT = -50,  /* two adjacent pieces last two periods or less */
    PROGRAM_ERR_BACKWARDS = -51,    /* feed below -2^-10 mm/s */
    PROGRAM_ERR_FEED = -52,         /* above the feed limit of the controller */
    PROGRAM_ERR_ACCELERATION = -53, /* above its acceleration limit */
    PROGRAM_ERR_JERK = -54,         /* above its jerk limit */
    PROGRAM_ERR_OVERRIDE = -55, /* override factor not in 1.0 ... 2.0, or an override bound is 0 */
    /* axes (core/limit_check.h): index = the piece in which it can happen */
    PROGRAM_ERR_AXIS_VELOCITY = -70,     /* above the velocity limit of an axis */
    PROGRAM_ERR_AXIS_ACCELERATION = -71, /* above its acceleration limit */
    PROGRAM_ERR_AXIS_JERK = -72,         /* above its jerk limit */
    /* velocity or acceleration jumps at a joint by more than its limits allow */
    PROGRAM_ERR_AXIS_STEP = -73,
    /* stops: index = the piece */
    /* some codes of a stop are 0 and some are not, or a reserved field is not 0 */
    PROGRAM_ERR_STOP_ENTRY = -60,
    PROGRAM_ERR_STOP_NUMBERS = -61, /* a path stop would be above the limits of the controller */
    PROGRAM_ERR_STOP_BOUND = -62,   /* a stop can take longer than its bound */
    PROGRAM_ERR_STOP_LONG = -63,    /* a fault stop can take longer than the controller allows */
    PROGRAM_ERR_STOP_WORST = -64,   /* the worst stops of the header are not those of the table */
    /* events (core/event_check.h): index = the event */
    PROGRAM_ERR_EVENT_KIND = -100,  /* kind or channel unknown */
    PROGRAM_ERR_EVENT_VALUE = -101, /* mask or value outside of what the kind has */
    PROGRAM_ERR_EVENT_PLACE = -102, /* before the event before it, or outside the path */
    PROGRAM_ERR_EVENT_DENSE = -103, /* a tick at 200 % could pass more than 16 events */
    /* chunks of a stream (core/chunk.h): index = the segment, piece or event of the chunk if stated so, else 0 */
    /* no magic "HDGC", version unknown, size wrong, unknown flag, or a reserved field is not 0 */
    PROGRAM_ERR_CHUNK_FORMAT = -80,
    PROGRAM_ERR_CHUNK_CRC = -81, /* CRC-32 of the chunk is wrong */
    PROGRAM_ERR_CHUNK_JOB = -82, /* another job than the predecessor's, or job 0 */
    /* sequence is not one more than the predecessor's; of a first chunk not 0 */
    PROGRAM_ERR_CHUNK_SEQUENCE = -83,
    /* flag FIRST, but a predecessor, shared parts or a start in motion; or none of them */
    PROGRAM_ERR_CHUNK_FIRST = -84,
    PROGRAM_ERR_CHUNK_PROGRAM = -85, /* period, axis count or first axis is not the predecessor's */
    PROGRAM_ERR_CHUNK_SHARED = -86,  /* shifts or shared counts do not fit the predecessor */
    /* a shared segment is not the predecessor's; index = the segment */
    PROGRAM_ERR_CHUNK_SEGMENT = -87,
    PROGRAM_ERR_CHUNK_PIECE = -88, /* a shared piece is not the predecessor's; index = the piece */
    /* the job has ended or has been stopped, or the configuration has changed (app/stream) */
    PROGRAM_ERR_CHUNK_OVER = -89,
    /* after a rest it does not begin where its predecessor ends, or flag REST is missing */
    PROGRAM_ERR_CHUNK_REST = -79,
    /* events of the shared segments are not the predecessor's; index = the event */
    PROGRAM_ERR_CHUNK_EVENT = -78,
};

/* What this controller allows. 0: any, or no limit, except for travel, which is always checked. */
struct program_limits {
    /* path axes of the machine; a program with another number is refused; 0: any */
    uint32_t axis_count;
    uint32_t period_us; /* configured period; 0: any allowed one */
    uint32_t feed_um_s; /* 0: no limit; the same for the next two */
    uint32_t acceleration_um_s2;
    uint32_t jerk_mm_s3;
    /* Of the path axes of the program; mm are degrees for a rotary axis. Travel from -4096 to 4096 mm allows all that
     * the format allows. */
    int64_t min_q40_mm[PROGRAM_AXES]; /* travel */
    int64_t max_q40_mm[PROGRAM_AXES];
    uint32_t axis_velocity_um_s[PROGRAM_AXES]; /* at every override; 0: no limit */
    uint32_t axis_acceleration_um_s2[PROGRAM_AXES];
    uint32_t axis_jerk_mm_s3[PROGRAM_AXES];
    uint32_t stop_time_ms; /* greatest bound of a fault stop; 0: any */
    uint32_t chunk;        /* 1: a chunk's program may begin in motion (core/chunk.h) */
    /* Called with `self` at every segment and piece, and at every part of a piece near the limits of axes, so that a
     * main loop can send heartbeats and make coefficient records during the check. May be NULL. */
    void (*attend)(void *self);
    void *self;
};

struct program_fault {
    int code;       /* 0 or enum program_error */
    uint32_t index; /* segment, piece or event; 0 for the header */
};

/* Calls `attend`, if there is one. The parts of the check do so at each step of long work. */
static inline void program_limits_attend(const struct program_limits *limits)
{
    if (limits->attend != NULL) {
        limits->attend(limits->self);
    }
}

#endif
