/* SPDX-License-Identifier: MIT */
/* The way out: stop along the path, switch off, leave the drives pre-operational. */
#include "app/commands.h"
#include "app/controller.h"

#include "port/port.h"

#define STOP_TIME_US 5000000u
#define OFF_TIME_US  1000000u

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

/* Goes on with the mainline until it is so or the time is over. */
static bool wait_until(struct controller *controller, bool (*reached)(const struct machine *),
                       uint32_t time_us)
{
    const uint32_t began_us = port_time_us();
    for (;;) {
        port_lock();
        const bool done = reached(&controller->machine);
        port_unlock();
        if (done || port_time_us() - began_us > time_us) {
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

bool controller_shut_down(struct controller *controller)
{
    (void)commands_execute(controller, COMMAND_STOP);
    const bool stopped = wait_until(controller, at_rest, STOP_TIME_US);
    if (!stopped) {
        port_lock();
        machine_raise(&controller->machine, EMCY_SOFTWARE, controller->node, 0);
        machine_switch_off(&controller->machine);
        port_unlock();
    } else {
        (void)commands_execute(controller, COMMAND_DISABLE);
    }
    const bool off = wait_until(controller, switched_off, OFF_TIME_US);
    leave_pre_operational(controller);
    return stopped && off;
}
