/* SPDX-License-Identifier: MIT */
/* Implements app/drives/drive_monitor.h: supervises heartbeats and emergency messages. Called by app/controller.c,
 * and by app/objects when 0x1016 is written. Main loop; takes the port's lock where it changes the machine. */
#include "app/drives/drive_monitor.h"

#include <stddef.h>

#include "canopen/cia402.h"
#include "canopen/cob.h"
#include "canopen/emcy.h"
#include "port/port.h"

static uint32_t time_of(uint8_t node, const uint32_t entries[AXES_MAX])
{
    for (uint8_t i = 0; i < AXES_MAX; ++i) {
        struct heartbeat_consumer entry;
        heartbeat_consumer_init_entry(&entry, entries[i]);
        if (entry.node == node && entry.time_us != 0u) {
            return entries[i] & 0xFFFFu;
        }
    }
    return DRIVE_MONITOR_HEARTBEAT_MS;
}

static bool is_drive(const struct config *config, uint8_t node)
{
    for (uint8_t i = 0; i < drive_configuration_nodes(config); ++i) {
        if (drive_configuration_node(config, i) == node) {
            return true;
        }
    }
    return false;
}

static void begin_others(struct drive_monitor *monitor, const struct config *config,
                         const uint32_t entries[AXES_MAX])
{
    monitor->other_count = 0;
    for (uint8_t i = 0; i < AXES_MAX; ++i) {
        struct heartbeat_consumer entry;
        heartbeat_consumer_init_entry(&entry, entries[i]);
        if (entry.node != 0u && entry.time_us != 0u && !is_drive(config, entry.node)) {
            monitor->others[monitor->other_count++] = entry;
        }
    }
}

void drive_monitor_begin(struct drive_monitor *monitor, const struct config *config,
                         const uint32_t entries[AXES_MAX])
{
    monitor->axis_count = config->axis_count;
    monitor->count = drive_configuration_nodes(config);
    for (uint8_t i = 0; i < monitor->count; ++i) {
        const uint8_t node = drive_configuration_node(config, i);
        heartbeat_consumer_init(&monitor->consumers[i], node, (uint16_t)time_of(node, entries));
    }
    begin_others(monitor, config, entries);
}

/* The zero of a drive counts as kept only while there is no gap in which it could have restarted. */
static void note_missing_heartbeats(struct drive_monitor *monitor, struct machine *machine,
                                    uint8_t i, uint32_t elapsed_us)
{
    const uint32_t time_us = monitor->consumers[i].time_us;
    const uint32_t zero_us = DRIVE_MONITOR_ZERO_MS * 1000u;
    const uint32_t limit_us = time_us < zero_us ? time_us : zero_us;
    if (monitor->without_us[i] <= limit_us) {
        monitor->without_us[i] += elapsed_us;
    }
    if (monitor->without_us[i] > limit_us) {
        port_lock();
        struct axis *axis = machine_axis(machine, monitor->consumers[i].node);
        if (axis != NULL) {
            axis->homed = false;
        }
        port_unlock();
    }
}

static bool is_heartbeat(const struct heartbeat_consumer *consumer, const struct can_msg *in)
{
    return in->id == COB_HEARTBEAT + consumer->node && in->len == 1u;
}

/* Drives that are off may come and go: they are found again. With power on it is a fault. */
static void gone(struct machine *machine, uint16_t code, uint8_t node, uint32_t detail)
{
    const bool boots = machine->state == MACHINE_BOOT;
    if (machine->state == MACHINE_OFF || (boots && machine->configured)) {
        machine_enter_boot(machine);
    } else if (!boots) {
        machine_raise(machine, code, node, detail);
    }
}

static void restarted(struct machine *machine, uint8_t node)
{
    struct axis *axis = machine_axis(machine, node);
    if (axis != NULL) {
        axis_restarted(axis);
        axis->homed = false; /* also where homing has ended since the frame was received */
    }
    if (machine->state == MACHINE_BOOT) { /* it has lost its configuration */
        machine_enter_boot(machine);
    } else {
        gone(machine, FAULT_REBOOTED, node, 0);
    }
}

static void take_event(struct machine *machine, const struct heartbeat_consumer *consumer,
                       enum heartbeat_event event)
{
    port_lock();
    if (event == HEARTBEAT_BOOTED) {
        restarted(machine, consumer->node);
    } else if (event == HEARTBEAT_LOST) {
        gone(machine, EMCY_HEARTBEAT, consumer->node, 0);
    }
    port_unlock();
}

static bool is_module(const struct drive_monitor *monitor, uint8_t i)
{
    return i >= monitor->axis_count;
}

/* The I/O module sends no TPDO that would show that it takes the outputs: the start command may have been lost, or a
 * boot-up message. So the time without OPERATIONAL is limited, from the end of BOOT on. */
static void supervise_module(struct drive_monitor *monitor, struct machine *machine,
                             const struct heartbeat_consumer *module, uint32_t elapsed_us)
{
    port_lock();
    if (machine->state == MACHINE_BOOT) {
        monitor->not_operational_us = 0;
    } else if (monitor->not_operational_us <= module->time_us) {
        monitor->not_operational_us += elapsed_us;
    } else {
        const bool present = module->presence == HEARTBEAT_PRESENT;
        gone(machine, EMCY_HEARTBEAT, module->node, present ? (uint32_t)module->state : 0u);
    }
    port_unlock();
}

/* The host does not supervise the machine any more. With drives off nothing has to be stopped. */
static void host_lost(struct machine *machine, uint8_t node)
{
    port_lock();
    if (machine->state != MACHINE_BOOT && machine->state != MACHINE_OFF) {
        machine_raise(machine, EMCY_HEARTBEAT, node, 0);
    }
    port_unlock();
}

static void take_others(struct drive_monitor *monitor, struct machine *machine,
                        const struct can_msg *in)
{
    for (uint8_t i = 0; i < monitor->other_count; ++i) {
        struct heartbeat_consumer *consumer = &monitor->others[i];
        const bool present = consumer->presence == HEARTBEAT_PRESENT;
        if (heartbeat_consumer_receive(consumer, in) == HEARTBEAT_BOOTED && present) {
            host_lost(machine, consumer->node);
        }
    }
}

void drive_monitor_receive(struct drive_monitor *monitor, struct machine *machine,
                           const struct can_msg *in)
{
    struct emcy emcy;
    const uint8_t node = emcy_decode(in, &emcy);
    if (node != 0u) {
        port_lock();
        machine_note_emergency(machine, node, emcy.code);
        port_unlock();
        return;
    }
    for (uint8_t i = 0; i < monitor->count; ++i) {
        struct heartbeat_consumer *consumer = &monitor->consumers[i];
        if (is_heartbeat(consumer, in)) {
            monitor->without_us[i] = 0;
        }
        take_event(machine, consumer, heartbeat_consumer_receive(consumer, in));
        if (is_heartbeat(consumer, in) && is_module(monitor, i) &&
            consumer->state == NMT_OPERATIONAL) {
            monitor->not_operational_us = 0;
        }
    }
    take_others(monitor, machine, in);
}

void drive_monitor_process(struct drive_monitor *monitor, struct machine *machine,
                           uint32_t elapsed_us)
{
    for (uint8_t i = 0; i < monitor->count; ++i) {
        struct heartbeat_consumer *consumer = &monitor->consumers[i];
        note_missing_heartbeats(monitor, machine, i, elapsed_us);
        take_event(machine, consumer, heartbeat_consumer_process(consumer, elapsed_us));
        if (is_module(monitor, i)) {
            supervise_module(monitor, machine, consumer, elapsed_us);
        }
    }
    for (uint8_t i = 0; i < monitor->other_count; ++i) {
        struct heartbeat_consumer *consumer = &monitor->others[i];
        if (heartbeat_consumer_process(consumer, elapsed_us) == HEARTBEAT_LOST) {
            host_lost(machine, consumer->node);
        }
    }
}
