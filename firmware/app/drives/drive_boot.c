/* SPDX-License-Identifier: MIT */
#include "app/drives/drive_boot.h"

#include <string.h>

#include "app/drives/drive_boot_private.h"
#include "canopen/nmt.h"
#include "canopen/sdo_abort.h"

#define AXIS_NODE 0x2005u

void drive_boot_init(struct drive_boot *boot)
{
    memset(boot, 0, sizeof *boot);
    boot->phase = DRIVE_BOOT_IDLE;
}

void drive_boot_begin(struct drive_boot *boot, const struct config *config)
{
    boot->config = *config;
    memset(&boot->trouble, 0, sizeof boot->trouble);
    drive_boot_pause(boot, DRIVE_BOOT_PAUSE_US);
}

static void begin_drive(struct drive_boot *boot)
{
    drive_plan_begin(&boot->plan, &boot->config, boot->axis, &boot->facts[boot->axis]);
    boot->reading_back = false;
    boot->reads = 0;
}

/* The drive is configured: to the next one, or on to starting them all. */
static void finish_drive(struct drive_boot *boot)
{
    boot->simulated = boot->simulated && drive_is_simulated(&boot->facts[boot->axis]);
    boot->axis++;
    if (boot->axis == boot->config.axis_count) {
        boot->axis = 0;
        boot->phase = DRIVE_BOOT_START;
    } else {
        begin_drive(boot);
    }
}

static int begin_op(struct drive_boot *boot, struct can_msg *out)
{
    const struct drive_op *op = &boot->op;
    const uint8_t node = drive_boot_node(boot);
    if (op->kind == DRIVE_OP_NMT_PRE_OPERATIONAL) {
        nmt_master_command(NMT_ENTER_PRE_OPERATIONAL, node, out);
        drive_boot_advance(boot);
        return 1;
    }
    const int sent = op->kind == DRIVE_OP_READ || boot->reading_back
                         ? sdo_client_read_number(&boot->client, node, op->index, op->sub, out)
                         : sdo_client_write_number(&boot->client, node, op->index, op->sub,
                                                   op->value, op->size, out);
    return sent == 0 ? 1 : 0;
}

static bool waits(struct drive_boot *boot, uint32_t elapsed_us)
{
    boot->pause_us -= elapsed_us < boot->pause_us ? elapsed_us : boot->pause_us;
    return boot->pause_us > 0u;
}

static int configure(struct drive_boot *boot, uint32_t elapsed_us, struct can_msg *out)
{
    if (boot->client.status == SDO_CLIENT_BUSY) {
        return sdo_client_process(&boot->client, elapsed_us, out);
    }
    if (boot->client.status != SDO_CLIENT_IDLE) {
        drive_boot_response(boot);
    }
    if (boot->phase != DRIVE_BOOT_CONFIGURE || waits(boot, elapsed_us)) {
        return 0;
    }
    while (!drive_plan_op(&boot->plan, &boot->op)) {
        finish_drive(boot);
        if (boot->phase != DRIVE_BOOT_CONFIGURE) {
            return 0;
        }
    }
    return begin_op(boot, out);
}

static int start_next(struct drive_boot *boot, struct can_msg *out)
{
    nmt_master_command(NMT_START, drive_boot_node(boot), out);
    boot->axis++;
    if (boot->axis == boot->config.axis_count) {
        boot->phase = DRIVE_BOOT_DONE;
        memset(&boot->trouble, 0, sizeof boot->trouble);
    }
    return 1;
}

/* Two axes at one node, or one at the controller's own: nothing may be sent there. */
static bool node_is_taken(const struct config *config, uint8_t axis)
{
    bool taken = config->node[axis] == config->own_node;
    for (uint8_t i = 0; i < axis; ++i) {
        taken = taken || config->node[i] == config->node[axis];
    }
    return taken;
}

static bool nodes_clash(struct drive_boot *boot)
{
    for (uint8_t i = 0; i < boot->config.axis_count; ++i) {
        if (node_is_taken(&boot->config, i)) {
            boot->axis = i;
            boot->op.index = AXIS_NODE;
            boot->op.sub = (uint8_t)(i + 1u);
            drive_boot_give_up(boot, SDO_ABORT_INCOMPATIBLE, drive_boot_node(boot));
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
    boot->axis = 0;
    boot->simulated = true;
    boot->phase = DRIVE_BOOT_CONFIGURE;
    begin_drive(boot);
}

int drive_boot_receive(struct drive_boot *boot, const struct can_msg *in, struct can_msg *out)
{
    return boot->phase == DRIVE_BOOT_CONFIGURE ? sdo_client_receive(&boot->client, in, out) : 0;
}

int drive_boot_process(struct drive_boot *boot, uint32_t elapsed_us, struct can_msg *out)
{
    if (boot->phase == DRIVE_BOOT_PAUSE && !waits(boot, elapsed_us)) {
        begin_attempt(boot);
    }
    if (boot->phase == DRIVE_BOOT_CONFIGURE) {
        const int sent = configure(boot, elapsed_us, out);
        if (sent != 0 || boot->phase != DRIVE_BOOT_START) {
            return sent;
        }
    }
    return boot->phase == DRIVE_BOOT_START ? start_next(boot, out) : 0;
}

void drive_boot_silent(struct drive_boot *boot, uint8_t node)
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
