/* SPDX-License-Identifier: MIT */
/* drive_node: one simulated servo drive on the bus: CANopen slave, CiA 402 drive in CSP mode, axis
 * model.
 *
 * Time (docs/protocol.md section 2): SYNC j finds the axis at the instant of SYNC j; the node
 * reports it (TPDO1, TPDO2), latches the setpoint that came since SYNC j-1, and computes the period
 * that follows. The SYNC counter is the model's clock: a difference of n means n periods, so the
 * result does not depend on the host's scheduler. While the drive is not enabled the axis is
 * braked.
 *
 * When SYNC stays away for the time in 0x2101 sub 6 while the drive is enabled, the node goes on by
 * the wall clock, makes a quick stop, sends EMCY 0x8700 and marks the run as not reproducible
 * (0x2101 sub 5), until it is enabled again.
 *
 * Frames in, frames out through the port; no I/O, no heap. All functions in one context.
 */
#ifndef NODE_DRIVE_NODE_H
#define NODE_DRIVE_NODE_H

#include <stdbool.h>
#include <stdint.h>

#include "can/can_frame.h"
#include "canopen/cia402_device.h"
#include "canopen/emcy.h"
#include "canopen/heartbeat.h"
#include "canopen/nmt.h"
#include "canopen/od.h"
#include "canopen/pdo_map.h"
#include "canopen/sdo_server.h"
#include "canopen/sync.h"
#include "node/axis_motion.h"
#include "od_drive.h"

#define DRIVE_NODE_PDOS 4 /* in each direction */

struct drive_node_port {
    void (*send)(void *context, const struct can_msg *frame);
    void *context;
};

/* Contents private, except `values` (the object dictionary), which tests may read. */
struct drive_node {
    struct od_drive values;
    struct od od;
    struct nmt_slave nmt;
    struct sdo_server sdo;
    struct emcy_producer emcy;
    struct heartbeat_producer heartbeat;
    struct heartbeat_consumer master;
    struct sync_consumer sync;
    struct pdo_map rpdos[DRIVE_NODE_PDOS];
    struct pdo_map tpdos[DRIVE_NODE_PDOS];
    struct cia402_device device;
    struct axis_motion axis;
    struct drive_node_port port;
    uint32_t silence_us; /* without SYNC */
    uint32_t own_us;     /* own clock: time not yet turned into periods */
    bool sync_seen;      /* since the last drive_node_process */
    bool sync_lost;      /* running on the own clock */
    bool setpoint_fresh; /* a target came since the last period */
    bool pdos_moved; /* the identifiers of RPDOs changed: for the owner's filters, who clears it */
    bool pdos_want_all; /* a TPDO maps more than what is always up to date */
    bool silent;        /* as without power: node_fault.h */
    bool no_heartbeat;  /* node_fault.h */
    uint8_t id;
};

/* id: 1 ... 127. The first period is 1 ms, until 0x1006 or 0x60C2 says otherwise. Returns 0 or an
 * enum drive_error. The boot-up frame leaves with the first drive_node_process. */
int drive_node_init(struct drive_node *node, uint8_t id, const struct drive_config *config,
                    int32_t position_counts, struct drive_node_port port);

/* A frame from the bus; others than this node's are ignored. */
void drive_node_receive(struct drive_node *node, const struct can_msg *in);

/* Lets wall time pass: boot-up, heartbeat, SDO timeouts, EMCY, loss of SYNC. Call it at least every
 * 20 ms; an interval above that counts as 20 ms for the loss of SYNC, since then it was this
 * process that slept. */
void drive_node_process(struct drive_node *node, uint32_t elapsed_us);

#endif
