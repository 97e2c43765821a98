/* SPDX-License-Identifier: MIT */
/* Implements app/drives/drive_configuration.h (see there): the configuration of one drive as a list of operations on
 * its dictionary, in order. Used by app/controller, app/drives/drive_boot and app/drives/drive_monitor. Main loop.
 * Changes only its struct and the properties. */
#include "app/drives/drive_configuration.h"

#include <stddef.h>
#include <string.h>

#include "canopen/cia402.h"
#include "canopen/cob.h"
#include "canopen/nmt.h"
#include "canopen/sdo_abort.h"

/* ---- The table: which object of a drive gets which value, in order ---- */

/* When a row concerns the drive. */
enum drive_when {
    WHEN_ALWAYS,
    WHEN_SIMULATED, /* the project's own drive */
    WHEN_REAL,
    WHEN_INPUTS,      /* the drive has 0x60FD */
    WHEN_NOT_MAPPED,  /* and TPDO3 does not report it */
    WHEN_TORQUE,      /* torque feedforward is on */
    WHEN_NO_TORQUE,   /* it is not, or the drive does not map it */
    WHEN_VELOCITY,    /* velocity feedforward is on */
    WHEN_NO_VELOCITY, /* as WHEN_NO_TORQUE */
    WHEN_HOMING,      /* homing is requested, and the drive has the mode */
    WHEN_WINDOW,      /* a following error window is set */
    WHEN_VENDOR, /* the drive's identity is known from the machine file: vendor, product, revision */
    WHEN_PRODUCT,
    WHEN_REVISION,
    WHEN_ENCODER, /* the encoder's increments, gear, feed constant are set */
    WHEN_GEAR,
    WHEN_FEED,
    WHEN_MODULE_VENDOR, /* the same of the I/O module */
    WHEN_MODULE_PRODUCT,
    WHEN_DIGITAL, /* outputs 0 ... 7 of it are mapped, 8 ... 15, analogue ones: one, two, three */
    WHEN_DIGITAL_HIGH,
    WHEN_ANALOGUE,
    WHEN_ANALOGUE_2,
    WHEN_ANALOGUE_3,
};

enum drive_row_kind {
    ROW_PRE_OPERATIONAL, /* NMT */
    ROW_EXPECT,          /* reads `size` bytes: must be the value */
    ROW_NEED_BITS,       /* reads: must contain the bits of the value */
    ROW_READ,            /* reads enum drive_property `argument`, if there is one */
    ROW_MUST,            /* writes */
    ROW_MAY,             /* writes; a drive without the object is fine */
    ROW_TRY,             /* writes; a refusal is fine */
    ROW_PDO,             /* drive_pdos[argument] */
    ROW_PDO_MAY,         /* the same; left off (and its property unknown) when refused */
    ROW_PDO_OFFSET,      /* the same; only when an object is missing or cannot be mapped */
    ROW_PDO_OUTPUTS,     /* RPDO1 of the I/O module */
};

enum drive_source {
    FROM_ROW,  /* `argument` */
    FROM_AXIS, /* the field of struct config_axis at offset `argument` */
    FROM_PERIOD_US,
    FROM_PERIOD_MS,
    FROM_TRAVEL_MIN,
    FROM_TRAVEL_MAX,
    FROM_SETPOINT_TIMEOUT,
    FROM_MODULE_VENDOR,
    FROM_MODULE_PRODUCT,
    FROM_OWN_NODE, /* 0x1016: this controller: no heartbeat for `argument` ms */
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

/* One PDO of a drive as the controller needs it. */
#define PDO_ENTRIES 5u
#define PDO_INVALID UINT32_C(0x80000000) /* bit 31 of the COB-ID */
#define PDO_NO_RTR  UINT32_C(0x40000000) /* bit 30, of TPDOs */

struct drive_pdo {
    uint16_t communication;        /* 0x14xx or 0x18xx; the mapping is 0x200 further */
    uint16_t cob;                  /* without the node id */
    uint8_t type;                  /* transmission type */
    uint8_t count;                 /* mapped objects; 0: the PDO shall be off */
    uint8_t inhibit_ms;            /* TPDO; 0: the drive's own */
    bool event_timer;              /* RPDO: the drive supervises its arrival (0x2004 sub 10) */
    uint32_t entries[PDO_ENTRIES]; /* index << 16 | sub << 8 | bits */
    uint8_t property; /* enum drive_property: known of a drive that has taken all of it */
};

#define PROFILE_DRIVE 402u /* low half of 0x1000 */
#define PROFILE_IO    401u
#define SYNC_COUNTER  240u /* last value of the counter in SYNC */
#define SYNCHRONOUS   1u   /* transmission types */
#define ON_CHANGE     255u
#define INHIBIT_MS    10u /* between two PDOs sent on change */

#define LEAST_POSITION UINT32_C(0x80000000) /* 0x607D sub 1: no minimum */

enum { QUICK_STOP = 3 };     /* 0x6007: the reaction to a lost connection */
enum { QUICK_STOP_OFF = 2 }; /* 0x605A, 0x605E: by 0x6085, then off, then Fault */
enum { MINUS_THREE = 0xFD }; /* 0x60C2 sub 2: the time is sub 1 * 10^-3 s */

enum pdo_number {
    RPDO1,
    RPDO1_TORQUE,
    RPDO2_VELOCITY,
    RPDO2_OFF,
    RPDO3_OFF,
    RPDO4_OFF,
    TPDO1,
    TPDO2_VOLTS,
    TPDO2_OFF,
    TPDO3_OFF,
    TPDO3_INPUTS,
    TPDO4_OFF,
    TPDO1_OFF,
};

/* docs/reference/protocol.md section 2: communication, cob, type, count, inhibit_ms, event_timer, entries, property */
static const struct drive_pdo drive_pdos[] = {
    [RPDO1] = {0x1400,
               COB_RPDO1,
               SYNCHRONOUS,
               2,
               0,
               true,
               {0x60400010, 0x607A0020, 0, 0, 0},
               DRIVE_NO_PROPERTY},
    [RPDO1_TORQUE] = {0x1400,
                      COB_RPDO1,
                      SYNCHRONOUS,
                      3,
                      0,
                      true,
                      {0x60400010, 0x607A0020, 0x60B20010, 0, 0},
                      DRIVE_TORQUE_MAPPED},
    [RPDO2_VELOCITY] = {0x1401,
                        COB_RPDO2,
                        SYNCHRONOUS,
                        1,
                        0,
                        false,
                        {0x60B10020, 0, 0, 0, 0},
                        DRIVE_VELOCITY_MAPPED},
    [RPDO2_OFF] = {0x1401, COB_RPDO2, 0, 0, 0, false, {0, 0, 0, 0, 0}, DRIVE_NO_PROPERTY},
    [RPDO3_OFF] = {0x1402, COB_RPDO3, 0, 0, 0, false, {0, 0, 0, 0, 0}, DRIVE_NO_PROPERTY},
    [RPDO4_OFF] = {0x1403, COB_RPDO4, 0, 0, 0, false, {0, 0, 0, 0, 0}, DRIVE_NO_PROPERTY},
    [TPDO1] = {0x1800,
               COB_TPDO1,
               SYNCHRONOUS,
               2,
               0,
               false,
               {0x60410010, 0x60640020, 0, 0, 0},
               DRIVE_NO_PROPERTY},
    [TPDO2_VOLTS] =
        {0x1801, COB_TPDO2, SYNCHRONOUS, 1, 0, false, {0x21000010, 0, 0, 0, 0}, DRIVE_NO_PROPERTY},
    [TPDO2_OFF] = {0x1801, COB_TPDO2, 0, 0, 0, false, {0, 0, 0, 0, 0}, DRIVE_NO_PROPERTY},
    [TPDO3_OFF] = {0x1802, COB_TPDO3, 0, 0, 0, false, {0, 0, 0, 0, 0}, DRIVE_NO_PROPERTY},
    [TPDO3_INPUTS] = {0x1802,
                      COB_TPDO3,
                      ON_CHANGE,
                      1,
                      INHIBIT_MS,
                      false,
                      {0x60FD0020, 0, 0, 0, 0},
                      DRIVE_INPUTS_MAPPED},
    [TPDO4_OFF] = {0x1803, COB_TPDO4, 0, 0, 0, false, {0, 0, 0, 0, 0}, DRIVE_NO_PROPERTY},
    [TPDO1_OFF] = {0x1800, COB_TPDO1, 0, 0, 0, false, {0, 0, 0, 0, 0}, DRIVE_NO_PROPERTY},
};

#define FIELD(name) offsetof(struct config_axis, name)

/* When, what, object, sub-index, bytes, value. */
static const struct drive_row drive_rows[] = {
    /* STOPPED it would not answer; no process data while parameters change */
    {WHEN_ALWAYS, ROW_PRE_OPERATIONAL, 0, 0, 0, FROM_ROW, 0},
    /* identity */
    {WHEN_ALWAYS, ROW_EXPECT, 0x1000, 0, 2, FROM_ROW, PROFILE_DRIVE},
    {WHEN_ALWAYS, ROW_READ, 0x1018, 1, 4, FROM_ROW, DRIVE_VENDOR},
    {WHEN_ALWAYS, ROW_READ, 0x1018, 2, 4, FROM_ROW, DRIVE_PRODUCT},
    {WHEN_ALWAYS, ROW_READ, 0x1018, 3, 4, FROM_ROW, DRIVE_REVISION},
    {WHEN_ALWAYS, ROW_READ, 0x1018, 4, 4, FROM_ROW, DRIVE_SERIAL},
    {WHEN_VENDOR, ROW_EXPECT, 0x1018, 1, 4, FROM_AXIS, FIELD(expected_vendor)},
    {WHEN_PRODUCT, ROW_EXPECT, 0x1018, 2, 4, FROM_AXIS, FIELD(expected_product)},
    {WHEN_REVISION, ROW_EXPECT, 0x1018, 3, 4, FROM_AXIS, FIELD(expected_revision)},
    {WHEN_ALWAYS, ROW_READ, 0x6502, 0, 4, FROM_ROW, DRIVE_MODES},
    {WHEN_ALWAYS, ROW_NEED_BITS, 0x6502, 0, 4, FROM_ROW, CIA402_SUPPORTS(CIA402_MODE_CSP)},
    {WHEN_ALWAYS, ROW_READ, 0x60FD, 0, 4, FROM_ROW, DRIVE_INPUTS},
    {WHEN_HOMING, ROW_READ, 0x6064, 0, 4, FROM_ROW, DRIVE_POSITION},
    /* for a drive that is still enabled, with other PDOs: it stops and switches off */
    {WHEN_ALWAYS, ROW_TRY, 0x6040, 0, 2, FROM_ROW, CIA402_QUICK_STOP},
    /* SYNC; its counter may change only while the period is 0 (CiA 301, 0x1019) */
    {WHEN_ALWAYS, ROW_MAY, 0x1005, 0, 4, FROM_ROW, COB_SYNC},
    {WHEN_ALWAYS, ROW_TRY, 0x1006, 0, 4, FROM_ROW, 0},
    {WHEN_ALWAYS, ROW_MAY, 0x1019, 0, 1, FROM_ROW, SYNC_COUNTER},
    {WHEN_ALWAYS, ROW_MAY, 0x1006, 0, 4, FROM_PERIOD_US, 0},
    /* heartbeats in both directions instead of node guarding; without them: a quick stop */
    {WHEN_ALWAYS, ROW_MAY, 0x100C, 0, 2, FROM_ROW, 0},
    {WHEN_ALWAYS, ROW_MAY, 0x100D, 0, 1, FROM_ROW, 0},
    {WHEN_ALWAYS, ROW_MUST, 0x1017, 0, 2, FROM_ROW, DRIVE_HEARTBEAT_MS},
    {WHEN_ALWAYS, ROW_MAY, 0x1016, 1, 4, FROM_OWN_NODE, DRIVE_CONTROLLER_TIMEOUT_MS},
    /* it stays operational, so that its TPDOs report its state */
    {WHEN_ALWAYS, ROW_MAY, 0x1029, 1, 1, FROM_ROW, NMT_ERROR_NO_CHANGE},
    {WHEN_ALWAYS, ROW_MAY, 0x6007, 0, 2, FROM_ROW, QUICK_STOP},
    /* process data */
    {WHEN_TORQUE, ROW_PDO_OFFSET, 0, 0, 0, FROM_ROW, RPDO1_TORQUE},
    {WHEN_NO_TORQUE, ROW_PDO, 0, 0, 0, FROM_ROW, RPDO1},
    {WHEN_VELOCITY, ROW_PDO_OFFSET, 0, 0, 0, FROM_ROW, RPDO2_VELOCITY},
    {WHEN_NO_VELOCITY, ROW_PDO, 0, 0, 0, FROM_ROW, RPDO2_OFF},
    /* offsets that it received last, in motion, would act from the next enabling on */
    {WHEN_NO_TORQUE, ROW_TRY, 0x60B2, 0, 2, FROM_ROW, 0},
    {WHEN_NO_VELOCITY, ROW_TRY, 0x60B1, 0, 4, FROM_ROW, 0},
    {WHEN_ALWAYS, ROW_PDO, 0, 0, 0, FROM_ROW, RPDO3_OFF},
    {WHEN_ALWAYS, ROW_PDO, 0, 0, 0, FROM_ROW, RPDO4_OFF},
    {WHEN_ALWAYS, ROW_PDO, 0, 0, 0, FROM_ROW, TPDO1},
    {WHEN_SIMULATED, ROW_PDO, 0, 0, 0, FROM_ROW, TPDO2_VOLTS},
    {WHEN_REAL, ROW_PDO, 0, 0, 0, FROM_ROW, TPDO2_OFF},
    {WHEN_INPUTS, ROW_PDO_MAY, 0, 0, 0, FROM_ROW, TPDO3_INPUTS},
    {WHEN_NOT_MAPPED, ROW_PDO, 0, 0, 0, FROM_ROW, TPDO3_OFF},
    {WHEN_ALWAYS, ROW_PDO, 0, 0, 0, FROM_ROW, TPDO4_OFF},
    {WHEN_SIMULATED, ROW_MAY, 0x2101, 6, 2, FROM_SETPOINT_TIMEOUT, 0},
    /* scaling */
    {WHEN_ENCODER, ROW_MUST, 0x608F, 1, 4, FROM_AXIS, FIELD(encoder_increments)},
    {WHEN_ENCODER, ROW_MUST, 0x608F, 2, 4, FROM_ROW, 1},
    {WHEN_GEAR, ROW_MUST, 0x6091, 1, 4, FROM_AXIS, FIELD(gear_motor_revolutions)},
    {WHEN_GEAR, ROW_MUST, 0x6091, 2, 4, FROM_AXIS, FIELD(gear_shaft_revolutions)},
    {WHEN_FEED, ROW_MUST, 0x6092, 1, 4, FROM_AXIS, FIELD(feed_constant_counts)},
    {WHEN_FEED, ROW_MUST, 0x6092, 2, 4, FROM_ROW, 1},
    /* limits and reactions */
    /* a drive may refuse a minimum above the maximum that it still has, and the reverse */
    {WHEN_ALWAYS, ROW_TRY, 0x607D, 1, 4, FROM_ROW, LEAST_POSITION},
    {WHEN_ALWAYS, ROW_TRY, 0x607D, 2, 4, FROM_TRAVEL_MAX, 0},
    {WHEN_ALWAYS, ROW_MUST, 0x607D, 1, 4, FROM_TRAVEL_MIN, 0},
    {WHEN_ALWAYS, ROW_MUST, 0x607D, 2, 4, FROM_TRAVEL_MAX, 0},
    {WHEN_ALWAYS, ROW_MAY, 0x6085, 0, 4, FROM_AXIS, FIELD(quick_stop_counts_s2)},
    {WHEN_ALWAYS, ROW_MAY, 0x605A, 0, 2, FROM_ROW, QUICK_STOP_OFF},
    {WHEN_ALWAYS, ROW_MAY, 0x605E, 0, 2, FROM_ROW, QUICK_STOP_OFF},
    {WHEN_WINDOW, ROW_MUST, 0x6065, 0, 4, FROM_AXIS, FIELD(following_window_counts)},
    {WHEN_WINDOW, ROW_MAY, 0x6066, 0, 2, FROM_AXIS, FIELD(following_timeout_ms)},
    /* homing: a zero that the drive finds by itself */
    {WHEN_HOMING, ROW_MUST, 0x6098, 0, 1, FROM_AXIS, FIELD(homing_method)},
    {WHEN_HOMING, ROW_MAY, 0x6099, 1, 4, FROM_AXIS, FIELD(homing_speed_towards_counts_s)},
    {WHEN_HOMING, ROW_MAY, 0x6099, 2, 4, FROM_AXIS, FIELD(homing_speed_away_counts_s)},
    {WHEN_HOMING, ROW_MAY, 0x609A, 0, 4, FROM_AXIS, FIELD(homing_acceleration_counts_s2)},
    {WHEN_HOMING, ROW_MUST, 0x607C, 0, 4, FROM_AXIS, FIELD(home_offset_counts)},
    /* cyclic synchronous position; the time between setpoints */
    {WHEN_ALWAYS, ROW_MUST, 0x60C2, 1, 1, FROM_PERIOD_MS, 0},
    {WHEN_ALWAYS, ROW_MUST, 0x60C2, 2, 1, FROM_ROW, MINUS_THREE},
    {WHEN_ALWAYS, ROW_MUST, 0x6060, 0, 1, FROM_ROW, CIA402_MODE_CSP},
    {WHEN_ALWAYS, ROW_EXPECT, 0x6061, 0, 1, FROM_ROW, CIA402_MODE_CSP},
};

#define ROWS (sizeof drive_rows / sizeof drive_rows[0])

/* The same of the I/O module, CiA 401. Without heartbeats of the controller it switches its outputs off: 0x1029 leaves
 * it operational, so that its error values hold (0x6206, 0x6207; 0x6443, 0x6444). */
static const struct drive_row module_rows[] = {
    {WHEN_ALWAYS, ROW_PRE_OPERATIONAL, 0, 0, 0, FROM_ROW, 0},
    {WHEN_ALWAYS, ROW_EXPECT, 0x1000, 0, 2, FROM_ROW, PROFILE_IO},
    {WHEN_ALWAYS, ROW_READ, 0x1018, 1, 4, FROM_ROW, DRIVE_VENDOR},
    {WHEN_ALWAYS, ROW_READ, 0x1018, 2, 4, FROM_ROW, DRIVE_PRODUCT},
    {WHEN_MODULE_VENDOR, ROW_EXPECT, 0x1018, 1, 4, FROM_MODULE_VENDOR, 0},
    {WHEN_MODULE_PRODUCT, ROW_EXPECT, 0x1018, 2, 4, FROM_MODULE_PRODUCT, 0},
    {WHEN_ALWAYS, ROW_MAY, 0x1005, 0, 4, FROM_ROW, COB_SYNC},
    {WHEN_ALWAYS, ROW_MAY, 0x1006, 0, 4, FROM_PERIOD_US, 0},
    {WHEN_ALWAYS, ROW_MAY, 0x100C, 0, 2, FROM_ROW, 0},
    {WHEN_ALWAYS, ROW_MAY, 0x100D, 0, 1, FROM_ROW, 0},
    {WHEN_ALWAYS, ROW_MUST, 0x1017, 0, 2, FROM_ROW, DRIVE_HEARTBEAT_MS},
    {WHEN_ALWAYS, ROW_MAY, 0x1016, 1, 4, FROM_OWN_NODE, DRIVE_CONTROLLER_TIMEOUT_MS},
    {WHEN_ALWAYS, ROW_MAY, 0x1029, 1, 1, FROM_ROW, NMT_ERROR_NO_CHANGE},
    {WHEN_DIGITAL, ROW_MAY, 0x6206, 1, 1, FROM_ROW, 0xFF},
    {WHEN_DIGITAL, ROW_MAY, 0x6207, 1, 1, FROM_ROW, 0},
    {WHEN_DIGITAL, ROW_MUST, 0x6200, 1, 1, FROM_ROW, 0},
    {WHEN_DIGITAL_HIGH, ROW_MAY, 0x6206, 2, 1, FROM_ROW, 0xFF},
    {WHEN_DIGITAL_HIGH, ROW_MAY, 0x6207, 2, 1, FROM_ROW, 0},
    {WHEN_DIGITAL_HIGH, ROW_MUST, 0x6200, 2, 1, FROM_ROW, 0},
    {WHEN_ANALOGUE, ROW_MAY, 0x6443, 1, 1, FROM_ROW, 1},
    {WHEN_ANALOGUE, ROW_MAY, 0x6444, 1, 4, FROM_ROW, 0},
    {WHEN_ANALOGUE, ROW_MUST, 0x6411, 1, 2, FROM_ROW, 0},
    {WHEN_ANALOGUE_2, ROW_MAY, 0x6443, 2, 1, FROM_ROW, 1},
    {WHEN_ANALOGUE_2, ROW_MAY, 0x6444, 2, 4, FROM_ROW, 0},
    {WHEN_ANALOGUE_2, ROW_MUST, 0x6411, 2, 2, FROM_ROW, 0},
    {WHEN_ANALOGUE_3, ROW_MAY, 0x6443, 3, 1, FROM_ROW, 1},
    {WHEN_ANALOGUE_3, ROW_MAY, 0x6444, 3, 4, FROM_ROW, 0},
    {WHEN_ANALOGUE_3, ROW_MUST, 0x6411, 3, 2, FROM_ROW, 0},
    {WHEN_ALWAYS, ROW_PDO_OUTPUTS, 0, 0, 0, FROM_ROW, 0},
    {WHEN_ALWAYS, ROW_PDO, 0, 0, 0, FROM_ROW, RPDO2_OFF},
    {WHEN_ALWAYS, ROW_PDO, 0, 0, 0, FROM_ROW, RPDO3_OFF},
    {WHEN_ALWAYS, ROW_PDO, 0, 0, 0, FROM_ROW, RPDO4_OFF},
    {WHEN_ALWAYS, ROW_PDO, 0, 0, 0, FROM_ROW, TPDO1_OFF},
    {WHEN_ALWAYS, ROW_PDO, 0, 0, 0, FROM_ROW, TPDO2_OFF},
    {WHEN_ALWAYS, ROW_PDO, 0, 0, 0, FROM_ROW, TPDO3_OFF},
    {WHEN_ALWAYS, ROW_PDO, 0, 0, 0, FROM_ROW, TPDO4_OFF},
};

#define MODULE_ROWS (sizeof module_rows / sizeof module_rows[0])

/* ---- Writes of a PDO ---- */

#define MAPPING             0x200u /* from communication to mapping parameter */
#define FIRST_TPDO          0x1800u
#define SUB_COB             1u
#define SUB_TYPE            2u
#define SUB_INHIBIT         3u
#define SUB_EVENT_TIMER     5u
#define INHIBIT_UNITS_IN_MS 10u

enum { ITEM_DISABLE, ITEM_TYPE, ITEM_UNMAP, ITEM_ENTRIES };

/* What follows the entries. */
enum { AFTER_COUNT, AFTER_INHIBIT, AFTER_EVENT_TIMER, AFTER_ENABLE, AFTER_ALL };

static void write_number(struct drive_op *op, uint32_t index, uint32_t sub, uint8_t size,
                         uint32_t value)
{
    *op = (struct drive_op){.kind = DRIVE_OP_WRITE,
                            .index = (uint16_t)index,
                            .sub = (uint8_t)sub,
                            .size = size,
                            .property = DRIVE_NO_PROPERTY,
                            .value = value,
                            .mask = UINT32_MAX};
}

static uint32_t cob_of(const struct drive_pdo *pdo, uint8_t node)
{
    const uint32_t flags = pdo->communication >= FIRST_TPDO ? PDO_NO_RTR : 0u;
    return flags | (pdo->cob + (uint32_t)node);
}

/* To switch a PDO off it only has to be invalid; its mapping does not matter. */
static bool turn_off(const struct drive_pdo *pdo, uint8_t node, uint8_t item, struct drive_op *op)
{
    write_number(op, pdo->communication, SUB_COB, 4, PDO_INVALID | cob_of(pdo, node));
    op->mask = PDO_INVALID;
    op->optional = true;
    return item == ITEM_DISABLE;
}

/* A PDO also works if the drive does not have these times. */
static void write_time(struct drive_op *op, const struct drive_pdo *pdo, uint32_t sub,
                       uint32_t value)
{
    write_number(op, pdo->communication, sub, 2, value);
    op->optional = true;
    op->kind = value != 0u ? DRIVE_OP_WRITE : DRIVE_OP_PREPARE;
}

static bool after_entries(const struct drive_pdo *pdo, uint8_t node, uint16_t setpoint_timeout_ms,
                          uint32_t item, struct drive_op *op)
{
    switch (item) {
    case AFTER_COUNT:
        write_number(op, pdo->communication + MAPPING, 0, 1, pdo->count);
        return true;
    case AFTER_INHIBIT:
        write_time(op, pdo, SUB_INHIBIT, pdo->inhibit_ms * INHIBIT_UNITS_IN_MS);
        return true;
    case AFTER_EVENT_TIMER:
        write_time(op, pdo, SUB_EVENT_TIMER, pdo->event_timer ? setpoint_timeout_ms : 0u);
        return true;
    case AFTER_ENABLE:
        write_number(op, pdo->communication, SUB_COB, 4, cob_of(pdo, node));
        op->mask = ~PDO_NO_RTR;
        return true;
    case AFTER_ALL:
    default:
        return false;
    }
}

/* The write number `item` (0, 1, ...) that makes a PDO of a drive as it shall be, in the order of CiA 301 (7.5.2.36):
 * disable, transmission type, no mapping, entries, their count, times, enable. False after the last one.
 * setpoint_timeout_ms is for the event timer. */
static bool pdo_op(const struct drive_pdo *pdo, uint8_t node, uint16_t setpoint_timeout_ms,
                   uint8_t item, struct drive_op *op)
{
    if (pdo->count == 0u) {
        return turn_off(pdo, node, item, op);
    }
    switch (item) {
    case ITEM_DISABLE:
        write_number(op, pdo->communication, SUB_COB, 4, PDO_INVALID | cob_of(pdo, node));
        op->kind = DRIVE_OP_PREPARE;
        return true;
    case ITEM_TYPE:
        write_number(op, pdo->communication, SUB_TYPE, 1, pdo->type);
        return true;
    case ITEM_UNMAP:
        write_number(op, pdo->communication + MAPPING, 0, 1, 0);
        op->kind = DRIVE_OP_PREPARE;
        return true;
    default:
        break;
    }
    uint32_t entry = item - (uint32_t)ITEM_ENTRIES;
    if (entry < pdo->count) {
        write_number(op, pdo->communication + MAPPING, entry + 1u, 4, pdo->entries[entry]);
        return true;
    }
    entry -= pdo->count;
    if (pdo->inhibit_ms == 0u && entry >= AFTER_INHIBIT) {
        entry++;
    }
    return after_entries(pdo, node, setpoint_timeout_ms, entry, op);
}

/* ---- Execution of the table ---- */

static uint8_t node_of(const struct drive_configuration *configuration)
{
    return drive_configuration_node(configuration->config, configuration->axis);
}

static bool is_module(const struct drive_configuration *configuration)
{
    return configuration->axis >= configuration->config->axis_count;
}

static const struct config_axis *axis_of(const struct drive_configuration *configuration)
{
    return &configuration->config->axis[configuration->axis];
}

static bool configured(const struct drive_configuration *configuration, enum drive_when when)
{
    const struct config_axis *axis = axis_of(configuration);
    switch (when) {
    case WHEN_TORQUE:
        return (configuration->config->feedforward & CONFIG_TORQUE_FEEDFORWARD) != 0u;
    case WHEN_VELOCITY:
        return (configuration->config->feedforward & CONFIG_VELOCITY_FEEDFORWARD) != 0u;
    case WHEN_HOMING:
        return axis->homing_method != 0 &&
               drive_supports(configuration->properties, CIA402_MODE_HOMING);
    case WHEN_WINDOW:
        return axis->following_window_counts != UINT32_MAX;
    case WHEN_VENDOR:
        return axis->expected_vendor != 0u;
    case WHEN_PRODUCT:
        return axis->expected_product != 0u;
    case WHEN_REVISION:
        return axis->expected_revision != 0u;
    case WHEN_ENCODER:
        return axis->encoder_increments != 0u;
    case WHEN_GEAR:
        return axis->gear_motor_revolutions != 0u && axis->gear_shaft_revolutions != 0u;
    case WHEN_FEED:
    default:
        return axis->feed_constant_counts != 0u;
    }
}

static bool concerns_module(const struct config_outputs *outputs, enum drive_when when)
{
    switch (when) {
    case WHEN_MODULE_VENDOR:
        return outputs->vendor != 0u;
    case WHEN_MODULE_PRODUCT:
        return outputs->product != 0u;
    case WHEN_DIGITAL:
        return outputs->digital_count > 0u;
    case WHEN_DIGITAL_HIGH:
        return outputs->digital_count > 8u;
    case WHEN_ANALOGUE:
        return outputs->analogue_count > 0u;
    case WHEN_ANALOGUE_2:
        return outputs->analogue_count > 1u;
    case WHEN_ANALOGUE_3:
        return outputs->analogue_count > 2u;
    default:
        return when == WHEN_ALWAYS;
    }
}

static bool concerns(const struct drive_configuration *configuration, enum drive_when when)
{
    if (is_module(configuration)) {
        return concerns_module(&configuration->config->outputs, when);
    }
    switch (when) {
    case WHEN_ALWAYS:
        return true;
    case WHEN_SIMULATED:
        return drive_is_simulated(configuration->properties);
    case WHEN_REAL:
        return !drive_is_simulated(configuration->properties);
    case WHEN_INPUTS:
        return configuration->properties->known[DRIVE_INPUTS];
    case WHEN_NOT_MAPPED:
        return !configuration->properties->known[DRIVE_INPUTS_MAPPED];
    case WHEN_NO_TORQUE:
        return !configuration->properties->known[DRIVE_TORQUE_MAPPED];
    case WHEN_NO_VELOCITY:
        return !configuration->properties->known[DRIVE_VELOCITY_MAPPED];
    default:
        return configured(configuration, when);
    }
}

static uint32_t axis_number(const struct drive_configuration *configuration, size_t offset)
{
    uint32_t number;
    memcpy(&number, (const uint8_t *)axis_of(configuration) + offset, sizeof number);
    return number;
}

static uint32_t value_of(const struct drive_configuration *configuration,
                         const struct drive_row *row)
{
    const struct config *config = configuration->config;
    switch (row->source) {
    case FROM_AXIS:
        return axis_number(configuration, row->argument);
    case FROM_PERIOD_US:
        return config->period_us;
    case FROM_PERIOD_MS:
        return config->period_us / 1000u;
    case FROM_TRAVEL_MIN:
        return (uint32_t)config->travel[configuration->axis].min_counts;
    case FROM_TRAVEL_MAX:
        return (uint32_t)config->travel[configuration->axis].max_counts;
    case FROM_OWN_NODE:
        return ((uint32_t)config->own_node << 16) | row->argument;
    case FROM_SETPOINT_TIMEOUT:
        return config->setpoint_timeout_ms;
    case FROM_MODULE_VENDOR:
        return config->outputs.vendor;
    case FROM_MODULE_PRODUCT:
        return config->outputs.product;
    case FROM_ROW:
    default:
        return row->argument;
    }
}

static uint32_t low_bytes(uint32_t size)
{
    return size < 4u ? (UINT32_C(1) << (8u * size)) - 1u : UINT32_MAX;
}

static const enum drive_op_kind kinds[] = {
    [ROW_PRE_OPERATIONAL] = DRIVE_OP_NMT_PRE_OPERATIONAL,
    [ROW_EXPECT] = DRIVE_OP_READ,
    [ROW_NEED_BITS] = DRIVE_OP_READ,
    [ROW_READ] = DRIVE_OP_READ,
    [ROW_MUST] = DRIVE_OP_WRITE,
    [ROW_MAY] = DRIVE_OP_WRITE,
    [ROW_TRY] = DRIVE_OP_PREPARE,
};

static void plain_op(const struct drive_configuration *configuration, const struct drive_row *row,
                     struct drive_op *op)
{
    *op = (struct drive_op){.kind = kinds[row->kind],
                            .index = row->index,
                            .sub = row->sub,
                            .size = row->size,
                            .optional = row->kind == ROW_MAY || row->kind == ROW_READ,
                            .property = DRIVE_NO_PROPERTY};
    op->mask = low_bytes(row->size);
    if (row->kind == ROW_READ) {
        op->property = (uint8_t)row->argument;
        op->mask = 0;
        return;
    }
    op->value = value_of(configuration, row) & op->mask;
    if (row->kind == ROW_NEED_BITS) {
        op->mask = op->value;
    }
}

static bool is_pdo(const struct drive_row *row)
{
    return row->kind == ROW_PDO || row->kind == ROW_PDO_MAY || row->kind == ROW_PDO_OFFSET ||
           row->kind == ROW_PDO_OUTPUTS;
}

/* RPDO1 of the I/O module: digital outputs by bytes, then the analogue ones. */
static struct drive_pdo outputs_pdo(const struct config_outputs *outputs)
{
    struct drive_pdo pdo = {.communication = 0x1400,
                            .cob = COB_RPDO1,
                            .type = SYNCHRONOUS,
                            .property = DRIVE_NO_PROPERTY};
    for (uint32_t i = 0; i < outputs->digital_count / 8u; ++i) {
        pdo.entries[pdo.count++] = UINT32_C(0x62000008) + ((i + 1u) << 8);
    }
    for (uint32_t i = 0; i < outputs->analogue_count; ++i) {
        pdo.entries[pdo.count++] = UINT32_C(0x64110010) + ((i + 1u) << 8);
    }
    return pdo;
}

/* The row's present operation; false: it has no more. */
static bool row_op(const struct drive_configuration *configuration, const struct drive_row *row,
                   struct drive_op *op)
{
    if (!concerns(configuration, row->when)) {
        return false;
    }
    if (!is_pdo(row)) {
        plain_op(configuration, row, op);
        return configuration->item == 0u;
    }
    const struct config *config = configuration->config;
    const struct drive_pdo pdo =
        row->kind == ROW_PDO_OUTPUTS ? outputs_pdo(&config->outputs) : drive_pdos[row->argument];
    return pdo_op(&pdo, node_of(configuration), config->setpoint_timeout_ms, configuration->item,
                  op);
}

static const struct drive_row *present_row(const struct drive_configuration *configuration)
{
    return is_module(configuration) ? &module_rows[configuration->row]
                                    : &drive_rows[configuration->row];
}

static void next_row(struct drive_configuration *configuration)
{
    configuration->row++;
    configuration->item = 0;
}

void drive_configuration_begin(struct drive_configuration *configuration,
                               const struct config *config, uint8_t axis,
                               struct drive_properties *properties)
{
    memset(configuration, 0, sizeof *configuration);
    memset(properties, 0, sizeof *properties);
    configuration->config = config;
    configuration->axis = axis;
    configuration->properties = properties;
}

bool drive_configuration_op(struct drive_configuration *configuration, struct drive_op *op)
{
    const uint32_t count = is_module(configuration) ? MODULE_ROWS : ROWS;
    while (configuration->row < count) {
        const struct drive_row *row = present_row(configuration);
        if (row_op(configuration, row, op)) {
            return true;
        }
        if (is_pdo(row) && row->kind != ROW_PDO_OUTPUTS && concerns(configuration, row->when)) {
            drive_properties_read(configuration->properties, drive_pdos[row->argument].property, 1);
        }
        next_row(configuration);
    }
    return false;
}

void drive_configuration_advance(struct drive_configuration *configuration)
{
    configuration->item++;
}

static bool can_do_without(enum drive_row_kind kind, uint32_t abort_code)
{
    return kind == ROW_PDO_MAY ||
           (kind == ROW_PDO_OFFSET &&
            (abort_code == SDO_ABORT_NO_OBJECT || abort_code == SDO_ABORT_NOT_MAPPABLE));
}

bool drive_configuration_refused(struct drive_configuration *configuration, uint32_t abort_code)
{
    if (!can_do_without(present_row(configuration)->kind, abort_code)) {
        return false;
    }
    next_row(configuration);
    return true;
}
