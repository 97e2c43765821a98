/* SPDX-License-Identifier: MIT */
#include "app/od_read_pdo.h"

#include "canopen/cob.h"
#include "canopen/pdo_map.h"

#define TORQUE_OFFSET   UINT32_C(0x202B0010) /* entries of a mapping, without the sub-index */
#define VELOCITY_OFFSET UINT32_C(0x202C0020)

enum { SUB_COUNT = 0, SUB_COB_ID = 1, SUB_THIRD = 3 };

static uint32_t cob_id(const struct machine *machine, uint32_t axis, uint32_t base, bool on)
{
    const uint32_t off = on && axis < machine->config.axis_count ? 0u : PDO_MAP_OFF;
    return off | (base + machine->axes[axis].node);
}

static uint32_t mapped(uint32_t object, uint32_t axis, bool is)
{
    return is ? object | ((axis + 1u) << 8) : 0u;
}

static bool communication(const struct machine *machine, const struct od_entry *entry,
                          uint64_t *number)
{
    const uint32_t pdo = entry->index & 0xFFu;
    const uint32_t axis = pdo % AXES_MAX;
    if (entry->sub != SUB_COB_ID) {
        return false;
    }
    if (entry->index < 0x1800u) {
        *number = cob_id(machine, axis, COB_TPDO1, true);
    } else if (pdo < AXES_MAX) {
        *number = cob_id(machine, axis, COB_RPDO1, true);
    } else {
        *number = cob_id(machine, axis, COB_RPDO2, machine->axes[axis].velocity_mapped);
    }
    return true;
}

static bool setpoint_mapping(const struct axis *axis, uint32_t i, uint8_t sub, uint64_t *number)
{
    if (sub == SUB_COUNT) {
        *number = axis->torque_mapped ? 3u : 2u;
        return true;
    }
    *number = mapped(TORQUE_OFFSET, i, axis->torque_mapped);
    return sub == SUB_THIRD;
}

static bool velocity_mapping(const struct axis *axis, uint32_t i, uint8_t sub, uint64_t *number)
{
    *number = sub == SUB_COUNT ? (axis->velocity_mapped ? 1u : 0u)
                               : mapped(VELOCITY_OFFSET, i, axis->velocity_mapped);
    return true;
}

bool od_read_pdo(const struct machine *machine, const struct od_entry *entry, uint64_t *number)
{
    const uint32_t pdo = entry->index & 0xFFu;
    const struct axis *axis = &machine->axes[pdo % AXES_MAX];
    switch (entry->index & 0xFF00u) {
    case 0x1400:
    case 0x1800:
        return communication(machine, entry, number);
    case 0x1A00:
        return pdo < AXES_MAX ? setpoint_mapping(axis, pdo, entry->sub, number)
                              : velocity_mapping(axis, pdo - AXES_MAX, entry->sub, number);
    default:
        return false;
    }
}
