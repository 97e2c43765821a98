/* SPDX-License-Identifier: MIT */
#include "app/od_read.h"

#include "app/od_read_axis.h"
#include "app/od_read_pdo.h"
#include "app/od_read_program.h"
#include "canopen/sdo_abort.h"
#include "port/port.h"

#define FIRST_MANUFACTURER_OBJECT 0x2000u

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
        return (uint64_t)(int64_t)motion_feed_um_s(motion);
    default:
        return motion_time_q32_s(motion);
    }
}

static uint64_t override_number(const struct machine *machine, uint8_t sub)
{
    const struct feed_override *feed = &machine->motion.feed;
    switch (sub) {
    case 1:
        return machine->override_percent;
    case 2:
        return machine_on_path(machine) ? feed_override_actual_q30(feed) : 0u;
    default:
        return machine_on_path(machine) && feed_override_saturated(feed) ? 1u : 0u;
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

/* Values of object 0x2050 sub 3. */
enum { NOT_CONFIGURED = 0, CONFIRMED = 1, RESTORED = 2 };

static uint64_t configuration_number(const struct controller *controller, uint8_t sub)
{
    const bool known = controller_configured(controller);
    const int state = controller->configured.restored ? RESTORED : CONFIRMED;
    switch (sub) {
    case 1:
        return controller->config.crc32;
    case 2:
        return known ? controller->configured.crc32 : 0u;
    case 3:
        return (uint64_t)(known ? state : NOT_CONFIGURED);
    case 4:
        return (uint64_t)controller->store.state;
    case 5:
        return controller->store.config_crc32;
    default:
        return controller->slot.present ? controller->slot.config_crc32 : 0u;
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
    case 0x2040:
        return (uint64_t)port_timing();
    case 0x2041:
        return program_slot_memory(controller->config.kernel, entry->sub);
    case 0x2025:
        return boot_number(&controller->boot, entry->sub);
    case 0x2055:
        return machine->unhomed_axes;
    case 0x2027:
    case 0x2028:
    case 0x2029:
    case 0x202A:
        return controller->boot.facts[entry->sub - 1u].value[entry->index - 0x2027u];
    default:
        return entry->sub > 0u ? od_read_axis(&machine->axes[entry->sub - 1u], entry->index) : 0u;
    }
}

static bool is_mirror(const struct od_entry *entry)
{
    if (entry->index == 0x2002 || entry->index == 0x2040) {
        return true;
    }
    if (entry->index == 0x2055) {
        return entry->sub == 2u;
    }
    static const uint16_t records[] = {
        0x2003, 0x2008, 0x2009, 0x200A, 0x200B, 0x200C, 0x200D, 0x200E, 0x2010, 0x2017, 0x201B,
        0x201C, 0x2024, 0x2025, 0x2026, 0x2027, 0x2028, 0x2029, 0x202A, 0x202B, 0x202C, 0x2041};
    for (size_t i = 0; i < sizeof records / sizeof records[0]; ++i) {
        if (records[i] == entry->index) {
            return entry->sub > 0u;
        }
    }
    return false;
}

/* What belongs to the mainline alone: true when the entry is such a value. */
static bool read_own(struct controller *controller, const struct od_entry *entry)
{
    if (entry->index == 0x2000 && entry->sub > 1u) {
        od_set_number(&controller->od, entry, od_read_program(controller, entry->sub));
    } else if (entry->index == 0x2050 && entry->sub > 0u) {
        od_set_number(&controller->od, entry, configuration_number(controller, entry->sub));
    } else if ((entry->index == 0x1010 || entry->index == 0x1011) && entry->sub > 0u) {
        od_set_number(&controller->od, entry, 1); /* CiA 301: it does so on command */
    } else {
        return false;
    }
    return true;
}

static void read_pdo(struct controller *controller, const struct od_entry *entry)
{
    uint64_t number;
    port_lock();
    const bool depends = od_read_pdo(&controller->machine, entry, &number);
    port_unlock();
    if (depends) {
        od_set_number(&controller->od, entry, number);
    }
}

uint32_t od_read_hook(void *context, const struct od_entry *entry)
{
    struct controller *controller = context;
    if (read_own(controller, entry)) {
        return SDO_OK;
    }
    if (entry->index < FIRST_MANUFACTURER_OBJECT) {
        read_pdo(controller, entry);
    } else if (is_mirror(entry)) {
        port_lock();
        const uint64_t number = machine_number(controller, entry);
        port_unlock();
        od_set_number(&controller->od, entry, number);
    }
    return SDO_OK;
}
