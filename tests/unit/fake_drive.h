/* SPDX-License-Identifier: MIT */
/*
 * fake_drive: an ideal CiA 402 drive for tests of the controller: the drive's dictionary and protocol objects, a motor
 * that always reaches its target two SYNCs later, and switches for misbehaviour. Used by app_bench and by harnesses of
 * tests/fuzz. One thread; no I/O.
 */
#ifndef TESTS_UNIT_FAKE_DRIVE_H
#define TESTS_UNIT_FAKE_DRIVE_H

#include <stdbool.h>
#include <stdint.h>

#include "can/can_frame.h"
#include "canopen/cia402_device.h"
#include "canopen/nmt.h"
#include "canopen/od.h"
#include "canopen/pdo.h"
#include "canopen/sdo_server.h"
#include "od_drive.h"

#define FAKE_DRIVE_WRITES 512u

/* A write by SDO that the drive took. */
struct fake_write {
    uint32_t object; /* index << 8 + sub */
    uint32_t value;
};

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
    bool following;            /* the last setpoint was one to follow */
    bool mute;                 /* sends no process data */
    int32_t velocity_counts_s; /* offsets received last */
    int16_t torque_permille;
    uint32_t velocities;   /* RPDO2 received */
    uint8_t setpoint_size; /* bytes of the last RPDO1 */
    uint32_t homing_syncs; /* how long it takes to find home: then its position is the offset */
    uint32_t homing_left;
    bool homing_fails;
    bool homed;          /* then it reports so whenever it is enabled in homing mode */
    uint32_t deaf;       /* so many of the next setpoint frames are lost */
    bool fixed_mapping;  /* PDO parameters are read-only */
    uint16_t lacks[8];   /* objects that it has not */
    uint32_t refuses;    /* object (index << 8 + sub) that takes no value */
    bool ordered_limits; /* 0x607D: refuses a minimum above the maximum */
    bool no_open_limits; /* 0x607D: takes no minimum of -2^31 */
    uint32_t unmappable; /* mapping entry that no PDO takes */
    int8_t mode_stuck;   /* mode that 0x6061 never leaves; 0: none */
    uint32_t reads;      /* of objects, by SDO */
    uint32_t write_count;
    struct fake_write writes[FAKE_DRIVE_WRITES];
    bool late;                 /* answers each SYNC only when the next one has come */
    bool held;                 /* such an answer waits */
    bool stuck;                /* its faults come back at once when they are reset */
    uint32_t drops;            /* so many of its next answers are lost */
    uint32_t quick_stop_syncs; /* how long a quick stop takes */
    uint32_t stopping_syncs;   /* how long it has taken */
    int32_t quick_stop_target; /* the target that came with the first quick stop command */
    uint32_t quick_stop_moved; /* quick stop commands with another target */
    int32_t place_before;      /* position at the last setpoint */
    uint32_t cut_moving;       /* power was taken from it (0x0000) while it moved */
    struct pdo_actual actual;  /* the answer that waits */
    bool silent_heart;         /* sends no heartbeats (the bench sends them) */
    bool dead;                 /* neither receives nor sends */
};

void fake_drive_init(struct fake_drive *drive, uint8_t node, int32_t position_counts);

/* How often the drive took a write of the object, and the number of the first one. */
uint32_t fake_drive_written(const struct fake_drive *drive, uint32_t object, uint32_t *first);

/* Takes a frame from the bus. Returns how many answers are in out (at most 2). */
int fake_drive_receive(struct fake_drive *drive, const struct can_msg *in, struct can_msg out[2]);

/* Gives boot-up frame and SDO timeouts; 1 when *out is to be sent. */
int fake_drive_process(struct fake_drive *drive, uint32_t elapsed_us, struct can_msg *out);

#endif
