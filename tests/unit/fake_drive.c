/* SPDX-License-Identifier: MIT */
/* Implements fake_drive.h (see there): an ideal CiA 402 drive for tests of the controller. Part of the C tests; no
 * I/O. */
#include "fake_drive.h"

#include <string.h>

#include "canopen/cob.h"
#include "canopen/pdo.h"
#include "canopen/sdo_abort.h"

static bool lacks(const struct fake_drive *drive, uint16_t index)
{
    for (size_t i = 0; i < sizeof drive->lacks / sizeof drive->lacks[0]; ++i) {
        if (drive->lacks[i] == index) {
            return true;
        }
    }
    return false;
}

static uint32_t read_hook(void *context, const struct od_entry *entry)
{
    struct fake_drive *drive = context;
    drive->reads++;
    if (entry->index == 0x6061) {
        drive->values.modes_of_operation_display =
            drive->mode_stuck != 0 ? drive->mode_stuck : drive->values.modes_of_operation;
    }
    if (entry->index == 0x6064) {
        drive->values.position_actual_value = drive->position_counts;
    }
    return lacks(drive, entry->index) ? SDO_ABORT_NO_OBJECT : SDO_OK;
}

static bool takes_limit(const struct fake_drive *drive, uint32_t object, int32_t value)
{
    const int32_t least = drive->values.software_position_limit[0];
    const int32_t most = drive->values.software_position_limit[1];
    if (object == 0x607D01u && drive->no_open_limits && value == INT32_MIN) {
        return false;
    }
    return !drive->ordered_limits || (object != 0x607D01u && object != 0x607D02u) ||
           (object == 0x607D01u ? value <= most : value >= least);
}

static uint32_t write_hook(void *context, const struct od_entry *entry, const uint8_t *value,
                           uint32_t size)
{
    struct fake_drive *drive = context;
    const uint32_t object = ((uint32_t)entry->index << 8) + entry->sub;
    if (lacks(drive, entry->index)) {
        return SDO_ABORT_NO_OBJECT;
    }
    if (drive->fixed_mapping && entry->index >= 0x1400u && entry->index < 0x1C00u) {
        return SDO_ABORT_READ_ONLY;
    }
    if (drive->unmappable != 0u && entry->index >= 0x1600u && entry->index < 0x1800u &&
        cob_get(value, size) == drive->unmappable) {
        return SDO_ABORT_NOT_MAPPABLE;
    }
    if (object == drive->refuses || !takes_limit(drive, object, (int32_t)cob_get(value, size))) {
        return SDO_ABORT_VALUE;
    }
    if (entry->index == 0x6060u && drive->values.modes_of_operation == CIA402_MODE_HOMING) {
        drive->state.flags &= (uint16_t)~CIA402_STATUS_HOMING_ERROR;
        drive->state.flags |= CIA402_STATUS_FOLLOWS; /* the same bit as HOMING_ATTAINED */
    }
    const struct fake_write write = {object, (uint32_t)cob_get(value, size)};
    drive->writes[drive->write_count++ % FAKE_DRIVE_WRITES] = write;
    return SDO_OK;
}

uint32_t fake_drive_written(const struct fake_drive *drive, uint32_t object, uint32_t *first)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < drive->write_count && i < FAKE_DRIVE_WRITES; ++i) {
        if (drive->writes[i].object == object && count++ == 0u && first != NULL) {
            *first = i;
        }
    }
    return count;
}

static const struct od_hooks hooks = {.read = read_hook, .write = write_hook};

void fake_drive_init(struct fake_drive *drive, uint8_t node, int32_t position_counts)
{
    memset(drive, 0, sizeof *drive);
    drive->node = node;
    drive->position_counts = position_counts;
    drive->latched_counts = position_counts;
    drive->target_counts = position_counts;
    drive->values = od_drive_defaults;
    od_drive_set_node(&drive->values, node);
    od_init(&drive->od, &od_drive_table, &drive->values, &hooks, drive);
    sdo_server_init(&drive->server, &drive->od, node, 1000000, 127);
    nmt_slave_init(&drive->nmt, node, NULL, NULL);
    cia402_device_init(&drive->state);
    drive->state.flags |= CIA402_STATUS_VOLTAGE | CIA402_STATUS_FOLLOWS;
    drive->quick_stop_syncs = 3;
    (void)cia402_device_ready(&drive->state);
}

static uint32_t distance(int32_t a, int32_t b)
{
    return a > b ? (uint32_t)a - (uint32_t)b : (uint32_t)b - (uint32_t)a;
}

static void take_setpoint(struct fake_drive *drive, const struct pdo_setpoint *setpoint)
{
    const bool follow = setpoint->controlword == CIA402_ENABLE_OPERATION;
    const uint32_t step = distance(setpoint->target_counts, drive->target_counts);
    if (follow && drive->following && step > drive->worst_step_counts) {
        drive->worst_step_counts = step;
    }
    if (setpoint->controlword != CIA402_QUICK_STOP) {
        drive->quick_stop_target = setpoint->target_counts;
    } else if (setpoint->target_counts != drive->quick_stop_target) {
        drive->quick_stop_moved++;
    }
    const enum cia402_action action = cia402_device_action(&drive->state);
    if (setpoint->controlword == 0u && (action == CIA402_FOLLOW || action == CIA402_STOP_QUICKLY) &&
        drive->position_counts != drive->place_before) {
        drive->cut_moving++;
    }
    drive->place_before = drive->position_counts;
    drive->following = follow;
    drive->target_counts = setpoint->target_counts;
    drive->setpoints++;
    (void)cia402_device_control(&drive->state, setpoint->controlword);
    if (drive->stuck) {
        (void)cia402_device_fault(&drive->state);
    }
}

/* Stops at its position. */
static void brake(struct fake_drive *drive)
{
    const enum cia402_action action = cia402_device_action(&drive->state);
    if (action != CIA402_STOP_QUICKLY && action != CIA402_STOP_FOR_FAULT) {
        drive->stopping_syncs = 0;
    } else if (++drive->stopping_syncs >= drive->quick_stop_syncs) {
        (void)cia402_device_stopped(&drive->state);
    }
}

static int answer(struct fake_drive *drive, const struct pdo_actual *actual, struct can_msg *out)
{
    if (drive->drops > 0u) {
        drive->drops--;
        return 0;
    }
    pdo_encode_actual(drive->node, actual, out);
    return drive->mute ? 0 : 1;
}

/* Its present answer; or, while it is late, its answer to the last SYNC. With the first answer in time, both. */
static int answers(struct fake_drive *drive, const struct pdo_actual *actual, struct can_msg out[2])
{
    int count = 0;
    if (drive->held) {
        count += answer(drive, &drive->actual, &out[count]);
    }
    drive->held = drive->late;
    drive->actual = *actual;
    if (!drive->late) {
        count += answer(drive, actual, &out[count]);
    }
    return count;
}

/* Homing mode: begins with the edge of bit 4, reports its end in bits 10, 12, 13. */
static void seek_home(struct fake_drive *drive)
{
    const uint16_t acknowledged =
        CIA402_STATUS_TARGET_REACHED | CIA402_STATUS_HOMING_ATTAINED | CIA402_STATUS_HOMING_ERROR;
    if ((drive->state.controlword & CIA402_CONTROL_START_HOMING) == 0u) {
        drive->homing_left = drive->homing_syncs;
        drive->state.flags &= (uint16_t)~acknowledged;
        drive->state.flags |=
            drive->homed ? CIA402_STATUS_TARGET_REACHED | CIA402_STATUS_HOMING_ATTAINED : 0u;
        return;
    }
    drive->homed = drive->homed && drive->homing_left == 0u;
    if (drive->homing_left > 0u) {
        drive->state.flags &= (uint16_t)~acknowledged;
        drive->homing_left--;
    } else if (drive->homing_fails) {
        drive->state.flags |= CIA402_STATUS_HOMING_ERROR;
    } else {
        drive->state.flags |= CIA402_STATUS_TARGET_REACHED | CIA402_STATUS_HOMING_ATTAINED;
        drive->position_counts = drive->values.home_offset;
        drive->place_before = drive->position_counts;
        drive->homed = true;
    }
}

/* Setpoint k follows SYNC k, is latched at SYNC k+1 and reached at SYNC k+2. */
static int take_sync(struct fake_drive *drive, struct can_msg out[2])
{
    if (cia402_device_action(&drive->state) == CIA402_FOLLOW &&
        drive->values.modes_of_operation == CIA402_MODE_HOMING) {
        seek_home(drive);
        drive->latched_counts = drive->position_counts;
    } else if (cia402_device_action(&drive->state) == CIA402_FOLLOW) {
        drive->position_counts = drive->latched_counts;
        drive->latched_counts = drive->target_counts;
    } else {
        drive->latched_counts = drive->position_counts;
    }
    brake(drive);
    const struct pdo_actual actual = {.statusword = cia402_device_statusword(&drive->state),
                                      .position_counts = drive->position_counts};
    return answers(drive, &actual, out);
}

int fake_drive_receive(struct fake_drive *drive, const struct can_msg *in, struct can_msg out[2])
{
    struct pdo_setpoint setpoint;
    if (drive->dead || nmt_slave_receive(&drive->nmt, in)) {
        return 0;
    }
    if (sdo_server_wants(&drive->server, in)) {
        return sdo_server_receive(&drive->server, in, out);
    }
    if (drive->nmt.state != NMT_OPERATIONAL) {
        return 0;
    }
    if (in->id == COB_SYNC) {
        return take_sync(drive, out);
    }
    if (in->id == COB_RPDO1 + drive->node && drive->deaf > 0u) {
        drive->deaf--;
    } else if (pdo_decode_setpoint(in, &setpoint) == drive->node) {
        drive->setpoint_size = in->len;
        (void)pdo_decode_torque(in, &drive->torque_permille);
        take_setpoint(drive, &setpoint);
    } else if (in->id == COB_RPDO2 + drive->node) {
        (void)pdo_decode_velocity(in, &drive->velocity_counts_s);
        drive->velocities++;
    }
    return 0;
}

int fake_drive_process(struct fake_drive *drive, uint32_t elapsed_us, struct can_msg *out)
{
    if (drive->dead) {
        return 0;
    }
    return nmt_slave_process(&drive->nmt, out) != 0 ||
           sdo_server_process(&drive->server, elapsed_us, out) != 0;
}
