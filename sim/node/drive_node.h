/* SPDX-License-Identifier: MIT */
/* drive_node: one simulated servo drive on the bus: CANopen slave, CiA 402 drive with the modes CSP
 * and homing, axis model. What each object does: docs/reference/protocol.md section 5.
 *
 * Time (docs/reference/protocol.md section 2): SYNC j finds the axis at the instant of SYNC j; the node reports it (its
 * synchronous TPDOs), latches the setpoint that came since SYNC j-1, and computes the period that follows. The SYNC
 * counter is the model's clock: a difference of n means n periods, so the result does not depend on the host's
 * scheduler. In PRE-OPERATIONAL time passes with SYNC too, without PDOs.
 *
 * If no SYNC comes for the time in 0x2101 sub 6, or the node is STOPPED, the wall clock replaces SYNC. For a drive
 * enabled in CSP that is an error: EMCY 0x8700, the reaction of 0x6007, and the run is marked as not reproducible
 * (0x2101 sub 5), until the drive is enabled again. Homing may continue.
 *
 * Used by node/drives and node/node_faults. Frames in, frames out through the port; no I/O, no heap. All functions in
 * one context.
 */
#ifndef NODE_DRIVE_NODE_H
#define NODE_DRIVE_NODE_H

#include <stdbool.h>
#include <stdint.h>

#include "can/can_frame.h"
#include "node/drive_state.h"

/* id: 1 ... 127. The first period is that of the configuration, until 0x1006 or 0x60C2 sets another one. Returns 0 or
 * an enum drive_error. The boot-up frame leaves with the first drive_node_process. */
int drive_node_init(struct drive_node *node, uint8_t id, const struct drive_config *config,
                    int32_t position_counts, struct drive_node_port port);

/* Other equipment than equipment_init gives; right after drive_node_init. Returns false, and nothing
 * changes, when a figure is out of range. */
bool drive_node_equip(struct drive_node *node, const struct equipment *equipment);

/* Power is back after a loss: all values as at power-on, the boot-up frame follows. */
void drive_node_power_on(struct drive_node *node);

/* A frame from the bus; ignores those for other nodes. */
void drive_node_receive(struct drive_node *node, const struct can_msg *in);

/* Lets wall time pass: boot-up, heartbeat, SDO timeouts, EMCY, PDO times, loss of SYNC. Call it at least every 20 ms. A
 * longer interval means that this process itself slept, so it counts as 20 ms in the timeouts of SYNC and PDOs. */
void drive_node_process(struct drive_node *node, uint32_t elapsed_us);

#endif
