/* SPDX-License-Identifier: MIT */
/* Implements node/drive_node.h (see there): one simulated servo drive on the bus. Used by node/drives and
 * node/node_faults. All functions in one context. Changes the node, and sends frames through its port; no other I/O. */
#include "node/drive_node.h"

#include <string.h>

#include "canopen/cob.h"
#include "node/drive_od.h"

/* A gap between two calls of process above SLEEP_US was this process sleeping. */
enum { SDO_TIMEOUT_US = 1000000, SLEEP_US = 20000 };

static void send(const struct drive_node *node, const struct can_msg *frame)
{
    node->port.send(node->port.context, frame);
}

/* ---- power-on and NMT ---- */

/* Communication objects and the services that depend on them, as after power-on. */
static void begin_communication(struct drive_node *node)
{
    drive_od_fill(node);
    sdo_server_init(&node->sdo, &node->od, node->id, SDO_TIMEOUT_US, SDO_BLOCK_SEGMENTS_MAX);
    drive_errors_init(&node->servo.errors, node->id, &node->values);
    heartbeat_producer_init(&node->heartbeat, node->id);
    heartbeat_consumer_init_entry(&node->master, node->values.consumer_heartbeat_time[0]);
    sync_clock_reset_counter(&node->clock, node->values.synchronous_counter_overflow_value);
    drive_pdos_init(&node->pdos, &node->od, &node->servo, node->port);
}

static void reset_node(void *context)
{
    struct drive_node *node = context;
    node->values = od_drive_defaults;
    servo_power_on(&node->servo);
    sync_clock_await(&node->clock);
    begin_communication(node);
    servo_check_causes(&node->servo);
}

static void reset_communication(void *context)
{
    struct drive_node *node = context;
    drive_od_reset_communication(node);
    begin_communication(node);
}

/* A drive that leaves OPERATIONAL gets no setpoints any more; a stopped one no SYNC either. */
static void change_state(void *context, enum nmt_state state)
{
    struct drive_node *node = context;
    drive_pdos_restart(&node->pdos);
    if (state != NMT_OPERATIONAL) {
        servo_disconnect(&node->servo, EMCY_COMMUNICATION);
        sync_clock_reset_counter(&node->clock, node->values.synchronous_counter_overflow_value);
    }
}

static const struct nmt_hooks nmt_hooks = {
    .reset_node = reset_node,
    .reset_communication = reset_communication,
    .changed = change_state,
};

void drive_node_power_on(struct drive_node *node)
{
    nmt_slave_init(&node->nmt, node->id, &nmt_hooks, node);
    reset_node(node);
}

bool drive_node_equip(struct drive_node *node, const struct equipment *equipment)
{
    if (!equipment_ok(equipment)) {
        return false;
    }
    servo_equip(&node->servo, equipment);
    drive_od_fill(node);
    return true;
}

int drive_node_init(struct drive_node *node, uint8_t id, const struct drive_config *config,
                    int32_t position_counts, struct drive_node_port port)
{
    memset(node, 0, sizeof *node);
    node->id = id;
    node->port = port;
    const int error = servo_init(&node->servo, config, position_counts, &node->values);
    if (error != 0) {
        return error;
    }
    od_init(&node->od, &od_drive_table, &node->values, &drive_od_hooks, node);
    drive_node_power_on(node);
    return 0;
}

/* ---- time ---- */

/* Enabling the drive restarts the timeout of SYNC. */
static void follow_enabling(struct drive_node *node)
{
    if (node->servo.enabled_now) {
        node->servo.enabled_now = false;
        sync_clock_await(&node->clock);
    }
}

static void receive_sync(struct drive_node *node, const struct can_msg *in)
{
    if (!nmt_permits_sdo(node->nmt.state)) {
        return;
    }
    follow_enabling(node);
    const int periods =
        sync_clock_receive(&node->clock, in, node->values.synchronous_counter_overflow_value);
    if (periods < 0) {
        return;
    }
    if (periods == 0) {
        node->values.simulation.repeated_syncs++;
    }
    for (int i = 1; i < periods; i++) {
        node->values.simulation.lost_syncs++;
        servo_step(&node->servo);
    }
    if (nmt_permits_pdo(node->nmt.state)) {
        drive_pdos_report(&node->pdos);
    }
    if (periods > 0) {
        drive_pdos_latch(&node->pdos);
        servo_step(&node->servo);
    }
}

static void step_by_wall_clock(struct drive_node *node, uint32_t elapsed_us)
{
    const uint32_t periods =
        sync_clock_own_periods(&node->clock, elapsed_us, node->servo.axis.config.period_us);
    for (uint32_t i = 0; i < periods; i++) {
        servo_step(&node->servo);
    }
}

static void process_clock(struct drive_node *node, uint32_t elapsed_us)
{
    const uint32_t timeout_us = 1000u * (uint32_t)node->values.simulation.sync_timeout;
    follow_enabling(node);
    if (node->clock.lost) {
        step_by_wall_clock(node, elapsed_us);
    }
    if (sync_clock_process(&node->clock, elapsed_us, timeout_us, node->nmt.state == NMT_STOPPED) &&
        node->values.modes_of_operation_display == CIA402_MODE_CSP) {
        servo_disconnect(&node->servo, EMCY_SYNC_LOST);
    }
}

/* ---- frames ---- */

void drive_node_receive(struct drive_node *node, const struct can_msg *in)
{
    struct can_msg out;
    if (node->without_power || nmt_slave_receive(&node->nmt, in)) {
        return;
    }
    if (in->id == COB_SYNC) {
        receive_sync(node, in);
        return;
    }
    if (nmt_permits_pdo(node->nmt.state) && drive_pdos_receive(&node->pdos, in)) {
        return;
    }
    if (nmt_permits_sdo(node->nmt.state) && sdo_server_wants(&node->sdo, in) &&
        sdo_server_receive(&node->sdo, in, &out) != 0) {
        send(node, &out);
    }
    (void)heartbeat_consumer_receive(&node->master, in);
    if (in->id == COB_HEARTBEAT + (uint32_t)node->master.node) {
        node->master_seen = true;
    }
}

/* If a heartbeat has come since the last call, the time since that call does not count. */
static void process_master(struct drive_node *node, uint32_t elapsed_us)
{
    const uint32_t without_us = node->master_seen ? 0u : elapsed_us;
    node->master_seen = false;
    if (heartbeat_consumer_process(&node->master, without_us) == HEARTBEAT_LOST) {
        servo_disconnect(&node->servo, EMCY_HEARTBEAT);
        nmt_slave_error(&node->nmt, node->values.error_behaviour[0]);
    }
}

static void process_own_frames(struct drive_node *node, uint32_t elapsed_us)
{
    struct can_msg out;
    if (heartbeat_producer_process(&node->heartbeat, node->values.producer_heartbeat_time,
                                   node->nmt.state, elapsed_us, &out) != 0 &&
        !node->without_heartbeats) {
        send(node, &out);
    }
    if (!nmt_permits_sdo(node->nmt.state)) {
        return; /* STOPPED: neither EMCY nor SDO */
    }
    while (emcy_producer_process(&node->servo.errors.emcy, &out) != 0) {
        send(node, &out);
    }
    for (uint32_t us = elapsed_us; sdo_server_process(&node->sdo, us, &out) != 0; us = 0) {
        send(node, &out);
    }
}

void drive_node_process(struct drive_node *node, uint32_t elapsed_us)
{
    const uint32_t awake_us = elapsed_us < SLEEP_US ? elapsed_us : SLEEP_US;
    struct can_msg out;
    if (node->without_power) {
        step_by_wall_clock(node, awake_us);
        return;
    }
    if (nmt_slave_process(&node->nmt, &out) != 0) {
        send(node, &out);
    }
    process_clock(node, awake_us);
    if (nmt_permits_pdo(node->nmt.state)) {
        drive_pdos_process(&node->pdos, awake_us);
    }
    process_master(node, elapsed_us);
    process_own_frames(node, elapsed_us);
}
