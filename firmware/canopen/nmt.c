/* SPDX-License-Identifier: MIT */
/* Implements canopen/nmt.h (see there): the NMT slave's state machine and the master's commands. Used by firmware/app,
 * canopen/heartbeat and sim/node. No I/O: the caller sends. */
#include "canopen/nmt.h"

#include <stddef.h>

#include "canopen/cob.h"

static const struct nmt_hooks no_hooks = {0};

void nmt_slave_init(struct nmt_slave *slave, uint8_t node, const struct nmt_hooks *hooks,
                    void *context)
{
    slave->hooks = hooks == NULL ? &no_hooks : hooks;
    slave->context = context;
    slave->state = NMT_INITIALISING;
    slave->reported = NMT_INITIALISING;
    slave->reset_due = 0;
    slave->node = node;
}

static bool execute(struct nmt_slave *slave, uint8_t command)
{
    switch (command) {
    case NMT_START:
        slave->state = NMT_OPERATIONAL;
        return true;
    case NMT_STOP:
        slave->state = NMT_STOPPED;
        return true;
    case NMT_ENTER_PRE_OPERATIONAL:
        slave->state = NMT_PRE_OPERATIONAL;
        return true;
    case NMT_RESET_NODE:
    case NMT_RESET_COMMUNICATION:
        slave->state = NMT_INITIALISING;
        slave->reset_due = command;
        return true;
    default:
        return false;
    }
}

bool nmt_slave_receive(struct nmt_slave *slave, const struct can_msg *in)
{
    if (in->id != COB_NMT || in->len != 2 || (in->data[1] != 0 && in->data[1] != slave->node)) {
        return false;
    }
    if (slave->state == NMT_INITIALISING &&
        (in->data[0] != NMT_RESET_NODE || slave->reset_due == 0)) {
        /* Not booted yet: only a node reset, which does more than a pending communication reset. */
        return false;
    }
    return execute(slave, in->data[0]);
}

static void carry_out_reset(struct nmt_slave *slave)
{
    uint8_t reset = slave->reset_due;

    slave->reset_due = 0;
    if (reset == NMT_RESET_NODE && slave->hooks->reset_node != NULL) {
        slave->hooks->reset_node(slave->context);
    }
    if (reset == NMT_RESET_COMMUNICATION && slave->hooks->reset_communication != NULL) {
        slave->hooks->reset_communication(slave->context);
    }
}

static void report_state(struct nmt_slave *slave)
{
    enum nmt_state state = slave->state;

    if (state != slave->reported) {
        slave->reported = state;
        if (slave->hooks->changed != NULL) {
            slave->hooks->changed(slave->context, state);
        }
    }
}

bool nmt_slave_process(struct nmt_slave *slave, struct can_msg *out)
{
    report_state(slave);
    if (slave->state != NMT_INITIALISING) {
        return false;
    }
    carry_out_reset(slave);
    cob_frame(out, COB_HEARTBEAT + slave->node, 1);
    slave->state = NMT_PRE_OPERATIONAL;
    report_state(slave);
    return true;
}

void nmt_slave_error(struct nmt_slave *slave, uint8_t behaviour)
{
    if (behaviour == (uint8_t)NMT_ERROR_PRE_OPERATIONAL && slave->state == NMT_OPERATIONAL) {
        slave->state = NMT_PRE_OPERATIONAL;
    }
    if (behaviour == (uint8_t)NMT_ERROR_STOPPED && slave->state != NMT_INITIALISING) {
        slave->state = NMT_STOPPED;
    }
}

bool nmt_permits_sdo(enum nmt_state state)
{
    return state == NMT_PRE_OPERATIONAL || state == NMT_OPERATIONAL;
}

bool nmt_permits_pdo(enum nmt_state state)
{
    return state == NMT_OPERATIONAL;
}

void nmt_master_command(enum nmt_command command, uint8_t node, struct can_msg *out)
{
    cob_frame(out, COB_NMT, 2);
    out->data[0] = (uint8_t)command;
    out->data[1] = node;
}
