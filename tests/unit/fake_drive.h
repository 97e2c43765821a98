/* SPDX-License-Identifier: MIT */
/*
 * fake_drive: an ideal CiA 402 drive for tests of the controller: the drive's dictionary and
 * protocol objects, a motor that is always where it is wanted two SYNCs later, and switches for
 * misbehaviour.
 */
#ifndef TESTS_UNIT_FAKE_DRIVE_H
#define TESTS_UNIT_FAKE_DRIVE_H

#include <stdbool.h>
#include <stdint.h>

#include "can/can_frame.h"
#include "canopen/cia402_device.h"
#include "canopen/nmt.h"
#include "canopen/od.h"
#include "canopen/sdo_server.h"
#include "od_drive.h"

struct fake_drive {
    struct od od;
    struct od_drive values;
    struct sdo_server server;
    struct nmt_slave nmt;
    struct cia402_device state;
    int32_t position_counts;
    int32_t latched_counts;     /* setpoint of the last SYNC, reached at the next one */
    int32_t target_counts;      /* last setpoint received */
    uint32_t setpoints;         /* received */
    uint32_t worst_step_counts; /* greatest difference between setpoints followed in a row */
    uint8_t node;
    bool following; /* the last setpoint was one to follow */
    bool mute;      /* sends no process data */
    bool dead;      /* neither hears nor speaks */
};

void fake_drive_init(struct fake_drive *drive, uint8_t node, int32_t position_counts);

/* Takes a frame from the bus. Returns how many answers are in out (at most 2). */
int fake_drive_receive(struct fake_drive *drive, const struct can_msg *in, struct can_msg out[2]);

/* Gives boot-up frame and SDO timeouts; 1 when *out is to be sent. */
int fake_drive_process(struct fake_drive *drive, uint32_t elapsed_us, struct can_msg *out);

#endif
