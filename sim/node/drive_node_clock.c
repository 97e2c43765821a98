/* SPDX-License-Identifier: MIT */
#include "node/drive_node_private.h"

/* SYNC is back after the node ran by itself: its counter is the new beginning. */
static void drive_node_sync_back(struct drive_node *node)
{
    node->sync_lost = false;
    sync_consumer_init(&node->sync, node->values.synchronous_counter_overflow_value);
}

void drive_node_sync(struct drive_node *node, const struct can_msg *in)
{
    if (!nmt_permits_sdo(node->nmt.state)) {
        return;
    }
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
    if (nmt_permits_pdo(node->nmt.state)) {
        drive_node_pdo_report(node);
    }
    if (periods > 0) {
        drive_node_pdo_latch(node);
        drive_node_step(node);
    }
}

void drive_node_own_clock(struct drive_node *node, uint32_t elapsed_us)
{
    node->own_us += elapsed_us;
    while (node->own_us >= node->axis.config.period_us) {
        node->own_us -= node->axis.config.period_us;
        drive_node_step(node);
    }
}

void drive_node_watch_sync(struct drive_node *node, uint32_t elapsed_us)
{
    node->silence_us = node->sync_seen ? 0 : node->silence_us + elapsed_us;
    node->sync_seen = false;
    if (node->sync_lost) {
        node->silence_us = 0;
        drive_node_own_clock(node, elapsed_us);
    } else if (node->nmt.state == NMT_STOPPED ||
               node->silence_us > 1000u * (uint32_t)node->values.simulation.sync_timeout) {
        node->sync_lost = true;
        node->own_us = 0;
        if (node->values.modes_of_operation_display == CIA402_MODE_CSP) {
            drive_node_disconnect(node, EMCY_SYNC_LOST);
        }
    }
}
