/* SPDX-License-Identifier: MIT */
/* drive_node: one simulated servo drive on the bus: CANopen slave, CiA 402 drive with the modes CSP
 * and homing, axis model. What each object does: docs/reference/protocol.md section 5.
 *
 * Time (docs/reference/protocol.md section 2): SYNC j finds the axis at the instant of SYNC j; the node
 * reports it (its synchronous TPDOs), latches the setpoint that came since SYNC j-1, and computes
 * the period that follows. The SYNC counter is the model's clock: a difference of n means n periods,
 * so the result does not depend on the host's scheduler. In PRE-OPERATIONAL time passes with SYNC
 * too, without PDOs.
 *
 * When SYNC stays away for the time in 0x2101 sub 6, or the node is STOPPED, it goes on by the wall
 * clock. If it was enabled in CSP that is an error: EMCY 0x8700, the reaction of 0x6007, and the run
 * is marked as not reproducible (0x2101 sub 5), until the drive is enabled again. Homing may go on.
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
#include "node/equipment.h"
#include "node/home_seek.h"
#include "od_drive.h"
#include "plant/overload.h"

#define DRIVE_NODE_PDOS 4 /* in each direction */

struct drive_node_port {
    void (*send)(void *context, const struct can_msg *frame);
    void *context;
};

/* Contents private, except `values` (the object dictionary), which tests may read, and what
 * drives.c needs for its filters: `rpdos`, `pdos_moved`. */
struct drive_node {
    struct od_drive values;
    struct od od;
    struct nmt_slave nmt;
    struct sdo_server sdo;
    struct emcy_producer emcy;
    struct heartbeat_producer heartbeat;
    struct heartbeat_consumer master;
    bool master_heard; /* since the last drive_node_process */
    struct sync_consumer sync;
    struct pdo_map rpdos[DRIVE_NODE_PDOS];
    struct pdo_map tpdos[DRIVE_NODE_PDOS];
    struct cia402_device device;
    struct axis_motion axis;
    struct equipment equipment;
    struct overload overload;
    struct home_seek homing;
    struct drive_node_port port;
    double load_per_volt;   /* motor load in units of the rated torque */
    double jump_mm;         /* node_fault.h: part of the encoder's error */
    int32_t homing_edge;    /* where home was passed */
    uint32_t forced_inputs; /* node_fault.h: switches that are on whatever the axis does */
    uint32_t silence_us;    /* without SYNC */
    uint32_t own_us;        /* own clock: time not yet turned into periods */
    uint32_t following_us;  /* following error out of its window */
    uint32_t settled_us;    /* a stop: at rest within the position window */
    uint32_t stopping_us;   /* a stop: since its ramp has ended */
    bool overloaded;
    bool braked;         /* a stop at the motor's limits: it has come to rest, and is held there */
    bool sync_seen;      /* since the last drive_node_process */
    bool sync_lost;      /* running on the own clock */
    bool setpoint_fresh; /* a target came since the last period */
    bool pdos_moved; /* the identifiers of RPDOs changed: for the owner's filters, who clears it */
    bool pdos_want_all; /* a TPDO maps more than what is always up to date */
    bool offsets_act;   /* the last period had a feedforward */
    bool homed;
    bool homing_asked;     /* bit 4 of the last controlword */
    bool limit_switch_hit; /* the present stop is because of it */
    bool software_limit;   /* the setpoint is outside 0x607D */
    bool encoder_failed;   /* node_fault.h, as the next three */
    bool supply_failed;
    bool silent;
    bool no_heartbeat;
    uint8_t rpdos_short; /* a bit for each RPDO whose last frame was too short */
    uint8_t rpdo_count;  /* PDOs in use: those above are off */
    uint8_t tpdo_count;
    uint8_t id;
};

/* id: 1 ... 127. The first period is that of the configuration, until 0x1006 or 0x60C2 says
 * otherwise. Returns 0 or an enum drive_error. The boot-up frame leaves with the first
 * drive_node_process. */
int drive_node_init(struct drive_node *node, uint8_t id, const struct drive_config *config,
                    int32_t position_counts, struct drive_node_port port);

/* Other equipment than equipment_init gives; right after drive_node_init. Returns false, and nothing
 * changes, when a figure is out of range. */
bool drive_node_equip(struct drive_node *node, const struct equipment *equipment);

/* A frame from the bus; others than this node's are ignored. */
void drive_node_receive(struct drive_node *node, const struct can_msg *in);

/* Lets wall time pass: boot-up, heartbeat, SDO timeouts, EMCY, PDO times, loss of SYNC. Call it at
 * least every 20 ms; an interval above that counts as 20 ms where silence is judged, since then it
 * was this process that slept. */
void drive_node_process(struct drive_node *node, uint32_t elapsed_us);

#endif
