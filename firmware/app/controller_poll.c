/* SPDX-License-Identifier: MIT */
/* The controller's mainline: one round of all protocol objects. */
#include "app/controller.h"

#include <stddef.h>

#include "canopen/cob.h"
#include "port/port.h"

/* The node is its own NMT master: it enters OPERATIONAL by itself, and obeys resets from outside
 * while its drives are off. */
static bool nmt_obeyed(struct controller *controller, const struct can_msg *in)
{
    const bool reset = in->len >= 2u && (in->data[0] == (uint8_t)NMT_RESET_NODE ||
                                         in->data[0] == (uint8_t)NMT_RESET_COMMUNICATION);
    port_lock();
    const bool idle = machine_configurable(&controller->machine);
    port_unlock();
    return reset && idle;
}

static void take_nmt(struct controller *controller, const struct can_msg *in)
{
    if (!nmt_obeyed(controller, in) || !nmt_slave_receive(&controller->nmt, in)) {
        return;
    }
    sdo_server_reset(&controller->server);
    port_lock();
    if (controller->machine.state == MACHINE_OFF) {
        machine_enter_boot(&controller->machine);
    }
    port_unlock();
}

/* One of the three asks at a time. */
static void take_answer(struct controller *controller, const struct can_msg *in)
{
    struct can_msg out;
    if (drive_boot_receive(&controller->boot, in, &out) != 0 ||
        homing_receive(&controller->homing, in, &out) != 0 ||
        drive_polling_receive(&controller->look, in, &out) != 0) {
        controller_send(&out);
    }
}

static void take_frame(struct controller *controller, const struct can_msg *in)
{
    struct can_msg out;
    if (in->id == 0u) {
        take_nmt(controller, in);
    } else if (sdo_server_wants(&controller->server, in)) {
        if (sdo_server_receive(&controller->server, in, &out) != 0) {
            controller_send(&out);
        }
    } else {
        take_answer(controller, in);
        drive_monitor_receive(&controller->watch, &controller->machine, in);
    }
}

static bool next_frame(struct controller *controller, struct can_msg *in)
{
    port_lock();
    machine_attend(&controller->machine);
    const bool got = frame_queue_take(&controller->queue, in);
    port_unlock();
    return got;
}

static void poll_heartbeat(struct controller *controller, uint32_t elapsed_us)
{
    struct can_msg out;
    if (heartbeat_producer_process(&controller->heartbeat,
                                   controller->values.producer_heartbeat_time,
                                   controller->nmt.state, elapsed_us, &out) != 0) {
        controller_send(&out);
    }
}

static void poll_nmt(struct controller *controller)
{
    struct can_msg out;
    if (nmt_slave_process(&controller->nmt, &out) != 0) {
        controller_send(&out);
        controller_start_itself(controller);
    }
}

static void poll_server(struct controller *controller, uint32_t elapsed_us)
{
    struct can_msg out;
    int due = sdo_server_process(&controller->server, elapsed_us, &out);
    while (due != 0) {
        controller_send(&out);
        due = sdo_server_process(&controller->server, 0, &out);
    }
}

static bool boot_requested(struct machine *machine)
{
    port_lock();
    const bool due = machine->boot_due;
    machine->boot_due = false;
    port_unlock();
    return due;
}

/* Of a drive that is about to be started: what it maps, and its inputs, since TPDO3 tells changes only. */
static void note_facts(struct controller *controller, const struct can_msg *command)
{
    if (command->id != COB_NMT || command->data[0] != (uint8_t)NMT_START) {
        return;
    }
    port_lock();
    struct axis *axis = machine_axis(&controller->machine, command->data[1]);
    if (axis != NULL) {
        const uint32_t i = (uint32_t)(axis - controller->machine.axes);
        const struct drive_properties *facts = &controller->boot.facts[i];
        axis->digital_inputs = facts->value[DRIVE_INPUTS];
        axis->torque_mapped = facts->known[DRIVE_TORQUE_MAPPED];
        axis->velocity_mapped = facts->known[DRIVE_VELOCITY_MAPPED];
        if (facts->known[DRIVE_POSITION]) {
            axis_found(axis, (int32_t)facts->value[DRIVE_POSITION],
                       MACHINE_KEPT_MM * controller->config.counts_per_mm);
        } else {
            axis->homed = false;
        }
    }
    port_unlock();
}

static void note_silence(struct controller *controller)
{
    port_lock();
    const uint8_t node = controller->machine.silent_node;
    port_unlock();
    drive_boot_silent(&controller->boot, node);
}

static void poll_boot(struct controller *controller, uint32_t elapsed_us)
{
    if (boot_requested(&controller->machine)) {
        port_tick_urgent(false);
        drive_boot_begin(&controller->boot, &controller->config);
        drive_monitor_begin(&controller->watch, &controller->config,
                            controller->values.consumer_heartbeat_time);
    }
    struct can_msg out;
    int due = drive_boot_process(&controller->boot, elapsed_us, &out);
    while (due != 0) {
        note_facts(controller, &out);
        controller_send(&out);
        due = drive_boot_process(&controller->boot, 0, &out);
    }
    if (drive_boot_finished(&controller->boot)) {
        port_tick_urgent(!controller->boot.simulated);
        port_lock();
        if (!controller->machine.boot_due) {
            machine_drives_configured(&controller->machine, controller->boot.simulated);
        }
        port_unlock();
    }
    note_silence(controller);
}

static void poll_homing(struct controller *controller, uint32_t elapsed_us)
{
    struct can_msg out;
    if (homing_process(&controller->homing, &controller->machine, elapsed_us, &out) != 0) {
        controller_send(&out);
    }
}

/* On the way out nothing is asked any more: an answer that comes behind the end would be taken for one to the next client. */
static void poll_look(struct controller *controller, uint32_t elapsed_us)
{
    port_lock();
    const bool found = controller->machine.state != MACHINE_BOOT;
    port_unlock();
    struct can_msg out;
    const bool allowed = found && !controller->ending && !homing_busy(&controller->homing);
    if (drive_polling_process(&controller->look, &controller->machine, controller->boot.facts,
                              allowed, elapsed_us, &out) != 0) {
        controller_send(&out);
    }
}

static uint32_t counted_us(uint32_t elapsed_us)
{
    return elapsed_us < CONTROLLER_ELAPSED_MAX_US ? elapsed_us : CONTROLLER_ELAPSED_MAX_US;
}

/* The time of the work counts for nobody else: what the others have sent meanwhile has not been looked at. */
void controller_beat(void *self)
{
    struct controller *controller = self;
    const uint32_t now_us = port_time_us();
    poll_heartbeat(controller, now_us - controller->polled_us);
    controller->polled_us = now_us;
}

void controller_poll(struct controller *controller)
{
    struct can_msg in;
    while (next_frame(controller, &in)) {
        take_frame(controller, &in);
    }
    const uint32_t now_us = port_time_us();
    const uint32_t elapsed_us = counted_us(now_us - controller->polled_us);
    controller->polled_us = now_us;
    poll_nmt(controller);
    poll_heartbeat(controller, elapsed_us);
    poll_server(controller, elapsed_us);
    poll_boot(controller, elapsed_us);
    poll_homing(controller, elapsed_us);
    poll_look(controller, elapsed_us);
    drive_monitor_process(&controller->watch, &controller->machine, elapsed_us);
    controller_report(controller);
}
