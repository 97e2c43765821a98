/* SPDX-License-Identifier: MIT */
/* drive_rows: the table behind drive_plan: which object of a drive gets which value, in order. */
#ifndef APP_DRIVES_DRIVE_ROWS_H
#define APP_DRIVES_DRIVE_ROWS_H

#include <stdint.h>

#include "app/drives/drive_pdo.h"

/* When a row concerns the drive. */
enum drive_when {
    WHEN_ALWAYS,
    WHEN_SIMULATED, /* the project's own drive */
    WHEN_REAL,
    WHEN_INPUTS,      /* the drive has 0x60FD */
    WHEN_NOT_MAPPED,  /* and TPDO3 does not tell it */
    WHEN_TORQUE,      /* torque feedforward is on */
    WHEN_NO_TORQUE,   /* it is not, or the drive does not map it */
    WHEN_VELOCITY,    /* velocity feedforward is on */
    WHEN_NO_VELOCITY, /* as WHEN_NO_TORQUE */
    WHEN_HOMING,      /* homing is asked for, and the drive has the mode */
    WHEN_WINDOW,      /* a following error window is set */
    WHEN_VENDOR, /* the drive's identity is known from the machine file: vendor, product, revision */
    WHEN_PRODUCT,
    WHEN_REVISION,
    WHEN_ENCODER, /* the encoder's increments, gear, feed constant are set */
    WHEN_GEAR,
    WHEN_FEED,
};

enum drive_row_kind {
    ROW_PRE_OPERATIONAL, /* NMT */
    ROW_EXPECT,          /* reads `size` bytes: must be the value */
    ROW_NEED_BITS,       /* reads: must contain the bits of the value */
    ROW_LEARN,           /* reads enum drive_fact `argument`, if there is one */
    ROW_MUST,            /* writes */
    ROW_MAY,             /* writes; a drive without the object is fine */
    ROW_TRY,             /* writes; a refusal is fine */
    ROW_PDO,             /* drive_pdos[argument] */
    ROW_PDO_MAY,         /* the same; left off (and its fact unknown) when refused */
    ROW_PDO_OFFSET,      /* the same; only when an object is missing or cannot be mapped */
};

enum drive_source {
    FROM_ROW,  /* `argument` */
    FROM_AXIS, /* the field of struct config_axis at offset `argument` */
    FROM_PERIOD_US,
    FROM_PERIOD_MS,
    FROM_TRAVEL_MIN,
    FROM_TRAVEL_MAX,
    FROM_SETPOINT_TIMEOUT,
    FROM_OWN_NODE, /* 0x1016: this controller, silent for `argument` ms */
};

struct drive_row {
    enum drive_when when;
    enum drive_row_kind kind;
    uint16_t index;
    uint8_t sub;
    uint8_t size; /* bytes */
    enum drive_source source;
    uint32_t argument;
};

extern const struct drive_row drive_rows[];
extern const uint8_t drive_row_count;
extern const struct drive_pdo drive_pdos[];

#endif
