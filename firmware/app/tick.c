/* SPDX-License-Identifier: MIT */
#include "app/tick.h"

#include "port/port.h"

#define SYNC_COUNTER_OVERFLOW 240u

void tick_init(struct tick *tick, struct machine *machine)
{
    tick->machine = machine;
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

static void send_setpoints(struct machine *machine)
{
    if (!machine_drives_operational(machine)) {
        return;
    }
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        struct can_msg setpoint;
        axis_setpoint(&machine->axes[i], machine->config.start_tolerance_counts, &setpoint);
        send(machine, &setpoint);
    }
}

void tick_run(struct tick *tick, uint32_t now_us, uint32_t late_ns)
{
    struct machine *machine = tick->machine;
    const uint32_t started_ns = port_time_ns();
    send_sync(tick);
    machine_supervise(machine, now_us);
    machine_step(machine);
    send_setpoints(machine);
    if (machine_awaits_drives(machine)) {
        port_tick_await(TICK_GUARD_US, machine_busy(machine));
    }
    if (machine_moving(machine)) {
        statistics_tick(&machine->statistics, late_ns, port_time_ns() - started_ns,
                        machine->config.period_us);
    }
}
