/* SPDX-License-Identifier: MIT */
/* Implements app/drives/homing.h (see there): command 10, which homes one axis after the other. Called by
 * app/controller.c and app/commands. Main loop; takes the port's lock where it changes the machine. Times are counted
 * in ticks, so they have the same meaning on a host that is too slow. */
#include "app/drives/homing.h"

#include <string.h>

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

/* ---- Homing of one drive: state by its statusword, time limit ---- */

uint32_t homing_time_s(const struct config *config, uint8_t axis)
{
    const struct config_axis *settings = &config->axis[axis];
    const uint32_t travel_counts =
        (uint32_t)config->travel[axis].max_counts - (uint32_t)config->travel[axis].min_counts;
    const uint64_t time_s = (uint64_t)travel_counts / settings->homing_speed_towards_counts_s +
                            travel_counts / settings->homing_speed_away_counts_s + HOMING_SPARE_S;
    return time_s < HOMING_MAX_S ? (uint32_t)time_s : HOMING_MAX_S;
}

/* The next phase, which begins now. */
static void enter(struct homing *homing, const struct machine *machine, enum homing_phase phase)
{
    homing->phase = phase;
    homing->began_syncs = machine->statistics.syncs;
    homing_mode_begin(&homing->mode);
}

/* True when the phase has lasted longer. Under the lock. */
static bool over(const struct homing *homing, const struct machine *machine, uint64_t time_us)
{
    const uint32_t syncs = machine->statistics.syncs - homing->began_syncs;
    return (uint64_t)syncs * machine->config.period_us > time_us;
}

/* CiA 402-2: bit 13 error, bits 12 and 10 together: attained. Returns a fault code or 0. */
static uint16_t judge_move(struct homing *homing, struct machine *machine)
{
    struct axis *axis = &machine->axes[homing->axis];
    const uint16_t attained = CIA402_STATUS_HOMING_ATTAINED | CIA402_STATUS_TARGET_REACHED;
    const uint64_t time_us = UINT64_C(1000000) * homing_time_s(&machine->config, homing->axis);
    if (machine->statistics.syncs - homing->began_syncs < HOMING_SYNCS_BEFORE_ANSWER) {
        return 0;
    }
    if ((axis->statusword & CIA402_STATUS_HOMING_ERROR) != 0u) {
        return FAULT_HOMING_FAILED;
    }
    if ((axis->statusword & attained) == attained) {
        axis->homed = true;
        axis->control_extra = 0;
        axis->goal = CIA402_GOAL_OFF;
        enter(homing, machine, HOMING_DISABLE);
        return 0;
    }
    return over(homing, machine, time_us) ? FAULT_HOMING_LATE : 0u;
}

static uint16_t step_enable(struct homing *homing, struct machine *machine)
{
    struct axis *axis = &machine->axes[homing->axis];
    axis->goal = CIA402_GOAL_ENABLED;
    if (axis_enabled(axis)) {
        axis->control_extra = CIA402_CONTROL_START_HOMING;
        axis->homed = false; /* from here on the drive may have moved its zero */
        enter(homing, machine, HOMING_MOVE);
    }
    return over(homing, machine, HOMING_SWITCH_US) ? FAULT_NOT_ENABLED : 0u;
}

/* Until the drive is off; then to the phase `next`. */
static uint16_t step_off(struct homing *homing, struct machine *machine, enum homing_phase next)
{
    if (cia402_master_reached(CIA402_GOAL_OFF, machine->axes[homing->axis].statusword)) {
        enter(homing, machine, next);
    }
    return over(homing, machine, HOMING_SWITCH_US) ? FAULT_HOMING_LATE : 0u;
}

/* In the phases OFF, ENABLE, MOVE and DISABLE: the next step by the statusword. A fault code, or 0. Under the lock. */
static uint16_t follow_drive(struct homing *homing, struct machine *machine)
{
    switch (homing->phase) {
    case HOMING_ENABLE:
        return step_enable(homing, machine);
    case HOMING_MOVE:
        return judge_move(homing, machine);
    case HOMING_OFF:
        return step_off(homing, machine, HOMING_MODE);
    default:
        return step_off(homing, machine, HOMING_MODE_BACK);
    }
}

/* ---- From axis to axis ---- */

static bool wanted(const struct machine *machine, uint8_t axis)
{
    return machine->config.axis[axis].homing_method != 0;
}

/* Whether axis a is homed before axis b. */
static bool precedes(const struct machine *machine, uint8_t a, uint8_t b)
{
    const uint32_t own = machine->config.axis[a].homing_sequence;
    const uint32_t other = machine->config.axis[b].homing_sequence;
    return own < other || (own == other && a < b);
}

/* The axis that is homed after this one, the first one after AXES_MAX; axis_count when there is none. */
static uint8_t next_axis(const struct machine *machine, uint8_t after)
{
    const uint8_t count = machine->config.axis_count;
    uint8_t next = count;
    for (uint8_t i = 0; i < count; ++i) {
        if (wanted(machine, i) && (after >= AXES_MAX || precedes(machine, after, i)) &&
            (next == count || precedes(machine, i, next))) {
            next = i;
        }
    }
    return next;
}

static enum machine_refusal drives_refusal(const struct machine *machine,
                                           const struct drive_properties *properties)
{
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        if (wanted(machine, i) && !drive_supports(&properties[i], CIA402_MODE_HOMING)) {
            return MACHINE_NO_HOMING_MODE;
        }
    }
    return next_axis(machine, AXES_MAX) < machine->config.axis_count ? MACHINE_ACCEPTED
                                                                     : MACHINE_NOTHING_TO_HOME;
}

enum machine_refusal homing_begin(struct homing *homing, struct machine *machine,
                                  const struct drive_properties *properties)
{
    port_lock();
    enum machine_refusal refusal = machine_begin_homing(machine);
    if (refusal == MACHINE_ACCEPTED) {
        refusal = drives_refusal(machine, properties);
        if (refusal != MACHINE_ACCEPTED) {
            machine_end_homing(machine);
        }
    }
    if (refusal == MACHINE_ACCEPTED) {
        homing_init(homing);
        homing->axis = next_axis(machine, AXES_MAX);
        enter(homing, machine, HOMING_OFF);
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

/* The steps that depend on process data of the drive. A tick may have ended homing by a fault since the last critical
 * section: then the goals of the axes are those of the fault. */
static void step_drive(struct homing *homing, struct machine *machine)
{
    port_lock();
    const uint16_t statusword = machine->axes[homing->axis].statusword;
    const bool goes_on = machine->state == MACHINE_HOMING;
    const uint16_t code = goes_on ? follow_drive(homing, machine) : 0u;
    port_unlock();
    if (code != 0u) {
        fail(homing, machine, code, statusword);
    }
}

static void mode_done(struct homing *homing, struct machine *machine)
{
    port_lock();
    if (homing->phase == HOMING_MODE) {
        enter(homing, machine, HOMING_ENABLE);
    } else {
        homing->axis = next_axis(machine, homing->axis);
        if (homing->axis < machine->config.axis_count) {
            enter(homing, machine, HOMING_OFF);
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

bool homing_receive(struct homing *homing, const struct can_msg *in, struct can_msg *out)
{
    return homing_busy(homing) && sdo_client_receive(&homing->mode.client, in, out);
}

/* Brings the drive into a mode. */
static bool step_mode(struct homing *homing, struct machine *machine, uint32_t elapsed_us,
                      struct can_msg *out)
{
    const uint8_t mode = homing->phase == HOMING_MODE ? CIA402_MODE_HOMING : CIA402_MODE_CSP;
    const uint8_t node = machine->config.node[homing->axis];
    enum homing_mode_result result = HOMING_MODE_PENDING;
    const bool sent = homing_mode_process(&homing->mode, node, mode, elapsed_us, out, &result);
    if (result == HOMING_MODE_SET) {
        mode_done(homing, machine);
    } else if (result == HOMING_MODE_REFUSED) {
        fail(homing, machine, FAULT_HOMING_MODE, homing->mode.detail);
    }
    return sent;
}

bool homing_process(struct homing *homing, struct machine *machine, uint32_t elapsed_us,
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
    return false;
}
