/* SPDX-License-Identifier: MIT */
/* One drive on its way: what its statusword says, and how long it may take. */
#include "app/drives/homing_private.h"
#include "canopen/cia402.h"

uint32_t homing_time_s(const struct config *config, uint8_t axis)
{
    const struct config_axis *settings = &config->axis[axis];
    const uint32_t travel_counts =
        (uint32_t)config->travel_max_counts[axis] - (uint32_t)config->travel_min_counts[axis];
    const uint64_t time_s = (uint64_t)travel_counts / settings->homing_speed_towards_counts_s +
                            travel_counts / settings->homing_speed_away_counts_s + HOMING_SPARE_S;
    return time_s < HOMING_MAX_S ? (uint32_t)time_s : HOMING_MAX_S;
}

void homing_enter(struct homing *homing, const struct machine *machine, enum homing_phase phase)
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
        homing_enter(homing, machine, HOMING_DISABLE);
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
        homing_enter(homing, machine, HOMING_MOVE);
    }
    return over(homing, machine, HOMING_SWITCH_US) ? FAULT_NOT_ENABLED : 0u;
}

/* Until the drive is off; then to the phase `next`. */
static uint16_t step_off(struct homing *homing, struct machine *machine, enum homing_phase next)
{
    if (cia402_master_reached(CIA402_GOAL_OFF, machine->axes[homing->axis].statusword)) {
        homing_enter(homing, machine, next);
    }
    return over(homing, machine, HOMING_SWITCH_US) ? FAULT_HOMING_LATE : 0u;
}

uint16_t homing_drive_step(struct homing *homing, struct machine *machine)
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
