/* SPDX-License-Identifier: MIT */
#include "app/drives/drive_rows.h"

#include <stddef.h>

#include "app/drives/drive_plan.h"
#include "app/drives/drive_properties.h"
#include "app/machine/config.h"
#include "canopen/cia402.h"
#include "canopen/cob.h"

#define PROFILE_DRIVE 402u /* low half of 0x1000 */
#define SYNC_COUNTER  240u
#define SYNCHRONOUS   1u /* transmission types */
#define ON_CHANGE     255u
#define INHIBIT_MS    10u

enum { NO_CHANGE = 1 };      /* 0x1029: stays operational, so that its TPDOs tell what it does */
enum { QUICK_STOP = 3 };     /* 0x6007: what it does then */
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
};

/* docs/reference/protocol.md section 2: communication, cob, type, count, inhibit_ms, event_timer, entries, fact */
const struct drive_pdo drive_pdos[] = {
    [RPDO1] =
        {0x1400, COB_RPDO1, SYNCHRONOUS, 2, 0, true, {0x60400010, 0x607A0020, 0}, DRIVE_NO_FACT},
    [RPDO1_TORQUE] = {0x1400,
                      COB_RPDO1,
                      SYNCHRONOUS,
                      3,
                      0,
                      true,
                      {0x60400010, 0x607A0020, 0x60B20010},
                      DRIVE_TORQUE_MAPPED},
    [RPDO2_VELOCITY] =
        {0x1401, COB_RPDO2, SYNCHRONOUS, 1, 0, false, {0x60B10020, 0, 0}, DRIVE_VELOCITY_MAPPED},
    [RPDO2_OFF] = {0x1401, COB_RPDO2, 0, 0, 0, false, {0, 0, 0}, DRIVE_NO_FACT},
    [RPDO3_OFF] = {0x1402, COB_RPDO3, 0, 0, 0, false, {0, 0, 0}, DRIVE_NO_FACT},
    [RPDO4_OFF] = {0x1403, COB_RPDO4, 0, 0, 0, false, {0, 0, 0}, DRIVE_NO_FACT},
    [TPDO1] =
        {0x1800, COB_TPDO1, SYNCHRONOUS, 2, 0, false, {0x60410010, 0x60640020, 0}, DRIVE_NO_FACT},
    [TPDO2_VOLTS] =
        {0x1801, COB_TPDO2, SYNCHRONOUS, 1, 0, false, {0x21000010, 0, 0}, DRIVE_NO_FACT},
    [TPDO2_OFF] = {0x1801, COB_TPDO2, 0, 0, 0, false, {0, 0, 0}, DRIVE_NO_FACT},
    [TPDO3_OFF] = {0x1802, COB_TPDO3, 0, 0, 0, false, {0, 0, 0}, DRIVE_NO_FACT},
    [TPDO3_INPUTS] = {0x1802,
                      COB_TPDO3,
                      ON_CHANGE,
                      1,
                      INHIBIT_MS,
                      false,
                      {0x60FD0020, 0, 0},
                      DRIVE_INPUTS_MAPPED},
    [TPDO4_OFF] = {0x1803, COB_TPDO4, 0, 0, 0, false, {0, 0, 0}, DRIVE_NO_FACT},
};

#define FIELD(name) offsetof(struct config_axis, name)

/* When, what, object, sub-index, bytes, value. */
const struct drive_row drive_rows[] = {
    /* STOPPED it would not answer; no process data while parameters change */
    {WHEN_ALWAYS, ROW_PRE_OPERATIONAL, 0, 0, 0, FROM_ROW, 0},
    /* what is it? */
    {WHEN_ALWAYS, ROW_EXPECT, 0x1000, 0, 2, FROM_ROW, PROFILE_DRIVE},
    {WHEN_ALWAYS, ROW_LEARN, 0x1018, 1, 4, FROM_ROW, DRIVE_VENDOR},
    {WHEN_ALWAYS, ROW_LEARN, 0x1018, 2, 4, FROM_ROW, DRIVE_PRODUCT},
    {WHEN_ALWAYS, ROW_LEARN, 0x1018, 3, 4, FROM_ROW, DRIVE_REVISION},
    {WHEN_ALWAYS, ROW_LEARN, 0x1018, 4, 4, FROM_ROW, DRIVE_SERIAL},
    {WHEN_VENDOR, ROW_EXPECT, 0x1018, 1, 4, FROM_AXIS, FIELD(expected_vendor)},
    {WHEN_PRODUCT, ROW_EXPECT, 0x1018, 2, 4, FROM_AXIS, FIELD(expected_product)},
    {WHEN_REVISION, ROW_EXPECT, 0x1018, 3, 4, FROM_AXIS, FIELD(expected_revision)},
    {WHEN_ALWAYS, ROW_LEARN, 0x6502, 0, 4, FROM_ROW, DRIVE_MODES},
    {WHEN_ALWAYS, ROW_NEED_BITS, 0x6502, 0, 4, FROM_ROW, CIA402_SUPPORTS(CIA402_MODE_CSP)},
    {WHEN_ALWAYS, ROW_LEARN, 0x60FD, 0, 4, FROM_ROW, DRIVE_INPUTS},
    {WHEN_HOMING, ROW_LEARN, 0x6064, 0, 4, FROM_ROW, DRIVE_POSITION},
    /* a drive that was left enabled, and whose PDOs are not ours: it stops, and goes off */
    {WHEN_ALWAYS, ROW_TRY, 0x6040, 0, 2, FROM_ROW, CIA402_QUICK_STOP},
    /* SYNC; its counter may change only while the period is 0 (CiA 301, 0x1019) */
    {WHEN_ALWAYS, ROW_MAY, 0x1005, 0, 4, FROM_ROW, COB_SYNC},
    {WHEN_ALWAYS, ROW_TRY, 0x1006, 0, 4, FROM_ROW, 0},
    {WHEN_ALWAYS, ROW_MAY, 0x1019, 0, 1, FROM_ROW, SYNC_COUNTER},
    {WHEN_ALWAYS, ROW_MAY, 0x1006, 0, 4, FROM_PERIOD_US, 0},
    /* heartbeats both ways instead of node guarding; without them: a quick stop */
    {WHEN_ALWAYS, ROW_MAY, 0x100C, 0, 2, FROM_ROW, 0},
    {WHEN_ALWAYS, ROW_MAY, 0x100D, 0, 1, FROM_ROW, 0},
    {WHEN_ALWAYS, ROW_MUST, 0x1017, 0, 2, FROM_ROW, DRIVE_HEARTBEAT_MS},
    {WHEN_ALWAYS, ROW_MAY, 0x1016, 1, 4, FROM_OWN_NODE, DRIVE_CONTROLLER_SILENT_MS},
    {WHEN_ALWAYS, ROW_MAY, 0x1029, 1, 1, FROM_ROW, NO_CHANGE},
    {WHEN_ALWAYS, ROW_MAY, 0x6007, 0, 2, FROM_ROW, QUICK_STOP},
    /* process data */
    {WHEN_TORQUE, ROW_PDO_OFFSET, 0, 0, 0, FROM_ROW, RPDO1_TORQUE},
    {WHEN_NO_TORQUE, ROW_PDO, 0, 0, 0, FROM_ROW, RPDO1},
    {WHEN_VELOCITY, ROW_PDO_OFFSET, 0, 0, 0, FROM_ROW, RPDO2_VELOCITY},
    {WHEN_NO_VELOCITY, ROW_PDO, 0, 0, 0, FROM_ROW, RPDO2_OFF},
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

const uint8_t drive_row_count = sizeof drive_rows / sizeof drive_rows[0];
