/* SPDX-License-Identifier: MIT */
#include "app/drive_boot.h"

#include <string.h>

#include "canopen/cia402.h"
#include "canopen/nmt.h"
#include "canopen/sdo_abort.h"

#define DEVICE_PROFILE_DRIVE 402u /* low half of 0x1000 */
#define SIMULATED_VENDOR     0u   /* no real vendor has it */
#define SIMULATED_PRODUCT    2u   /* sim/node/drive.eds */

enum step_kind {
    STEP_PRE_OPERATIONAL, /* NMT: process data off while parameters change */
    STEP_EXPECT,          /* read; the masked value must be as given */
    STEP_IDENTIFY,        /* read; another value: not a simulated drive */
    STEP_WRITE,
    STEP_WRITE_OPTIONAL, /* a drive without the object is fine */
};

enum step_value {
    VALUE_CONSTANT,
    VALUE_PERIOD_US,
    VALUE_PERIOD_MS,
    VALUE_TRAVEL_MIN,
    VALUE_TRAVEL_MAX,
};

struct step {
    uint16_t index;
    uint8_t sub;
    uint8_t size; /* bytes; STEP_EXPECT: of the comparison */
    uint8_t kind;
    uint8_t value;
    uint32_t constant;
};

/* CiA 301 and CiA 402-2; 0x60C2 is the time between setpoints as sub 1 * 10^(sub 2) s. */
static const struct step steps[] = {
    {0x1000, 0, 2, STEP_EXPECT, VALUE_CONSTANT, DEVICE_PROFILE_DRIVE},
    {0x1018, 1, 4, STEP_IDENTIFY, VALUE_CONSTANT, SIMULATED_VENDOR},
    {0x1018, 2, 4, STEP_IDENTIFY, VALUE_CONSTANT, SIMULATED_PRODUCT},
    {0, 0, 0, STEP_PRE_OPERATIONAL, VALUE_CONSTANT, 0},
    {0x1006, 0, 4, STEP_WRITE_OPTIONAL, VALUE_PERIOD_US, 0},
    {0x1017, 0, 2, STEP_WRITE, VALUE_CONSTANT, DRIVE_HEARTBEAT_MS},
    {0x60C2, 1, 1, STEP_WRITE, VALUE_PERIOD_MS, 0},
    {0x60C2, 2, 1, STEP_WRITE, VALUE_CONSTANT, 0xFDu}, /* -3 */
    {0x607D, 1, 4, STEP_WRITE, VALUE_TRAVEL_MIN, 0},
    {0x607D, 2, 4, STEP_WRITE, VALUE_TRAVEL_MAX, 0},
    {0x6060, 0, 1, STEP_WRITE, VALUE_CONSTANT, CIA402_MODE_CSP},
    {0x6061, 0, 1, STEP_EXPECT, VALUE_CONSTANT, CIA402_MODE_CSP},
};

#define STEP_COUNT (sizeof steps / sizeof steps[0])

static uint32_t value_of(const struct drive_boot *boot, const struct step *step)
{
    switch (step->value) {
    case VALUE_PERIOD_US:
        return boot->config.period_us;
    case VALUE_PERIOD_MS:
        return boot->config.period_us / 1000u;
    case VALUE_TRAVEL_MIN:
        return (uint32_t)boot->config.travel_min_counts[boot->axis];
    case VALUE_TRAVEL_MAX:
        return (uint32_t)boot->config.travel_max_counts[boot->axis];
    case VALUE_CONSTANT:
    default:
        return step->constant;
    }
}

static void pause(struct drive_boot *boot, uint32_t pause_us)
{
    boot->phase = DRIVE_BOOT_PAUSE;
    boot->pause_us = pause_us;
}

void drive_boot_init(struct drive_boot *boot)
{
    memset(boot, 0, sizeof *boot);
    boot->phase = DRIVE_BOOT_IDLE;
}

static void forget_trouble(struct drive_boot *boot)
{
    boot->trouble_node = 0;
    boot->trouble_object = 0;
    boot->trouble_abort = SDO_OK;
    boot->trouble_value = 0;
}

void drive_boot_begin(struct drive_boot *boot, const struct config *config)
{
    boot->config = *config;
    forget_trouble(boot);
    sdo_client_init(&boot->client, DRIVE_BOOT_SDO_TIMEOUT_US);
    pause(boot, DRIVE_BOOT_PAUSE_US);
}

static uint8_t node_of(const struct drive_boot *boot)
{
    return boot->config.node[boot->axis];
}

static void give_up(struct drive_boot *boot, uint32_t abort_code)
{
    const struct step *step = &steps[boot->step];
    boot->trouble_node = node_of(boot);
    boot->trouble_object = ((uint32_t)step->index << 8) + step->sub;
    boot->trouble_abort = abort_code;
    boot->trouble_value = abort_code == SDO_OK ? (uint32_t)sdo_client_unsigned(&boot->client) : 0u;
    sdo_client_init(&boot->client, DRIVE_BOOT_SDO_TIMEOUT_US);
    pause(boot, DRIVE_BOOT_RETRY_US);
}

/* The step is done: to the next one, the next drive, or on to starting them all. */
static void advance(struct drive_boot *boot)
{
    boot->client.status = SDO_CLIENT_IDLE;
    boot->step++;
    if (boot->step < STEP_COUNT) {
        return;
    }
    boot->step = 0;
    boot->axis++;
    if (boot->axis == boot->config.axis_count) {
        boot->axis = 0;
        boot->phase = DRIVE_BOOT_START;
    }
}

static bool as_expected(const struct drive_boot *boot, const struct step *step)
{
    const uint64_t mask = (UINT64_C(1) << (8u * step->size)) - 1u;
    return (sdo_client_unsigned(&boot->client) & mask) == value_of(boot, step);
}

static void judge(struct drive_boot *boot)
{
    const struct step *step = &steps[boot->step];
    const bool done = boot->client.status == SDO_CLIENT_DONE;
    if (step->kind == STEP_IDENTIFY && boot->client.status != SDO_CLIENT_FAILED) {
        boot->simulated = boot->simulated && done && as_expected(boot, step);
        advance(boot);
    } else if (done) {
        if (step->kind == STEP_EXPECT && !as_expected(boot, step)) {
            give_up(boot, SDO_OK);
        } else {
            advance(boot);
        }
    } else if (step->kind == STEP_WRITE_OPTIONAL &&
               boot->client.abort_code == SDO_ABORT_NO_OBJECT) {
        advance(boot);
    } else {
        give_up(boot, boot->client.abort_code);
    }
}

static int begin_step(struct drive_boot *boot, struct can_msg *out)
{
    const struct step *step = &steps[boot->step];
    const uint8_t node = node_of(boot);
    if (step->kind == STEP_PRE_OPERATIONAL) {
        nmt_master_command(NMT_ENTER_PRE_OPERATIONAL, node, out);
        advance(boot);
        return 1;
    }
    const bool read = step->kind == STEP_EXPECT || step->kind == STEP_IDENTIFY;
    const int sent = read ? sdo_client_read_number(&boot->client, node, step->index, step->sub, out)
                          : sdo_client_write_number(&boot->client, node, step->index, step->sub,
                                                    value_of(boot, step), step->size, out);
    return sent > 0 ? 1 : 0;
}

static int configure(struct drive_boot *boot, uint32_t elapsed_us, struct can_msg *out)
{
    switch (boot->client.status) {
    case SDO_CLIENT_IDLE:
        return begin_step(boot, out);
    case SDO_CLIENT_BUSY:
        return sdo_client_process(&boot->client, elapsed_us, out);
    case SDO_CLIENT_DONE:
    case SDO_CLIENT_REFUSED:
    case SDO_CLIENT_FAILED:
    default:
        judge(boot);
        return boot->phase == DRIVE_BOOT_CONFIGURE ? begin_step(boot, out) : 0;
    }
}

static int start_next(struct drive_boot *boot, struct can_msg *out)
{
    nmt_master_command(NMT_START, node_of(boot), out);
    boot->axis++;
    if (boot->axis == boot->config.axis_count) {
        boot->phase = DRIVE_BOOT_DONE;
        forget_trouble(boot);
    }
    return 1;
}

static void let_pause_pass(struct drive_boot *boot, uint32_t elapsed_us)
{
    if (elapsed_us < boot->pause_us) {
        boot->pause_us -= elapsed_us;
        return;
    }
    boot->axis = 0;
    boot->step = 0;
    boot->simulated = true;
    boot->phase = DRIVE_BOOT_CONFIGURE;
}

int drive_boot_receive(struct drive_boot *boot, const struct can_msg *in, struct can_msg *out)
{
    return boot->phase == DRIVE_BOOT_CONFIGURE ? sdo_client_receive(&boot->client, in, out) : 0;
}

int drive_boot_process(struct drive_boot *boot, uint32_t elapsed_us, struct can_msg *out)
{
    if (boot->phase == DRIVE_BOOT_PAUSE) {
        let_pause_pass(boot, elapsed_us);
    }
    if (boot->phase == DRIVE_BOOT_CONFIGURE) {
        const int sent = configure(boot, elapsed_us, out);
        if (sent != 0 || boot->phase != DRIVE_BOOT_START) {
            return sent;
        }
    }
    return boot->phase == DRIVE_BOOT_START ? start_next(boot, out) : 0;
}

bool drive_boot_finished(struct drive_boot *boot)
{
    if (boot->phase != DRIVE_BOOT_DONE) {
        return false;
    }
    boot->phase = DRIVE_BOOT_IDLE;
    return true;
}
