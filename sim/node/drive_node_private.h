/* SPDX-License-Identifier: MIT */
/* What the parts of drive_node share: the object dictionary's hooks (drive_node_od.c), the motion
 * of a period (drive_node_motion.c) and the frames (drive_node.c). */
#ifndef NODE_DRIVE_NODE_PRIVATE_H
#define NODE_DRIVE_NODE_PRIVATE_H

#include "node/drive_node.h"

extern const struct od_hooks drive_node_od_hooks;
extern const struct nmt_hooks drive_node_nmt_hooks;

/* Values that follow from the model's configuration. */
void drive_node_od_fill(struct drive_node *node);

/* Brings all fields that the bus can read up to date; _cyclic: the few that each SYNC needs. */
void drive_node_od_refresh(struct drive_node *node);
void drive_node_od_refresh_cyclic(struct drive_node *node);

void drive_node_send(const struct drive_node *node, const struct can_msg *frame);

/* The PDOs (drive_node_pdo.c): as after power-on; the od's hooks; a frame; at SYNC, first the report
 * and then the latch of what has come; and the times. _rest: on a change of the NMT state. */
void drive_node_pdo_begin(struct drive_node *node);
void drive_node_pdo_rest(struct drive_node *node);
uint32_t drive_node_pdo_write(const struct drive_node *node, const struct od_entry *entry,
                              const uint8_t *value, uint32_t size);
void drive_node_pdo_written(struct drive_node *node, const struct od_entry *entry);
void drive_node_pdo_receive(struct drive_node *node, const struct can_msg *in);
void drive_node_pdo_report(struct drive_node *node);
void drive_node_pdo_latch(struct drive_node *node);
void drive_node_pdo_process(struct drive_node *node, uint32_t elapsed_us);

/* A controlword, from RPDO1 or SDO. */
void drive_node_control(struct drive_node *node, uint16_t controlword);

/* One period of the axis, as the state asks. */
void drive_node_step(struct drive_node *node);

/* Quick stop because of `code`, an EMCY code, with its EMCY; nothing when the drive is not enabled.
 */
void drive_node_stop_for(struct drive_node *node, uint16_t code);

/* Power is back after a loss: all values as at power-on, the boot-up frame follows. */
void drive_node_power_on(struct drive_node *node);

/* To Fault with this EMCY code, as 0x605E says; nothing when the drive is in Fault already. */
void drive_node_fail(struct drive_node *node, uint16_t code);

#endif
