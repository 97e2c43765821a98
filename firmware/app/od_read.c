/* SPDX-License-Identifier: MIT */
#include "app/od_read.h"

#include "canopen/sdo_abort.h"
#include "port/port.h"

static uint64_t of_i32(int32_t value)
{
    return (uint64_t)(int64_t)value;
}

static uint64_t header_number(const struct program_slot *slot, uint8_t sub)
{
    const struct program_header *header = &slot->program.header;
    switch (sub) {
    case 5:
        return header->crc32;
    case 6:
        return header->image_size;
    case 7:
        return header->segment_count;
    case 8:
        return header->piece_count;
    case 9:
        return program_ticks(&slot->program);
    case 10:
        return header->duration_q32_s;
    case 11:
        return (uint64_t)header->length_q40_mm;
    default:
        return 0;
    }
}

static uint64_t place_number(struct controller *controller, uint8_t sub)
{
    struct program_slot *slot = &controller->slot;
    program_slot_refresh(slot, &controller->config);
    const int32_t *counts = sub < 14u ? slot->start_counts : slot->end_counts;
    return of_i32(counts[sub & 1u]);
}

static uint64_t program_number(struct controller *controller, uint8_t sub)
{
    const struct program_slot *slot = &controller->slot;
    switch (sub) {
    case 2:
        return (uint64_t)program_slot_state(slot);
    case 3:
        return of_i32(slot->refused.code);
    case 4:
        return slot->refused.index;
    default:
        break;
    }
    if (!slot->present) {
        return 0;
    }
    return sub < 12u ? header_number(slot, sub) : place_number(controller, sub);
}

/* While the drives are being looked for, node and detail tell which one keeps the others waiting.
 */
static uint64_t fault_number(const struct controller *controller, uint8_t sub)
{
    const struct machine *machine = &controller->machine;
    const bool booting = machine->state == MACHINE_BOOT;
    switch (sub) {
    case 1:
        return machine->fault.code;
    case 2:
        return booting ? controller->boot.trouble.node : machine->fault.node;
    case 3:
        return booting ? controller->boot.trouble.abort_code : machine->fault.detail;
    default:
        return (uint64_t)controller->refusal;
    }
}

static uint64_t statistics_number(const struct statistics *statistics, uint8_t sub)
{
    switch (sub) {
    case 1:
        return statistics->syncs;
    case 2:
        return statistics->program_tick;
    case 3:
        return statistics->deadline_misses;
    case 4:
        return statistics->worst_late_ns / 1000u;
    case 5:
        return statistics->worst_tick_ns;
    case 6:
        return statistics->missed_tpdos;
    default:
        return statistics->frames_not_sent;
    }
}

static uint64_t motion_number(const struct motion *motion, uint8_t sub)
{
    switch (sub) {
    case 1:
        return (uint64_t)motion->point.arc_length_q40_mm;
    case 2:
        return of_i32(motion_feed_um_s(motion));
    default:
        return motion->time_q32_s;
    }
}

static uint64_t override_number(const struct machine *machine, uint8_t sub)
{
    const struct timebase *timebase = &machine->motion.timebase;
    switch (sub) {
    case 1:
        return machine->override_percent;
    case 2:
        return machine_on_path(machine) ? timebase_rate_q30(timebase) : 0u;
    default:
        return machine_on_path(machine) && timebase_saturated(timebase) ? 1u : 0u;
    }
}

static uint64_t boot_number(const struct drive_boot *boot, uint8_t sub)
{
    switch (sub) {
    case 1:
        return boot->trouble.node;
    case 2:
        return boot->trouble.object;
    case 3:
        return boot->trouble.abort_code;
    default:
        return boot->trouble.value;
    }
}

static uint64_t drive_state(const struct axis *axis)
{
    return axis->answers.present ? (uint64_t)axis->state + 1u : 0u;
}

static uint64_t axis_number(const struct axis *axis, uint16_t index)
{
    switch (index) {
    case 0x2017:
        return axis->homed ? 1u : 0u;
    case 0x201B:
        return axis->digital_inputs;
    case 0x201C:
        return of_i32(axis->following_error_counts);
    case 0x2024:
        return axis->answers.missed;
    case 0x2026:
        return drive_state(axis);
    case 0x200A:
        return axis->statusword;
    case 0x200B:
        return of_i32(axis->position_counts);
    case 0x200C:
        return axis->error_code;
    case 0x200D:
        return of_i32(axis->target_sent_counts);
    default:
        return axis->controlword;
    }
}

static uint64_t machine_number(const struct controller *controller, const struct od_entry *entry)
{
    const struct machine *machine = &controller->machine;
    switch (entry->index) {
    case 0x2002:
        return (uint64_t)machine->state;
    case 0x2003:
        return fault_number(controller, entry->sub);
    case 0x2008:
        return statistics_number(&machine->statistics, entry->sub);
    case 0x2009:
        return motion_number(&machine->motion, entry->sub);
    case 0x2010:
        return override_number(machine, entry->sub);
    case 0x2025:
        return boot_number(&controller->boot, entry->sub);
    case 0x2027:
    case 0x2028:
    case 0x2029:
    case 0x202A:
        return controller->boot.facts[entry->sub - 1u].value[entry->index - 0x2027u];
    default:
        return axis_number(&machine->axes[entry->sub - 1u], entry->index);
    }
}

static bool is_mirror(const struct od_entry *entry)
{
    if (entry->index == 0x2002) {
        return true;
    }
    static const uint16_t records[] = {0x2003, 0x2008, 0x2009, 0x200A, 0x200B, 0x200C, 0x200D,
                                       0x200E, 0x2010, 0x2017, 0x201B, 0x201C, 0x2024, 0x2025,
                                       0x2026, 0x2027, 0x2028, 0x2029, 0x202A};
    for (size_t i = 0; i < sizeof records / sizeof records[0]; ++i) {
        if (records[i] == entry->index) {
            return entry->sub > 0u;
        }
    }
    return false;
}

uint32_t od_read_hook(void *context, const struct od_entry *entry)
{
    struct controller *controller = context;
    if (entry->index == 0x2000 && entry->sub > 1u) {
        od_set_number(&controller->od, entry, program_number(controller, entry->sub));
    } else if (is_mirror(entry)) {
        port_lock();
        const uint64_t number = machine_number(controller, entry);
        port_unlock();
        od_set_number(&controller->od, entry, number);
    }
    return SDO_OK;
}
