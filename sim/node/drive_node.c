/* SPDX-License-Identifier: MIT */
#include "node/drive_node.h"

#include <string.h>

#include "canopen/cob.h"
#include "node/drive_node_private.h"

enum { SDO_TIMEOUT_US = 1000000, HISTORY = 8 };

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

/* The motor, if it moves, runs out on its brake in the periods that follow. */
static void drive_node_reset(void *context)
{
    struct drive_node *node = context;
    node->values = od_drive_defaults;
    cia402_device_init(&node->device);
    (void)cia402_device_ready(&node->device);
    (void)axis_motion_set_scale(&node->axis, 0.0);
    axis_motion_offsets(&node->axis, 0, 0);
    drive_node_homing_leave(node);
    node->silence_us = 0;
    node->following_us = 0;
    node->sync_lost = false;
    node->setpoint_fresh = false;
    node->limit_switch_hit = false;
    node->software_limit = false;
    drive_node_no_stop(node);
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

/* A drive that leaves OPERATIONAL gets no setpoints any more; a stopped one no SYNC either. */
static void drive_node_changed(void *context, enum nmt_state state)
{
    struct drive_node *node = context;
    drive_node_pdo_rest(node);
    if (state != NMT_OPERATIONAL) {
        drive_node_disconnect(node, EMCY_COMMUNICATION);
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

bool drive_node_equip(struct drive_node *node, const struct equipment *equipment)
{
    if (!equipment_ok(equipment)) {
        return false;
    }
    const struct drive_plant *plant = &node->axis.config.plant;
    const double rated_volts = equipment->rated_torque_nm * plant->torque_to_volts;
    node->equipment = *equipment;
    node->axis.rated_torque_nm = equipment->rated_torque_nm;
    node->axis.brake_volts = equipment->brake_volts;
    node->axis.influence.friction_volts = equipment->friction_volts;
    node->load_per_volt = 1.0 / rated_volts;
    overload_init(&node->overload, plant->volts_limit / rated_volts, equipment->overload_s);
    drive_node_od_fill(node);
    return true;
}

int drive_node_init(struct drive_node *node, uint8_t id, const struct drive_config *config,
                    int32_t position_counts, struct drive_node_port port)
{
    struct equipment equipment;
    memset(node, 0, sizeof *node);
    node->id = id;
    node->port = port;
    const int error = axis_motion_init(&node->axis, config, position_counts);
    if (error != 0) {
        return error;
    }
    equipment_init(&equipment, config);
    (void)drive_node_equip(node, &equipment);
    od_init(&node->od, &od_drive_table, &node->values, &drive_node_od_hooks, node);
    drive_node_power_on(node);
    return 0;
}

void drive_node_receive(struct drive_node *node, const struct can_msg *in)
{
    struct can_msg out;
    if (node->silent || nmt_slave_receive(&node->nmt, in)) {
        return;
    }
    if (in->id == COB_SYNC) {
        drive_node_sync(node, in);
        return;
    }
    if (nmt_permits_pdo(node->nmt.state) && drive_node_pdo_receive(node, in)) {
        return;
    }
    if (nmt_permits_sdo(node->nmt.state) && sdo_server_wants(&node->sdo, in) &&
        sdo_server_receive(&node->sdo, in, &out) != 0) {
        drive_node_send(node, &out);
    }
    (void)heartbeat_consumer_receive(&node->master, in);
    if (in->id == COB_HEARTBEAT + (uint32_t)node->master.node) {
        node->master_heard = true;
    }
}

/* What has passed since the last call may lie before a heartbeat that came meanwhile: it is no silence then. */
static void drive_node_watch_master(struct drive_node *node, uint32_t elapsed_us)
{
    const uint32_t silent_us = node->master_heard ? 0u : elapsed_us;
    node->master_heard = false;
    if (heartbeat_consumer_process(&node->master, silent_us) == HEARTBEAT_LOST) {
        drive_node_disconnect(node, EMCY_HEARTBEAT);
        nmt_slave_error(&node->nmt, node->values.error_behaviour[0]);
    }
}

void drive_node_process(struct drive_node *node, uint32_t elapsed_us)
{
    const uint32_t awake_us = elapsed_us < DRIVE_NODE_NAP_US ? elapsed_us : DRIVE_NODE_NAP_US;
    struct can_msg out;
    if (node->silent) {
        drive_node_own_clock(node, awake_us);
        return;
    }
    if (nmt_slave_process(&node->nmt, &out) != 0) {
        drive_node_send(node, &out);
    }
    drive_node_watch_sync(node, awake_us);
    if (nmt_permits_pdo(node->nmt.state)) {
        drive_node_pdo_process(node, awake_us);
    }
    drive_node_watch_master(node, elapsed_us);
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
