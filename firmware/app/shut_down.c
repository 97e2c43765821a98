/* SPDX-License-Identifier: MIT */
/* The way out: stop along the path, switch off, leave the drives pre-operational. */
#include "app/commands.h"
#include "app/controller.h"

#include "port/port.h"

#define OFF_TIME_US        1000000u
#define STOP_BOUND_MOST_US 60000000u

static bool at_rest(const struct machine *machine)
{
    return !machine_moving(machine);
}

static bool switched_off(const struct machine *machine)
{
    if (machine->state == MACHINE_BOOT) {
        return true;
    }
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        const struct axis *axis = &machine->axes[i];
        if (!axis_left(axis)) {
            return false;
        }
    }
    return true;
}

static bool reached_now(struct controller *controller, bool (*reached)(const struct machine *))
{
    port_lock();
    const bool done = reached(&controller->machine);
    port_unlock();
    return done;
}

/* Goes on with the mainline until it is so or the time is over, or, where that counts, somebody insists. */
static bool wait_until(struct controller *controller, bool (*reached)(const struct machine *),
                       uint32_t time_us, bool until_insisted)
{
    const uint32_t began_us = port_time_us();
    for (;;) {
        const bool done = reached_now(controller, reached);
        const bool insisted = until_insisted && port_stop_insisted();
        if (done || insisted || port_time_us() - began_us > time_us) {
            return done;
        }
        port_wait(CONTROLLER_POLL_US);
        controller_poll(controller);
    }
}

static void leave_pre_operational(const struct controller *controller)
{
    for (uint8_t i = 0; i < controller->config.axis_count; ++i) {
        struct can_msg command;
        nmt_master_command(NMT_ENTER_PRE_OPERATIONAL, controller->config.node[i], &command);
        controller_send(&command);
    }
}

/* As long as the machine itself gives its quick stops, which then end in one way or another. */
static uint32_t quick_time_us(const struct controller *controller)
{
    return (MACHINE_QUICK_TICKS + AXIS_STANDSTILL_SYNCS) * controller->config.period_us;
}

/* The machine itself gives a stop up at its deadline, a fifth beyond its bound, or, near the end of a program, beyond twice
 * that at most; then the axes settle and arrive. This is for a machine whose ticks do not come. */
static uint32_t path_time_us(const struct controller *controller)
{
    const struct program_slot *slot = &controller->slot;
    const uint32_t told_us = slot->present ? slot->program.header.hold_worst_us : 0u;
    const uint32_t bound_us = told_us < STOP_BOUND_MOST_US ? told_us : STOP_BOUND_MOST_US;
    return 3u * bound_us + (MACHINE_SETTLE_TICKS + MACHINE_ARRIVE_TICKS + AXIS_STANDSTILL_SYNCS) *
                               controller->config.period_us;
}

/* Where the path is not left in time, or somebody insists, the drives stop by their own ramps. */
static bool come_to_rest(struct controller *controller)
{
    (void)commands_execute(controller, COMMAND_STOP);
    if (wait_until(controller, at_rest, path_time_us(controller), true)) {
        return true;
    }
    (void)commands_execute(controller, COMMAND_QUICK_STOP);
    return wait_until(controller, at_rest, quick_time_us(controller), false);
}

bool controller_shut_down(struct controller *controller)
{
    controller->ending = true;
    const bool stopped = come_to_rest(controller);
    (void)commands_execute(controller, COMMAND_DISABLE);
    (void)wait_until(controller, at_rest, quick_time_us(controller), false);
    const bool off = wait_until(controller, switched_off, OFF_TIME_US, false);
    leave_pre_operational(controller);
    return stopped && off;
}
