/* SPDX-License-Identifier: MIT */
/* Implements app/drives/drive_boot.h (see there): configures the I/O module and the drives by SDO
 * (drive_configuration), one after the other. Then it starts them by NMT. If one does not answer or refuses, a new
 * attempt begins from the first. Called by app/controller.c. Takes received frames, gives back frames to send, and
 * changes its struct only. Main loop. */
#include "app/drives/drive_boot.h"

#include <string.h>

#include "canopen/nmt.h"
#include "canopen/sdo_abort.h"

#define AXIS_NODE   0x2005u /* object: node number of the drive of each axis */
#define MODULE_NODE 0x2035u /* object: node number of the I/O module */

/* Ends the present attempt, if there is one; the next one begins after the pause. */
static void pause_for(struct drive_boot *boot, uint32_t pause_us)
{
    boot->phase = DRIVE_BOOT_PAUSE;
    boot->pause_us = pause_us;
    sdo_client_init(&boot->client, DRIVE_BOOT_SDO_TIMEOUT_US);
}

/* Node number of the drive or I/O module that is being configured or started. */
static uint8_t present_node(const struct drive_boot *boot)
{
    return drive_configuration_node(&boot->config, boot->axis);
}

/* Ends an attempt that has failed at the present object, which `trouble` then reports. */
static void give_up(struct drive_boot *boot, uint32_t abort_code, uint32_t value)
{
    boot->trouble = (struct drive_trouble){
        .node = present_node(boot),
        .object = ((uint32_t)boot->op.index << 8) + boot->op.sub,
        .abort_code = abort_code,
        .value = value,
    };
    pause_for(boot, DRIVE_BOOT_RETRY_US);
}

/* Proceeds to the next operation on the drive. */
static void advance(struct drive_boot *boot)
{
    boot->client.status = SDO_CLIENT_IDLE;
    boot->reading_back = false;
    boot->reads = 0;
    drive_configuration_advance(&boot->configuration);
}

void drive_boot_init(struct drive_boot *boot)
{
    memset(boot, 0, sizeof *boot);
    boot->phase = DRIVE_BOOT_IDLE;
}

void drive_boot_begin(struct drive_boot *boot, const struct config *config)
{
    boot->config = *config;
    memset(&boot->trouble, 0, sizeof boot->trouble);
    pause_for(boot, DRIVE_BOOT_PAUSE_US);
}

/* ---- SDO response handling: next object, read back, read again, or fail ---- */

/* The drive does not accept the present operation: proceeds if the operation is not necessary, else gives up. `value`:
 * the wrong value that was read, else 0. */
static void refused(struct drive_boot *boot, uint32_t abort_code, uint32_t value)
{
    boot->client.status = SDO_CLIENT_IDLE;
    boot->reading_back = false;
    if (!drive_configuration_refused(&boot->configuration, abort_code)) {
        give_up(boot, abort_code, value);
    }
}

/* Whether the compared bits have the expected value. */
static bool as_wanted(const struct drive_op *op, uint32_t value)
{
    return ((value ^ op->value) & op->mask) == 0u;
}

/* Checks a value that was read: a property of the drive, or an object whose write was refused. A wrong property is read
 * again, DRIVE_BOOT_READS times in all. */
static void judge_read(struct drive_boot *boot)
{
    const uint32_t value = (uint32_t)sdo_client_unsigned(&boot->client);
    if (as_wanted(&boot->op, value)) {
        drive_properties_read(boot->configuration.properties, boot->op.property, value);
        advance(boot);
    } else if (boot->reading_back) {
        refused(boot, boot->refused_code, value);
    } else if (++boot->reads < DRIVE_BOOT_READS) {
        boot->client.status = SDO_CLIENT_IDLE;
        boot->pause_us = DRIVE_BOOT_READ_AGAIN_US;
    } else {
        refused(boot, SDO_OK, value);
    }
}

/* Decides what a refused transfer means. It is no error for DRIVE_OP_PREPARE, or if an optional object is missing. Any
 * other object that refuses a write is read, because it may have the value already, unless it is missing. */
static void judge_refusal(struct drive_boot *boot, uint32_t abort_code)
{
    const bool missing = abort_code == SDO_ABORT_NO_OBJECT || abort_code == SDO_ABORT_NO_SUB;
    if (boot->op.kind == DRIVE_OP_PREPARE || (boot->op.optional && missing)) {
        advance(boot);
    } else if (boot->op.kind == DRIVE_OP_WRITE && !missing && !boot->reading_back) {
        boot->client.status = SDO_CLIENT_IDLE;
        boot->reading_back = true;
        boot->refused_code = abort_code;
    } else {
        refused(boot, boot->reading_back ? boot->refused_code : abort_code, 0);
    }
}

/* The SDO transfer of the present operation has ended: decides what follows. */
static void take_response(struct drive_boot *boot)
{
    if (boot->client.status == SDO_CLIENT_FAILED) {
        give_up(boot, boot->client.abort_code, 0);
    } else if (boot->client.status == SDO_CLIENT_REFUSED) {
        judge_refusal(boot, boot->client.abort_code);
    } else if (boot->op.kind == DRIVE_OP_READ || boot->reading_back) {
        judge_read(boot);
    } else {
        advance(boot);
    }
}

/* ---- One drive after the other ---- */

static void begin_drive(struct drive_boot *boot)
{
    drive_configuration_begin(&boot->configuration, &boot->config, boot->axis,
                              &boot->properties[boot->axis]);
    boot->reading_back = false;
    boot->reads = 0;
}

/* What is configured first, as `axis` of the state: the I/O module, if there is one. Its configuration switches its
 * outputs off, which must not wait for a drive that does not answer. */
static uint8_t first_index(const struct config *config)
{
    return config->outputs.node != 0u ? config->axis_count : 0u;
}

/* The drive or the I/O module is configured: begins the next drive. After the last one, all nodes are to be started. */
static void finish_drive(struct drive_boot *boot)
{
    const bool module = boot->axis >= boot->config.axis_count;
    boot->simulated =
        boot->simulated && (module || drive_is_simulated(&boot->properties[boot->axis]));
    boot->axis = module ? 0u : (uint8_t)(boot->axis + 1u);
    if (boot->axis == boot->config.axis_count) {
        boot->axis = 0;
        boot->phase = DRIVE_BOOT_START;
    } else {
        begin_drive(boot);
    }
}

/* Begins the present operation. True: *out is to be sent. */
static bool begin_op(struct drive_boot *boot, struct can_msg *out)
{
    const struct drive_op *op = &boot->op;
    const uint8_t node = present_node(boot);
    if (op->kind == DRIVE_OP_NMT_PRE_OPERATIONAL) {
        nmt_master_command(NMT_ENTER_PRE_OPERATIONAL, node, out);
        advance(boot);
        return true;
    }
    const int begun = op->kind == DRIVE_OP_READ || boot->reading_back
                          ? sdo_client_read_number(&boot->client, node, op->index, op->sub, out)
                          : sdo_client_write_number(&boot->client, node, op->index, op->sub,
                                                    op->value, op->size, out);
    return begun == 0;
}

/* Lets time pass; whether the pause goes on. */
static bool waits(struct drive_boot *boot, uint32_t elapsed_us)
{
    boot->pause_us -= elapsed_us < boot->pause_us ? elapsed_us : boot->pause_us;
    return boot->pause_us > 0u;
}

/* Proceeds with the SDO transfer, or begins the next operation. True: *out is to be sent. */
static bool configure(struct drive_boot *boot, uint32_t elapsed_us, struct can_msg *out)
{
    if (boot->client.status == SDO_CLIENT_BUSY) {
        return sdo_client_process(&boot->client, elapsed_us, out);
    }
    if (boot->client.status != SDO_CLIENT_IDLE) {
        take_response(boot);
    }
    if (boot->phase != DRIVE_BOOT_CONFIGURE || waits(boot, elapsed_us)) {
        return false;
    }
    while (!drive_configuration_op(&boot->configuration, &boot->op)) {
        finish_drive(boot);
        if (boot->phase != DRIVE_BOOT_CONFIGURE) {
            return false;
        }
    }
    return begin_op(boot, out);
}

/* Starts one node by NMT. After the last one the attempt has succeeded. */
static bool start_next(struct drive_boot *boot, struct can_msg *out)
{
    nmt_master_command(NMT_START, present_node(boot), out);
    boot->axis++;
    if (boot->axis == drive_configuration_nodes(&boot->config)) {
        boot->phase = DRIVE_BOOT_DONE;
        memset(&boot->trouble, 0, sizeof boot->trouble);
    }
    return true;
}

/* Whether the node number of a drive or the I/O module is that of the controller or of a drive before it. */
static bool node_is_taken(const struct config *config, uint8_t axis)
{
    const uint8_t node = drive_configuration_node(config, axis);
    bool taken = node == config->own_node;
    for (uint8_t i = 0; i < axis; ++i) {
        taken = taken || config->node[i] == node;
    }
    return taken;
}

/* Gives up, before any frame is sent, if two nodes have the same number. `trouble` then has the object that sets it. */
static bool nodes_clash(struct drive_boot *boot)
{
    for (uint8_t i = 0; i < drive_configuration_nodes(&boot->config); ++i) {
        if (node_is_taken(&boot->config, i)) {
            const bool module = i >= boot->config.axis_count;
            boot->axis = i;
            boot->op.index = module ? MODULE_NODE : AXIS_NODE;
            boot->op.sub = module ? 1u : (uint8_t)(i + 1u);
            give_up(boot, SDO_ABORT_INCOMPATIBLE, present_node(boot));
            return true;
        }
    }
    return false;
}

static void begin_attempt(struct drive_boot *boot)
{
    if (nodes_clash(boot)) {
        return;
    }
    boot->axis = first_index(&boot->config);
    boot->simulated = true;
    boot->phase = DRIVE_BOOT_CONFIGURE;
    begin_drive(boot);
}

bool drive_boot_receive(struct drive_boot *boot, const struct can_msg *in, struct can_msg *out)
{
    return boot->phase == DRIVE_BOOT_CONFIGURE && sdo_client_receive(&boot->client, in, out);
}

bool drive_boot_process(struct drive_boot *boot, uint32_t elapsed_us, struct can_msg *out)
{
    if (boot->phase == DRIVE_BOOT_PAUSE && !waits(boot, elapsed_us)) {
        begin_attempt(boot);
    }
    if (boot->phase == DRIVE_BOOT_CONFIGURE) {
        const bool sent = configure(boot, elapsed_us, out);
        if (sent || boot->phase != DRIVE_BOOT_START) {
            return sent;
        }
    }
    return boot->phase == DRIVE_BOOT_START && start_next(boot, out);
}

void drive_boot_unresponsive(struct drive_boot *boot, uint8_t node)
{
    if (boot->phase == DRIVE_BOOT_IDLE) {
        boot->trouble = (struct drive_trouble){
            .node = node,
            .abort_code = node != 0u ? SDO_ABORT_TIMEOUT : SDO_OK,
        };
    }
}

bool drive_boot_finished(struct drive_boot *boot)
{
    if (boot->phase != DRIVE_BOOT_DONE) {
        return false;
    }
    boot->phase = DRIVE_BOOT_IDLE;
    return true;
}
