/* SPDX-License-Identifier: MIT */
#include "fake_drive.h"

#include <string.h>

#include "canopen/cob.h"
#include "canopen/pdo.h"
#include "canopen/sdo_abort.h"

static uint32_t read_hook(void *context, const struct od_entry *entry)
{
    struct fake_drive *drive = context;
    if (entry->index == 0x6061) {
        drive->values.modes_of_operation_display = drive->values.modes_of_operation;
    }
    return SDO_OK;
}

static const struct od_hooks hooks = {.read = read_hook};

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
    drive->following = follow;
    drive->target_counts = setpoint->target_counts;
    drive->setpoints++;
    (void)cia402_device_control(&drive->state, setpoint->controlword);
}

/* Setpoint k follows SYNC k, is latched at SYNC k+1 and reached at SYNC k+2. */
static int take_sync(struct fake_drive *drive, struct can_msg *out)
{
    if (cia402_device_action(&drive->state) == CIA402_FOLLOW) {
        drive->position_counts = drive->latched_counts;
        drive->latched_counts = drive->target_counts;
    } else {
        drive->latched_counts = drive->position_counts;
    }
    const struct pdo_actual actual = {.statusword = cia402_device_statusword(&drive->state),
                                      .position_counts = drive->position_counts};
    pdo_encode_actual(drive->node, &actual, out);
    return drive->mute ? 0 : 1;
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
    if (pdo_decode_setpoint(in, &setpoint) == drive->node) {
        take_setpoint(drive, &setpoint);
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
