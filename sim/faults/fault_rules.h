/* SPDX-License-Identifier: MIT */
/* fault_rules: scripted faults, one a line of text (docs/reference/protocol.md section 4): the rules as structs, and
 * their parser. Used by sim/faults, sim/injector and sim/node. Any thread; fault_rules_read reads a file, the other
 * functions change their arguments only.
 */
#ifndef FAULTS_FAULT_RULES_H
#define FAULTS_FAULT_RULES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define FAULT_RULES_MAX 64u
#define FAULT_FOR_EVER  UINT32_MAX /* of for_ticks: until the end */
#define FAULT_LINE_MAX  200u       /* characters of a line */
#define FAULT_FILE_MAX  16384u     /* bytes of a file */

enum fault_kind {
    /* Executed by the injector. */
    FAULT_KIND_DROP,      /* frames are lost */
    FAULT_KIND_DUPLICATE, /* frames come twice */
    FAULT_KIND_DELAY,     /* frames come later by delay_us */
    FAULT_KIND_REORDER,   /* a frame changes places with the next one */
    FAULT_KIND_CORRUPT,   /* data byte `byte` changes by `mask` */
    FAULT_KIND_SHORT,     /* frames come with `len` bytes */
    FAULT_KIND_FLOOD,     /* per_tick more frames in each tick */
    FAULT_KIND_BUS_OFF,   /* no frames from or to `side` */
    /* Executed by the drives (sim/node/node_faults.h). */
    FAULT_KIND_STOP,           /* the drive has no power */
    FAULT_KIND_RESTART,        /* power lost and back at once */
    FAULT_KIND_HEARTBEAT_STOP, /* no heartbeats */
    FAULT_KIND_ENCODER_FREEZE, /* the reading of the encoder stays */
    FAULT_KIND_ENCODER_JUMP,   /* the reading changes by `counts` */
    FAULT_KIND_ENCODER_FAULT,  /* the drive detects that its encoder fails */
    FAULT_KIND_SATURATE,       /* the voltage limit is `volts` */
    FAULT_KIND_LOAD,           /* a load torque that takes `volts` */
    FAULT_KIND_LIMIT_SWITCH,   /* the switch at `side` is on */
    FAULT_KIND_FAULT,          /* the drive goes to Fault with `code` */
    FAULT_KINDS                /* how many there are */
};

/* Sides of the injector, and ends of an axis. */
enum fault_side {
    FAULT_SIDE_CONTROLLER, /* the bus of the controller and the host, */
    FAULT_SIDE_DRIVES,     /* and that of the drives */
    FAULT_SIDE_NEGATIVE,   /* the limit switch at the negative end of an axis, */
    FAULT_SIDE_POSITIVE    /* and that at the positive end */
};

/* One rule; fields that its kind does not have are 0. */
struct fault_rule {
    enum fault_kind kind;
    uint32_t line;      /* in the file, from 1 */
    uint32_t at;        /* first tick */
    uint32_t for_ticks; /* 0 where for_ms is given; or FAULT_FOR_EVER */
    uint32_t for_ms;
    uint32_t count; /* most frames; 0: any number */
    double p;       /* of each frame */
    uint32_t seed;
    uint16_t id;
    uint8_t node;
    uint32_t delay_us;
    uint8_t byte;
    uint8_t mask;      /* xor */
    uint8_t len;       /* bytes that the shortened frame keeps */
    uint32_t per_tick; /* frames of a flood */
    enum fault_side side;
    int32_t counts;
    double volts;
    uint16_t code; /* EMCY */
};

struct fault_rules {
    struct fault_rule rules[FAULT_RULES_MAX];
    uint32_t count;
};

/* The name of a kind in a rule. */
const char *fault_kind_name(enum fault_kind kind);

/* Whether drives execute this kind, and not the injector. */
bool fault_kind_is_drives(enum fault_kind kind);

#define FAULT_RULES_WRONG (-1)

/* Parses `length` bytes of text. Returns 0, or FAULT_RULES_WRONG with one line in `reason`: the line, the error, and
 * what would be correct. */
int fault_rules_parse(struct fault_rules *rules, const char *text, size_t length, char *reason,
                      size_t size);

/* The same from a file; the reason names it. */
int fault_rules_read(struct fault_rules *rules, const char *path, char *reason, size_t size);

#endif
