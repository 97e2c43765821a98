/* SPDX-License-Identifier: MIT */
#include "app/drives/homing.h"

#include <string.h>

#include "app/drives/homing_private.h"
#include "canopen/cia402.h"
#include "port/port.h"

void homing_init(struct homing *homing)
{
    memset(homing, 0, sizeof *homing);
    homing_mode_init(&homing->mode);
}

bool homing_busy(const struct homing *homing)
{
    return homing->phase != HOMING_IDLE;
}

static bool wanted(const struct machine *machine, uint8_t axis)
{
    return machine->config.axis[axis].homing_method != 0;
}

static uint8_t next_axis(const struct machine *machine, uint8_t axis)
{
    while (axis < machine->config.axis_count && !wanted(machine, axis)) {
        axis++;
    }
    return axis;
}

static enum machine_refusal drives_refusal(const struct machine *machine,
                                           const struct drive_properties *facts)
{
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        if (wanted(machine, i) && !drive_supports(&facts[i], CIA402_MODE_HOMING)) {
            return MACHINE_NO_HOMING_MODE;
        }
    }
    return next_axis(machine, 0) < machine->config.axis_count ? MACHINE_ACCEPTED
                                                              : MACHINE_NOTHING_TO_HOME;
}

enum machine_refusal homing_begin(struct homing *homing, struct machine *machine,
                                  const struct drive_properties *facts)
{
    port_lock();
    enum machine_refusal refusal = machine_begin_homing(machine);
    if (refusal == MACHINE_ACCEPTED) {
        refusal = drives_refusal(machine, facts);
        if (refusal != MACHINE_ACCEPTED) {
            machine_end_homing(machine);
        }
    }
    if (refusal == MACHINE_ACCEPTED) {
        homing_init(homing);
        homing->axis = next_axis(machine, 0);
        homing_enter(homing, machine, HOMING_OFF);
    }
    port_unlock();
    return refusal;
}

static void fail(struct homing *homing, struct machine *machine, uint16_t code, uint32_t detail)
{
    homing->phase = HOMING_IDLE;
    port_lock();
    machine_raise(machine, code, machine->config.node[homing->axis], detail);
    port_unlock();
}

/* What the process data of the drive decide. */
static void step_drive(struct homing *homing, struct machine *machine)
{
    port_lock();
    const uint16_t statusword = machine->axes[homing->axis].statusword;
    const uint16_t code = homing_drive_step(homing, machine);
    port_unlock();
    if (code != 0u) {
        fail(homing, machine, code, statusword);
    }
}

static void mode_done(struct homing *homing, struct machine *machine)
{
    port_lock();
    if (homing->phase == HOMING_MODE) {
        homing_enter(homing, machine, HOMING_ENABLE);
    } else {
        homing->axis = next_axis(machine, (uint8_t)(homing->axis + 1u));
        if (homing->axis < machine->config.axis_count) {
            homing_enter(homing, machine, HOMING_OFF);
        } else {
            homing->phase = HOMING_IDLE;
            machine_end_homing(machine);
        }
    }
    port_unlock();
}

static bool still_homing(const struct machine *machine)
{
    port_lock();
    const bool result = machine->state == MACHINE_HOMING;
    port_unlock();
    return result;
}

int homing_receive(struct homing *homing, const struct can_msg *in, struct can_msg *out)
{
    return homing_busy(homing) ? sdo_client_receive(&homing->mode.client, in, out) : 0;
}

/* Brings the drive into a mode. */
static int step_mode(struct homing *homing, struct machine *machine, uint32_t elapsed_us,
                     struct can_msg *out)
{
    const uint8_t mode = homing->phase == HOMING_MODE ? CIA402_MODE_HOMING : CIA402_MODE_CSP;
    const uint8_t node = machine->config.node[homing->axis];
    enum homing_mode_result result = HOMING_MODE_PENDING;
    const int sent = homing_mode_process(&homing->mode, node, mode, elapsed_us, out, &result);
    if (result == HOMING_MODE_SET) {
        mode_done(homing, machine);
    } else if (result == HOMING_MODE_REFUSED) {
        fail(homing, machine, FAULT_HOMING_MODE, homing->mode.detail);
    }
    return sent;
}

int homing_process(struct homing *homing, struct machine *machine, uint32_t elapsed_us,
                   struct can_msg *out)
{
    if (homing_busy(homing) && !still_homing(machine)) {
        homing->phase = HOMING_IDLE;
    }
    if (homing->phase == HOMING_MODE || homing->phase == HOMING_MODE_BACK) {
        return step_mode(homing, machine, elapsed_us, out);
    }
    if (homing_busy(homing)) {
        step_drive(homing, machine);
    }
    return 0;
}
