/* SPDX-License-Identifier: MIT */
/* What the parts of drive_node share, by the file that has it. */
#ifndef NODE_DRIVE_NODE_PRIVATE_H
#define NODE_DRIVE_NODE_PRIVATE_H

#include "node/drive_node.h"

/* A gap between two calls of process above this was this process sleeping. */
#define DRIVE_NODE_NAP_US 20000u

extern const struct od_hooks drive_node_od_hooks;
extern const struct nmt_hooks drive_node_nmt_hooks;

/* drive_node.c */

/* Power is back after a loss: all values as at power-on, the boot-up frame follows. */
void drive_node_power_on(struct drive_node *node);
void drive_node_send(const struct drive_node *node, const struct can_msg *frame);

/* drive_node_clock.c: a SYNC; wall time; SYNC is not to be expected (NMT stopped). */
void drive_node_sync(struct drive_node *node, const struct can_msg *in);
void drive_node_watch_sync(struct drive_node *node, uint32_t elapsed_us);
void drive_node_own_clock(struct drive_node *node, uint32_t elapsed_us);

/* drive_node_od.c: values that follow from the model; fields that the bus can read, up to date:
 * all, or the few that each SYNC needs. */
void drive_node_od_fill(struct drive_node *node);
void drive_node_od_refresh(struct drive_node *node);
void drive_node_od_refresh_cyclic(struct drive_node *node);

/* drive_node_od_write.c: the od's hooks. */
uint32_t drive_node_od_write(void *context, const struct od_entry *entry, const uint8_t *value,
                             uint32_t size);
void drive_node_od_written(void *context, const struct od_entry *entry);

/* drive_node_scale.c: 0x608F, 0x6091, 0x6092; SDO_OK where the entry is none of them. */
uint32_t drive_node_scale_write(struct drive_node *node, const struct od_entry *entry,
                                uint32_t value);
double drive_node_scale_feed(const struct drive_node *node); /* counts a revolution */

/* drive_node_pdo.c: as after power-on; the od's hooks; a frame (true: it was an RPDO); at SYNC, first the report and then
 * the latch of what has come; and the times. _rest: on a change of the NMT state. */
void drive_node_pdo_begin(struct drive_node *node);
void drive_node_pdo_rest(struct drive_node *node);
uint32_t drive_node_pdo_write(const struct drive_node *node, const struct od_entry *entry,
                              const uint8_t *value, uint32_t size);
void drive_node_pdo_written(struct drive_node *node, const struct od_entry *entry);
bool drive_node_pdo_receive(struct drive_node *node, const struct can_msg *in);
void drive_node_pdo_report(struct drive_node *node);
void drive_node_pdo_latch(struct drive_node *node);
void drive_node_pdo_process(struct drive_node *node, uint32_t elapsed_us);

/* drive_node_motion.c: a controlword, from RPDO or SDO; one period of the axis, as state and mode
 * ask. */
void drive_node_control(struct drive_node *node, uint16_t controlword);
void drive_node_step(struct drive_node *node);

/* drive_node_stop.c: one period of a stop, which ends with cia402_device_stopped when the motor is
 * at rest; and: no stop now. */
void drive_node_stop(struct drive_node *node, uint32_t deceleration_counts_s2);

/* One period of the stop that an option code (0x605A, 0x605E; not 0) asks for: by a ramp, or at the motor's limits. */
void drive_node_stop_as(struct drive_node *node, int16_t option);
void drive_node_no_stop(struct drive_node *node);
bool drive_node_settled(const struct drive_node *node);

/* drive_node_mode.c: takes 0x6060 over into 0x6061 when the axis permits it; statusword bits 10 ...
 * 13 of the mode. */
bool drive_node_mode_may_change(const struct drive_node *node);
void drive_node_mode_take(struct drive_node *node);
uint16_t drive_node_mode_flags(const struct drive_node *node);

/* drive_node_homing.c: bit 4 of the controlword; one period; homing ends unfinished. */
void drive_node_homing_control(struct drive_node *node, bool asked);
void drive_node_homing_step(struct drive_node *node);
void drive_node_homing_leave(struct drive_node *node);
bool drive_node_homing_busy(const struct drive_node *node);

/* drive_node_watch.c: following error, overload, switches, after each period; whether the switch of
 * this direction is on. */
void drive_node_watch(struct drive_node *node);
void drive_node_inputs(struct drive_node *node);
bool drive_node_against_switch(const struct drive_node *node, int64_t change_counts);
bool drive_node_cause_persists(const struct drive_node *node);

/* drive_node_error.c: each with its EMCY.
 * To Fault as 0x605E says; the same without power at once; what 0x6007 says, when the drive is
 * enabled; a quick stop, when it is enabled; and all errors are gone. */
void drive_node_fail(struct drive_node *node, uint16_t code);
void drive_node_fail_powerless(struct drive_node *node, uint16_t code);
void drive_node_disconnect(struct drive_node *node, uint16_t code);
void drive_node_quick_stop(struct drive_node *node, uint16_t code, uint8_t detail);
void drive_node_forgive(struct drive_node *node);

#endif
