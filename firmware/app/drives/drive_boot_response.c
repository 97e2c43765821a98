/* SPDX-License-Identifier: MIT */
/* What the answers of a drive mean for its configuration: go on, read back, ask again, or give up. */
#include "app/drives/drive_boot_private.h"
#include "canopen/sdo_abort.h"

void drive_boot_pause(struct drive_boot *boot, uint32_t pause_us)
{
    boot->phase = DRIVE_BOOT_PAUSE;
    boot->pause_us = pause_us;
    sdo_client_init(&boot->client, DRIVE_BOOT_SDO_TIMEOUT_US);
}

uint8_t drive_boot_node(const struct drive_boot *boot)
{
    return boot->config.node[boot->axis];
}

void drive_boot_give_up(struct drive_boot *boot, uint32_t abort_code, uint32_t value)
{
    boot->trouble = (struct drive_trouble){
        .node = drive_boot_node(boot),
        .object = ((uint32_t)boot->op.index << 8) + boot->op.sub,
        .abort_code = abort_code,
        .value = value,
    };
    drive_boot_pause(boot, DRIVE_BOOT_RETRY_US);
}

void drive_boot_advance(struct drive_boot *boot)
{
    boot->client.status = SDO_CLIENT_IDLE;
    boot->reading_back = false;
    boot->reads = 0;
    drive_plan_advance(&boot->plan);
}

static void refused(struct drive_boot *boot, uint32_t abort_code, uint32_t value)
{
    boot->client.status = SDO_CLIENT_IDLE;
    boot->reading_back = false;
    if (!drive_plan_refused(&boot->plan, abort_code)) {
        drive_boot_give_up(boot, abort_code, value);
    }
}

static bool as_wanted(const struct drive_op *op, uint32_t value)
{
    return ((value ^ op->value) & op->mask) == 0u;
}

/* What a write should have made so, or what only the drive knows. */
static void judge_read(struct drive_boot *boot)
{
    const uint32_t value = (uint32_t)sdo_client_unsigned(&boot->client);
    if (as_wanted(&boot->op, value)) {
        drive_properties_read(boot->plan.facts, boot->op.fact, value);
        drive_boot_advance(boot);
    } else if (boot->reading_back) {
        refused(boot, boot->refused_code, value);
    } else if (++boot->reads < DRIVE_BOOT_READS) {
        boot->client.status = SDO_CLIENT_IDLE;
        boot->pause_us = DRIVE_BOOT_READ_AGAIN_US;
    } else {
        refused(boot, SDO_OK, value);
    }
}

static void judge_refusal(struct drive_boot *boot, uint32_t abort_code)
{
    const bool missing = abort_code == SDO_ABORT_NO_OBJECT || abort_code == SDO_ABORT_NO_SUB;
    if (boot->op.kind == DRIVE_OP_PREPARE || (boot->op.optional && missing)) {
        drive_boot_advance(boot);
    } else if (boot->op.kind == DRIVE_OP_WRITE && !missing && !boot->reading_back) {
        boot->client.status = SDO_CLIENT_IDLE;
        boot->reading_back = true;
        boot->refused_code = abort_code;
    } else {
        refused(boot, boot->reading_back ? boot->refused_code : abort_code, 0);
    }
}

void drive_boot_response(struct drive_boot *boot)
{
    if (boot->client.status == SDO_CLIENT_FAILED) {
        drive_boot_give_up(boot, boot->client.abort_code, 0);
    } else if (boot->client.status == SDO_CLIENT_REFUSED) {
        judge_refusal(boot, boot->client.abort_code);
    } else if (boot->op.kind == DRIVE_OP_READ || boot->reading_back) {
        judge_read(boot);
    } else {
        drive_boot_advance(boot);
    }
}
