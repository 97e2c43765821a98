/* SPDX-License-Identifier: MIT */
#include "node/drive_node.h"

#include <string.h>

#include "canopen/cob.h"
#include "node/drive_node_private.h"

enum {
    SDO_TIMEOUT_US = 1000000,
    HISTORY = 8,
    NAP_US = 20000 /* a longer gap between two calls of process was this process sleeping */
};

void drive_node_send(const struct drive_node *node, const struct can_msg *frame)
{
    node->port.send(node->port.context, frame);
}

/* Communication objects and what hangs on them, as after power-on. */
static void drive_node_begin(struct drive_node *node)
{
    drive_node_od_fill(node);
    sdo_server_init(&node->sdo, &node->od, node->id, SDO_TIMEOUT_US, SDO_BLOCK_SEGMENTS_MAX);
    emcy_producer_init(&node->emcy, node->id, &node->values.error_register,
                       node->values.predefined_error_field,
                       &node->values.predefined_error_field_count, HISTORY);
    heartbeat_producer_init(&node->heartbeat, node->id);
    heartbeat_consumer_init_entry(&node->master, node->values.consumer_heartbeat_time[0]);
    sync_consumer_init(&node->sync, node->values.synchronous_counter_overflow_value);
    drive_node_pdo_begin(node);
}

static void drive_node_reset(void *context)
{
    struct drive_node *node = context;
    node->values = od_drive_defaults;
    cia402_device_init(&node->device);
    node->device.flags |= CIA402_STATUS_VOLTAGE | CIA402_STATUS_FOLLOWS;
    (void)cia402_device_ready(&node->device);
    axis_motion_hold(&node->axis);
    node->sync_lost = false;
    node->setpoint_fresh = false;
    drive_node_begin(node);
}

static void drive_node_reset_communication(void *context)
{
    struct drive_node *node = context;
    for (uint16_t i = 0; i < node->od.table->entry_count; i++) {
        const struct od_entry *entry = &node->od.table->entries[i];
        if (entry->index < 0x2000u && entry->size > 0) {
            memcpy(node->od.storage + entry->offset,
                   (const uint8_t *)&od_drive_defaults + entry->offset, entry->size);
        }
    }
    drive_node_begin(node);
}

/* A drive that leaves OPERATIONAL gets no setpoints any more. */
static void drive_node_changed(void *context, enum nmt_state state)
{
    struct drive_node *node = context;
    drive_node_pdo_rest(node);
    if (state != NMT_OPERATIONAL) {
        drive_node_stop_for(node, EMCY_COMMUNICATION);
        sync_consumer_init(&node->sync, node->values.synchronous_counter_overflow_value);
    }
}

const struct nmt_hooks drive_node_nmt_hooks = {
    .reset_node = drive_node_reset,
    .reset_communication = drive_node_reset_communication,
    .changed = drive_node_changed,
};

void drive_node_power_on(struct drive_node *node)
{
    nmt_slave_init(&node->nmt, node->id, &drive_node_nmt_hooks, node);
    drive_node_reset(node);
}

int drive_node_init(struct drive_node *node, uint8_t id, const struct drive_config *config,
                    int32_t position_counts, struct drive_node_port port)
{
    memset(node, 0, sizeof *node);
    node->id = id;
    node->port = port;
    const int error = axis_motion_init(&node->axis, config, position_counts);
    if (error != 0) {
        return error;
    }
    od_init(&node->od, &od_drive_table, &node->values, &drive_node_od_hooks, node);
    drive_node_power_on(node);
    return 0;
}

/* SYNC is back after the node ran by itself: its counter is the new beginning. */
static void drive_node_sync_back(struct drive_node *node)
{
    node->sync_lost = false;
    sync_consumer_init(&node->sync, node->values.synchronous_counter_overflow_value);
}

static void drive_node_sync(struct drive_node *node, const struct can_msg *in)
{
    if (node->sync_lost) {
        drive_node_sync_back(node);
    }
    const int periods = sync_consumer_receive(&node->sync, in);
    if (periods < 0) {
        return;
    }
    node->sync_seen = true;
    if (periods == 0) {
        node->values.simulation.repeated_syncs++;
    }
    for (int i = 1; i < periods; i++) {
        node->values.simulation.lost_syncs++;
        drive_node_step(node);
    }
    drive_node_pdo_report(node);
    if (periods > 0) {
        drive_node_pdo_latch(node);
        drive_node_step(node);
    }
}

void drive_node_receive(struct drive_node *node, const struct can_msg *in)
{
    struct can_msg out;
    if (node->silent) {
        return;
    }
    if (nmt_slave_receive(&node->nmt, in)) {
        return;
    }
    if (nmt_permits_pdo(node->nmt.state)) {
        if (in->id == COB_SYNC) {
            drive_node_sync(node, in);
        } else {
            drive_node_pdo_receive(node, in);
        }
    }
    if (nmt_permits_sdo(node->nmt.state) && sdo_server_wants(&node->sdo, in) &&
        sdo_server_receive(&node->sdo, in, &out) != 0) {
        drive_node_send(node, &out);
    }
    (void)heartbeat_consumer_receive(&node->master, in);
}

/* Without SYNC the axis goes by the wall clock until it has stopped. */
static void drive_node_own_clock(struct drive_node *node, uint32_t elapsed_us)
{
    node->own_us += elapsed_us;
    while (node->own_us >= node->axis.config.period_us) {
        node->own_us -= node->axis.config.period_us;
        drive_node_step(node);
    }
}

static bool drive_node_moves(const struct drive_node *node)
{
    const enum cia402_action action = cia402_device_action(&node->device);
    return action != CIA402_POWER_OFF && action != CIA402_HOLD;
}

static void drive_node_watch_sync(struct drive_node *node, uint32_t elapsed_us)
{
    const uint32_t counted_us = elapsed_us < NAP_US ? elapsed_us : NAP_US;
    node->silence_us = node->sync_seen ? 0 : node->silence_us + counted_us;
    node->sync_seen = false;
    if (node->sync_lost) {
        drive_node_own_clock(node, counted_us);
    } else if (!drive_node_moves(node)) {
        node->silence_us = 0;
    } else if (node->silence_us > 1000u * (uint32_t)node->values.simulation.sync_timeout) {
        node->sync_lost = true;
        node->own_us = 0;
        drive_node_stop_for(node, EMCY_SYNC_LOST);
    }
}

void drive_node_process(struct drive_node *node, uint32_t elapsed_us)
{
    struct can_msg out;
    if (node->silent) {
        axis_motion_hold(&node->axis);
        return;
    }
    if (nmt_slave_process(&node->nmt, &out) != 0) {
        drive_node_send(node, &out);
    }
    drive_node_watch_sync(node, elapsed_us);
    if (nmt_permits_pdo(node->nmt.state)) {
        drive_node_pdo_process(node, elapsed_us < NAP_US ? elapsed_us : NAP_US);
    }
    if (heartbeat_consumer_process(&node->master, elapsed_us) == HEARTBEAT_LOST) {
        drive_node_stop_for(node, EMCY_HEARTBEAT);
    }
    if (heartbeat_producer_process(&node->heartbeat, node->values.producer_heartbeat_time,
                                   node->nmt.state, elapsed_us, &out) != 0 &&
        !node->no_heartbeat) {
        drive_node_send(node, &out);
    }
    while (emcy_producer_process(&node->emcy, &out) != 0) {
        drive_node_send(node, &out);
    }
    for (uint32_t us = elapsed_us; sdo_server_process(&node->sdo, us, &out) != 0; us = 0) {
        drive_node_send(node, &out);
    }
}
