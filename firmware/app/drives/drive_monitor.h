/* SPDX-License-Identifier: MIT */
/*
 * drive_monitor: supervises heartbeats and emergency messages of the drives and of the I/O module, and heartbeats of
 * the host, if 0x1016 names its node. In BOOT and OFF a drive or I/O module that is lost or restarts leads the machine
 * back to BOOT, and the host changes nothing. In all other states each is a fault.
 *
 * An I/O module that is not OPERATIONAL for its consumer time, as after a lost start command, counts as lost.
 *
 * A drive without heartbeats for DRIVE_MONITOR_ZERO_MS (its consumer time, if that is shorter) may have been switched
 * off and on while its boot-up message was lost. Its axis then counts as not homed, in every state.
 *
 * Called by app/controller.c, and by app/objects when 0x1016 is written. Main loop; takes the port's lock where it
 * changes the machine.
 */
#ifndef APP_DRIVES_DRIVE_MONITOR_H
#define APP_DRIVES_DRIVE_MONITOR_H

#include <stdint.h>

#include "app/drives/drive_configuration.h"
#include "app/machine/machine.h"
#include "canopen/heartbeat.h"

/* Consumer time of a drive that has no entry in 0x1016; the drives send ten times as often. */
#define DRIVE_MONITOR_HEARTBEAT_MS 1000u

/* After this time without a heartbeat the zero of the axis is lost. The drives send five times as often. */
#define DRIVE_MONITOR_ZERO_MS 500u

struct drive_monitor {
    struct heartbeat_consumer consumers[DRIVE_NODES];
    struct heartbeat_consumer others[AXES_MAX]; /* nodes in 0x1016 that are not drives: a host */
    uint32_t without_us[DRIVE_NODES]; /* since the last heartbeat; a new begin does not reset it */
    uint32_t not_operational_us; /* I/O module: since its last heartbeat in OPERATIONAL, or BOOT */
    uint8_t axis_count;
    uint8_t count; /* with the I/O module */
    uint8_t other_count;
};

/* Begins to supervise the drives of the configuration, each from its first heartbeat on. `entries` as in 0x1016: bits
 * 16 ... 23 node, 0 ... 15 time in ms. Other nodes in it are supervised in the same way: it is a fault with a path stop
 * if one stops sending, or restarts, while drives are on. */
void drive_monitor_begin(struct drive_monitor *monitor, const struct config *config,
                         const uint32_t entries[AXES_MAX]);

/* Takes any frame of the bus. A restart or an error of a drive raises a fault, or starts BOOT. */
void drive_monitor_receive(struct drive_monitor *monitor, struct machine *machine,
                           const struct can_msg *in);

/* To be called in each round of the main loop. A drive without heartbeats raises a fault, or starts BOOT. */
void drive_monitor_process(struct drive_monitor *monitor, struct machine *machine,
                           uint32_t elapsed_us);

#endif
