/* SPDX-License-Identifier: MIT */
/* drive_state: the state of a simulated drive, in one struct. Used by node/drive_od and node/drive_node, which begins
 * and runs it. Data only; the context of drive_node. No functions. */
#ifndef NODE_DRIVE_STATE_H
#define NODE_DRIVE_STATE_H

#include <stdbool.h>
#include <stdint.h>

#include "canopen/heartbeat.h"
#include "canopen/nmt.h"
#include "canopen/od.h"
#include "canopen/sdo_server.h"
#include "node/drive_pdos.h"
#include "node/equipment.h"
#include "node/servo.h"
#include "node/sync_clock.h"
#include "od_drive.h"

/* Contents private, except `values` (the object dictionary) and `servo`, which tests may read, `pdos` for the filters
 * of drives.c, and what injected faults change. Has pointers to itself: not to be copied. */
struct drive_node {
    struct od_drive values;
    struct od od;
    struct nmt_slave nmt;
    struct sdo_server sdo;
    struct heartbeat_producer heartbeat;
    struct heartbeat_consumer master;
    struct sync_clock clock;
    struct drive_pdos pdos;
    struct servo servo;
    struct drive_node_port port;
    double encoder_jump_mm;  /* injected fault: part of the encoder's error */
    bool master_seen;        /* a heartbeat of the master, since the last drive_node_process */
    bool without_power;      /* injected fault: receives and sends nothing */
    bool without_heartbeats; /* injected fault: sends none */
    uint8_t id;
};

#endif
