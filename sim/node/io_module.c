/* SPDX-License-Identifier: MIT */
/* Implements node/io_module.h (see there): a simulated I/O module. Used by node/drives. All in one context. Changes the
 * module, and sends frames through its port; no other I/O. */
#include "node/io_module.h"

#include <string.h>

#include "canopen/cob.h"
#include "canopen/sdo_abort.h"

enum { SDO_TIMEOUT_US = 1000000, FIRST_RPDO = 0x1400 };

#define DIGITAL_BYTES (sizeof((struct od_module *)0)->write_output_8_bit)
#define ANALOGUES (sizeof((struct od_module *)0)->write_analogue_output_16_bit / sizeof(int16_t))

static void send(const struct io_module *module, const struct can_msg *frame)
{
    module->port.send(module->port.context, frame);
}

/* ---- Power-on and NMT ---- */

static void begin_communication(struct io_module *module)
{
    od_module_set_node(&module->values, module->id);
    sdo_server_init(&module->sdo, &module->od, module->id, SDO_TIMEOUT_US, SDO_BLOCK_SEGMENTS_MAX);
    heartbeat_producer_init(&module->heartbeat, module->id);
    heartbeat_consumer_init_entry(&module->master, module->values.consumer_heartbeat_time[0]);
    for (uint16_t i = 0; i < IO_MODULE_RPDOS; i++) {
        pdo_map_init(&module->rpdos[i], &module->od, (uint16_t)(FIRST_RPDO + i));
    }
    module->moved = true;
}

static void reset_node(void *context)
{
    struct io_module *module = context;
    module->values = od_module_defaults;
    begin_communication(module);
}

static void reset_communication(void *context)
{
    struct io_module *module = context;
    od_reset_communication(&module->od, &od_module_defaults);
    begin_communication(module);
}

/* CiA 401: 0x6206 (for each bit) and 0x6443 (for each output) select the error value, or that the output stays. */
static void take_error_values(struct io_module *module)
{
    struct od_module *v = &module->values;
    for (size_t i = 0; i < DIGITAL_BYTES; i++) {
        const uint32_t mode = v->error_mode_output_8_bit[i];
        const uint32_t kept = v->write_output_8_bit[i] & ~mode;
        v->write_output_8_bit[i] = (uint8_t)(kept | (v->error_value_output_8_bit[i] & mode));
    }
    for (size_t i = 0; i < ANALOGUES; i++) {
        if (v->analogue_output_error_mode[i] != 0) {
            v->write_analogue_output_16_bit[i] = (int16_t)v->analogue_output_error_value_integer[i];
        }
    }
}

static void change_state(void *context, enum nmt_state state)
{
    struct io_module *module = context;
    for (int i = 0; i < IO_MODULE_RPDOS; i++) {
        pdo_map_restart(&module->rpdos[i]);
    }
    if (state == NMT_STOPPED) {
        take_error_values(module);
    }
}

static const struct nmt_hooks nmt_hooks = {
    .reset_node = reset_node,
    .reset_communication = reset_communication,
    .changed = change_state,
};

/* ---- The dictionary ---- */

static uint32_t on_write(void *context, const struct od_entry *entry, const uint8_t *value,
                         uint32_t size)
{
    const struct io_module *module = context;
    uint32_t code = SDO_OK;
    for (int i = 0; i < IO_MODULE_RPDOS && code == SDO_OK; i++) {
        code = pdo_map_write(&module->rpdos[i], entry, value, size);
    }
    return code;
}

static void on_written(void *context, const struct od_entry *entry)
{
    struct io_module *module = context;
    for (int i = 0; i < IO_MODULE_RPDOS; i++) {
        module->moved = pdo_map_written(&module->rpdos[i], entry) || module->moved;
    }
    if (entry->index == OD_MODULE_CONSUMER_HEARTBEAT_TIME) {
        heartbeat_consumer_init_entry(&module->master, module->values.consumer_heartbeat_time[0]);
    }
}

static const struct od_hooks od_hooks = {.write = on_write, .written = on_written};

void io_module_init(struct io_module *module, uint8_t id, struct drive_node_port port)
{
    memset(module, 0, sizeof *module);
    module->id = id;
    module->port = port;
    od_init(&module->od, &od_module_table, &module->values, &od_hooks, module);
    nmt_slave_init(&module->nmt, id, &nmt_hooks, module);
    reset_node(module);
}

/* ---- Frames ---- */

static bool receive_pdo(struct io_module *module, const struct can_msg *in)
{
    bool ours = false;
    for (int i = 0; i < IO_MODULE_RPDOS; i++) {
        ours = pdo_map_receive(&module->rpdos[i], in) != PDO_MAP_NOT || ours;
    }
    return ours;
}

static void apply_pdos(struct io_module *module)
{
    for (int i = 0; i < IO_MODULE_RPDOS; i++) {
        (void)pdo_map_apply(&module->rpdos[i]);
    }
}

void io_module_receive(struct io_module *module, const struct can_msg *in)
{
    struct can_msg out;
    if (nmt_slave_receive(&module->nmt, in)) {
        return;
    }
    if (nmt_permits_pdo(module->nmt.state)) {
        if (in->id == COB_SYNC) {
            apply_pdos(module);
            return;
        }
        if (receive_pdo(module, in)) {
            return;
        }
    }
    if (nmt_permits_sdo(module->nmt.state) && sdo_server_wants(&module->sdo, in) &&
        sdo_server_receive(&module->sdo, in, &out) != 0) {
        send(module, &out);
    }
    (void)heartbeat_consumer_receive(&module->master, in);
    module->master_seen =
        module->master_seen || in->id == COB_HEARTBEAT + (uint32_t)module->master.node;
}

/* If a heartbeat has come since the last call, the time since that call does not count. */
static void process_master(struct io_module *module, uint32_t elapsed_us)
{
    const uint32_t without_us = module->master_seen ? 0u : elapsed_us;
    module->master_seen = false;
    if (heartbeat_consumer_process(&module->master, without_us) == HEARTBEAT_LOST) {
        take_error_values(module);
        nmt_slave_error(&module->nmt, module->values.error_behaviour[0]);
    }
}

void io_module_process(struct io_module *module, uint32_t elapsed_us)
{
    struct can_msg out;
    if (nmt_slave_process(&module->nmt, &out) != 0) {
        send(module, &out);
    }
    process_master(module, elapsed_us);
    if (heartbeat_producer_process(&module->heartbeat, module->values.producer_heartbeat_time,
                                   module->nmt.state, elapsed_us, &out) != 0) {
        send(module, &out);
    }
    for (uint32_t us = elapsed_us; sdo_server_process(&module->sdo, us, &out) != 0; us = 0) {
        send(module, &out);
    }
}
