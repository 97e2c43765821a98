/* SPDX-License-Identifier: MIT */
/* Implements app/controller_state.h (see there): what the parts of the controller need of the whole. Used by
 * firmware/app, except its folders. Main loop, outside the lock, which some functions take; controller_send waits while
 * the port has no room. Changes the controller, sends frames, and reports progress to the port (watchdog). */
#include "app/controller_state.h"

#include "port/port.h"

#define SEND_TRIES    40u  /* of a frame while the send queue of the port is full */
#define SEND_PAUSE_US 500u /* between two tries */

bool controller_configured(const struct controller *controller)
{
    return controller->configured.known && controller->configured.crc32 == controller->config.crc32;
}

bool controller_moving(const struct controller *controller)
{
    port_lock();
    const bool result = machine_moving(&controller->machine);
    port_unlock();
    return result;
}

void controller_send(const struct can_msg *message)
{
    for (unsigned i = 0; i < SEND_TRIES && port_can_send(message) != 0; ++i) {
        port_wait(SEND_PAUSE_US);
    }
}

void controller_start_itself(struct controller *controller)
{
    struct can_msg start;
    nmt_master_command(NMT_START, controller->node, &start);
    (void)nmt_slave_receive(&controller->nmt, &start);
}

void controller_heartbeat(struct controller *controller, uint32_t elapsed_us)
{
    struct can_msg out;
    if (controller->quiet_us > 0u && !controller_configured(controller)) {
        controller->quiet_us -=
            elapsed_us < controller->quiet_us ? elapsed_us : controller->quiet_us;
        return;
    }
    controller->quiet_us = 0;
    if (heartbeat_producer_process(&controller->heartbeat,
                                   controller->values.producer_heartbeat_time,
                                   controller->nmt.state, elapsed_us, &out)) {
        controller_send(&out);
        controller->quiet_us = controller->quiet_due ? CONTROLLER_QUIET_US : 0u;
        controller->quiet_due = false;
    }
}

/* The time of the work is no timeout of other nodes, because their frames have not been processed meanwhile. */
void controller_beat(void *self)
{
    struct controller *controller = self;
    const uint32_t now_us = port_time_us();
    controller_heartbeat(controller, now_us - controller->polled_us);
    controller->polled_us = now_us;
    port_progress();
}

static void set_checking(struct controller *controller, bool checks)
{
    port_lock();
    controller->checks_chunk = checks;
    controller->urgent = 0;
    port_unlock();
}

void controller_check_begins(struct controller *controller)
{
    set_checking(controller, true);
}

void controller_check_ends(struct controller *controller)
{
    set_checking(controller, false);
}
