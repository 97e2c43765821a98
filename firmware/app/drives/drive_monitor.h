/* SPDX-License-Identifier: MIT */
/*
 * drive_monitor: heartbeats and emergency messages of the drives and of the I/O module, and heartbeats of the host where
 * 0x1016 names its node.
 *
 * A drive that has sent no heartbeat for a while may have been switched off and on, and its boot-up message may be lost. Its
 * axis then is no longer homed, also while the drive is looked for.
 *
 * Main loop; takes the port's lock where it touches the machine.
 */
#ifndef APP_DRIVES_DRIVE_MONITOR_H
#define APP_DRIVES_DRIVE_MONITOR_H

#include <stdint.h>

#include "app/drives/drive_configuration.h"
#include "app/machine/machine.h"
#include "canopen/heartbeat.h"

/* Consumer time of a drive that has no entry in 0x1016; the drives send ten times as often. */
#define DRIVE_MONITOR_HEARTBEAT_MS 1000u

/* A drive that has sent nothing for so long may have been off and on again, with its boot-up message lost; its
 * heartbeats come five times as often. */
#define DRIVE_MONITOR_ZERO_MS 500u

struct drive_monitor {
    struct heartbeat_consumer consumers[DRIVE_NODES];
    struct heartbeat_consumer others[AXES_MAX]; /* nodes in 0x1016 that are no drives: a host */
    uint32_t silent_us[DRIVE_NODES]; /* since the last heartbeat, whatever has begun anew since */
    uint8_t count;
    uint8_t other_count;
};

/* Begins to watch the drives of the configuration, all unknown: each from its first heartbeat on. `entries` as in
 * 0x1016: bits 16 ... 23 node, 0 ... 15 time in ms. Other nodes in it are watched as well, likewise from their first
 * heartbeat on: one that stops sending, or restarts, while drives are on is a fault, and the axes come to rest. */
void drive_monitor_begin(struct drive_monitor *watch, const struct config *config,
                         const uint32_t entries[AXES_MAX]);

/* Takes any frame. A drive that restarts, or reports an error, makes a fault or a new boot. */
void drive_monitor_receive(struct drive_monitor *watch, struct machine *machine,
                           const struct can_msg *in);

/* Lets time pass. A drive that has stopped sending makes a fault or a new boot. */
void drive_monitor_process(struct drive_monitor *watch, struct machine *machine,
                           uint32_t elapsed_us);

#endif
