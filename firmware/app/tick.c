/* SPDX-License-Identifier: MIT */
/* Implements app/tick.h: one period of the controller. Called by app/controller.c. Timer, once a period, under the
 * port's lock; tick_init in the main loop. Sends frames, and changes the tick and the machine. */
#include "app/tick.h"

#include <string.h>

#include "port/port.h"

#define SYNC_COUNTER_OVERFLOW 240u

void tick_init(struct tick *tick, struct machine *machine)
{
    tick->machine = machine;
    tick->refused = false;
    tick->setpoint_refused = false;
    offsets_init(&tick->offsets);
    outputs_init(&tick->outputs);
    sync_producer_init(&tick->sync, SYNC_COUNTER_OVERFLOW);
}

static void note_refused(struct tick *tick)
{
    tick->refused = true;
    if (machine_on_path(tick->machine)) {
        tick->machine->statistics.frames_not_sent++;
    }
}

static bool send(struct tick *tick, const struct can_msg *message)
{
    const bool sent = port_can_send(message) == 0;
    if (!sent) {
        note_refused(tick);
    }
    return sent;
}

/* Sent first, so that the time of a SYNC does not depend on the work of its tick. */
static bool send_sync(struct tick *tick)
{
    tick->machine->statistics.syncs++;
    return send(tick, sync_producer_next(&tick->sync));
}

/* If frames of the last tick still wait to be sent, a SYNC would overtake the setpoints among them, and the drives
 * would move the distance of two periods at the next SYNC. So this tick sends nothing, and the program clock is
 * paused. */
static enum machine_sync begin_sync(struct tick *tick)
{
    if (!port_can_delivered()) {
        note_refused(tick);
        return MACHINE_SYNC_WAITS;
    }
    return send_sync(tick) ? MACHINE_SYNC_SENT : MACHINE_SYNC_REFUSED;
}

/* Zero for axes that hold their position. */
static const struct feedforward_offset *find_offsets(struct tick *tick,
                                                     struct feedforward_offset offset[AXES_MAX])
{
    static const struct feedforward_offset none[AXES_MAX];
    const struct machine *machine = tick->machine;
    if (machine->config.feedforward == 0u) {
        return none;
    }
    offsets_step(&tick->offsets, &machine->config,
                 machine_on_path(machine) ? &machine->motion : NULL, offset);
    return offset;
}

static void send_setpoints(struct tick *tick, const struct feedforward_offset *offset)
{
    struct machine *machine = tick->machine;
    for (uint32_t i = 0; i < machine->config.axis_count; ++i) {
        struct axis *axis = &machine->axes[i];
        axis_setpoint(axis, config_tolerance_counts(&machine->config, i),
                      &machine->config.travel[i]);
        if (axis->torque_mapped) {
            axis->torque_offset_permille = offset[i].torque_permille;
            pdo_add_torque(&axis->setpoint, axis->torque_offset_permille);
        }
        if (send(tick, &axis->setpoint)) {
            axis_sent(axis);
        } else {
            tick->setpoint_refused = true;
        }
    }
}

static void send_velocities(struct tick *tick, const struct feedforward_offset *offset)
{
    struct machine *machine = tick->machine;
    for (uint32_t i = 0; i < machine->config.axis_count; ++i) {
        struct axis *axis = &machine->axes[i];
        struct can_msg velocity;
        if (axis->velocity_mapped) {
            axis->velocity_offset_counts_s = offset[i].velocity_counts_s;
            pdo_encode_velocity(axis->node, axis->velocity_offset_counts_s, &velocity);
            (void)send(tick, &velocity);
        }
    }
}

/* Sent after the setpoints: module and drives latch both at the next SYNC. */
static void send_outputs(struct tick *tick, bool synced)
{
    struct machine *machine = tick->machine;
    struct can_msg frame;
    outputs_step(&tick->outputs, machine, synced);
    if (machine_drives_operational(machine) &&
        outputs_due(&tick->outputs, &machine->config.outputs, &frame) && send(tick, &frame)) {
        outputs_sent(&tick->outputs);
    }
}

/* All positions first: they are the most important frames on a full bus. */
static void send_process_data(struct tick *tick)
{
    struct machine *machine = tick->machine;
    struct feedforward_offset found[AXES_MAX];
    const struct feedforward_offset *offset = find_offsets(tick, found);
    if (!machine_drives_operational(machine)) {
        return;
    }
    send_setpoints(tick, offset);
    if (offset == found) {
        send_velocities(tick, offset);
    }
}

/* The longest time that the port waits for answers of simulated drives. */
static uint32_t guard_us(const struct machine *machine)
{
    const uint32_t wait_us = machine_answer_wait_us(machine);
    return wait_us > machine->config.period_us ? wait_us : machine->config.period_us;
}

void tick_run(struct tick *tick, uint32_t now_us, uint32_t late_ns)
{
    struct machine *machine = tick->machine;
    const uint32_t started_ns = port_time_ns();
    tick->refused = false;
    tick->setpoint_refused = false;
    const enum machine_sync sync = begin_sync(tick);
    machine_note_sync(machine, now_us, sync);
    machine_supervise(machine, now_us);
    machine_step(machine);
    if (sync == MACHINE_SYNC_WAITS) {
        machine_note_waiting(machine, now_us);
    } else {
        send_process_data(tick);
        if (machine->config.outputs.node != 0u) {
            send_outputs(tick, sync == MACHINE_SYNC_SENT);
        }
        machine_note_sent(machine, (struct machine_sent){.sync = sync == MACHINE_SYNC_SENT,
                                                         .setpoints = !tick->setpoint_refused,
                                                         .all = !tick->refused});
    }
    if (machine_awaits_drives(machine)) {
        port_tick_await(guard_us(machine), machine_busy(machine));
    }
    if (machine_on_path(machine)) {
        statistics_tick(&machine->statistics, late_ns, port_time_ns() - started_ns,
                        machine->config.period_us);
    }
}
