/* SPDX-License-Identifier: MIT */
/* machine_supervise() of app/machine/machine.h: checks answers, states and statuswords of the drives, once a tick. Used
 * by firmware/app. Guarded by the port's lock as a whole. Files use each other in one direction: tick, supervise and
 * requests -> fault -> drives -> machine. Changes only the machine; no I/O. */
#include "app/machine/machine.h"

#include "app/machine/machine_drives.h"
#include "app/machine/machine_fault.h"

static uint16_t trouble_of(const struct axis *axis)
{
    if (axis_in_fault(axis)) {
        return EMCY_GENERIC;
    }
    if (axis_left_operation_enabled(axis)) {
        return FAULT_DROPPED_OUT;
    }
    const uint16_t trouble = statusword_monitor_trouble(&axis->statusword_bits);
    return trouble == EMCY_NO_ERROR && axis->deviates ? FAULT_POSITION_DEVIATION : trouble;
}

/* With power off drives may come and go: they are found again. */
static void supervise_axis(struct machine *machine, const struct axis *axis, uint32_t now_us)
{
    const uint16_t trouble = trouble_of(axis);
    const uint16_t code = machine_code_of(axis, trouble);
    const uint32_t detail = trouble == FAULT_POSITION_DEVIATION
                                ? axis_deviation_counts(axis)
                                : fault_drive_detail(code, axis->statusword);
    if (machine->state == MACHINE_OFF && axis->tpdo1.lost) {
        if (axis_lost_for_long(axis, now_us)) {
            machine_enter_boot(machine);
        }
    } else if (axis->tpdo1.lost) {
        machine_raise(machine, EMCY_RPDO_TIMEOUT, axis->node, axis->tpdo1.absent_in_row);
    } else if (trouble != EMCY_NO_ERROR) {
        machine_raise(machine, code, axis->node, detail);
    }
}

/* Where the SYNC itself did not leave, no answer is missing. */
static void close_unanswered(struct machine *machine, struct tpdo_monitor *monitor, uint32_t now_us)
{
    if (!machine->sync_sent) {
        monitor->count = 0;
        return;
    }
    const uint32_t missed =
        tpdo_monitor_close_sync(monitor, now_us, machine->sync_us, machine_answer_wait_us(machine),
                                machine->config.missed_max);
    if (missed != 0u && machine_on_path(machine)) {
        machine->statistics.missed_tpdos += missed;
    }
}

/* True when every drive is well. */
static bool drives_well(const struct machine *machine)
{
    bool well = true;
    for (uint32_t i = 0; i < machine->config.axis_count; ++i) {
        well = well && axis_healthy(&machine->axes[i]);
    }
    return well;
}

/* The same, at the end of a SYNC. */
static bool close_sync(struct machine *machine, uint32_t now_us)
{
    const bool sent = machine->sync_sent;
    bool well = true;
    for (uint32_t i = 0; i < machine->config.axis_count; ++i) {
        struct axis *axis = &machine->axes[i];
        if (sent && axis->tpdo1.count != 0u) {
            axis_compare(axis, machine->config.deviation_counts[i],
                         machine->config.deviation_syncs[i]);
        }
        if (!sent || !tpdo_monitor_close_answered(&axis->tpdo1)) {
            close_unanswered(machine, &axis->tpdo1, now_us);
        }
        if (machine->sync_now) {
            axis_synced(axis);
        }
        well = well && axis_healthy(axis);
    }
    machine->sync_us = now_us;
    return well;
}

/* Only while axes move by setpoints or by themselves: at standstill a check of a large program may take long. */
static void supervise_main_loop(struct machine *machine)
{
    if (machine->main_loop_stall_us <= MACHINE_MAIN_LOOP_STALL_US) {
        machine->main_loop_stall_us += machine->config.period_us;
    } else if (machine_on_path(machine) || machine->state == MACHINE_HOMING) {
        machine_raise(machine, FAULT_MAIN_LOOP_STALL, 0, machine->main_loop_stall_us);
    }
}

void machine_supervise(struct machine *machine, uint32_t now_us)
{
    supervise_main_loop(machine);
    const bool well = machine->sync_waits ? drives_well(machine) : close_sync(machine, now_us);
    if (well) {
        return;
    }
    for (uint8_t i = 0; i < machine->config.axis_count && machine->state != MACHINE_BOOT; ++i) {
        const struct axis *axis = &machine->axes[i];
        if (!axis_healthy(axis)) {
            supervise_axis(machine, axis, now_us);
        }
    }
}

/* The drives' clock is the SYNC, so their expected positions follow the SYNCs that have left. */
void machine_note_sync(struct machine *machine, uint32_t now_us, enum machine_sync sync)
{
    const bool sent = sync == MACHINE_SYNC_SENT;
    const uint32_t gap_us = now_us - machine->sync_left_us;
    const bool follow = machine_on_path(machine) || machine->state == MACHINE_READY;
    machine->sync_now = sent;
    machine->sync_waits = sync == MACHINE_SYNC_WAITS;
    machine->clock_paused = !sent || !machine->setpoints_sent;
    if (sent) {
        machine->sync_left_us = now_us;
    }
    if (follow && !machine->simulated && gap_us > MACHINE_GAP_US(machine->config.period_us)) {
        machine_raise_quick(machine, FAULT_SYNC_GAP, 0, gap_us);
    }
}

static void note_unsent(struct machine *machine)
{
    const bool on = machine->state != MACHINE_BOOT && machine->state != MACHINE_OFF;
    if (machine->unsent_ticks < UINT32_MAX) {
        machine->unsent_ticks++;
    }
    if (on && machine->unsent_ticks > MACHINE_UNSENT_MAX) {
        machine_raise(machine, FAULT_NOT_SENT, 0, machine->unsent_ticks);
    }
}

void machine_note_sent(struct machine *machine, struct machine_sent sent)
{
    machine->sync_sent = sent.sync;
    machine->setpoints_sent = sent.setpoints;
    if (sent.all) {
        machine->unsent_ticks = 0;
    } else {
        note_unsent(machine);
    }
}

void machine_note_waiting(struct machine *machine, uint32_t now_us)
{
    const uint32_t patience_us = 2u * machine_answer_wait_us(machine);
    if (!machine->simulated || now_us - machine->sync_left_us > patience_us) {
        note_unsent(machine);
    }
}
