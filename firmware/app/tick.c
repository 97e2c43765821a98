/* SPDX-License-Identifier: MIT */
#include "app/tick.h"

#include <string.h>

#include "port/port.h"

#define SYNC_COUNTER_OVERFLOW 240u

void tick_init(struct tick *tick, struct machine *machine)
{
    tick->machine = machine;
    offsets_init(&tick->offsets);
    sync_producer_init(&tick->sync, SYNC_COUNTER_OVERFLOW);
}

static void send(struct machine *machine, const struct can_msg *message)
{
    if (port_can_send(message) != 0 && machine_moving(machine)) {
        machine->statistics.frames_not_sent++;
    }
}

/* First of all, so that the work of the tick does not move it about. */
static void send_sync(struct tick *tick)
{
    struct can_msg sync;
    sync_producer_next(&tick->sync, &sync);
    send(tick->machine, &sync);
    tick->machine->statistics.syncs++;
}

/* Axes that hold have none. */
static void find_offsets(struct tick *tick, struct feedforward_offset offset[AXES_MAX])
{
    const struct machine *machine = tick->machine;
    memset(offset, 0, AXES_MAX * sizeof offset[0]);
    if (machine->config.feedforward != 0u) {
        offsets_step(&tick->offsets, &machine->config,
                     machine_moving(machine) ? &machine->motion : NULL, offset);
    }
}

static void send_setpoints(struct machine *machine, const struct feedforward_offset *offset)
{
    const bool torque = (machine->config.feedforward & CONFIG_TORQUE_FEEDFORWARD) != 0u;
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        struct can_msg setpoint;
        axis_setpoint(&machine->axes[i], machine->config.start_tolerance_counts, &setpoint);
        if (torque) {
            pdo_add_torque(&setpoint, offset[i].torque_permille);
        }
        send(machine, &setpoint);
    }
}

static void send_velocities(struct machine *machine, const struct feedforward_offset *offset)
{
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        struct can_msg velocity;
        pdo_encode_velocity(machine->axes[i].node, offset[i].velocity_counts_s, &velocity);
        send(machine, &velocity);
    }
}

/* All positions first: they matter most on a bus that is full. */
static void send_process_data(struct tick *tick)
{
    struct machine *machine = tick->machine;
    struct feedforward_offset offset[AXES_MAX];
    find_offsets(tick, offset);
    if (!machine_drives_operational(machine)) {
        return;
    }
    send_setpoints(machine, offset);
    if ((machine->config.feedforward & CONFIG_VELOCITY_FEEDFORWARD) != 0u) {
        send_velocities(machine, offset);
    }
}

void tick_run(struct tick *tick, uint32_t now_us, uint32_t late_ns)
{
    struct machine *machine = tick->machine;
    const uint32_t started_ns = port_time_ns();
    send_sync(tick);
    machine_supervise(machine, now_us);
    machine_step(machine);
    send_process_data(tick);
    if (machine_awaits_drives(machine)) {
        port_tick_await(TICK_GUARD_US, machine_busy(machine));
    }
    if (machine_moving(machine)) {
        statistics_tick(&machine->statistics, late_ns, port_time_ns() - started_ns,
                        machine->config.period_us);
    }
}
