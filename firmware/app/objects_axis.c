/* SPDX-License-Identifier: MIT */
/* Implements app/objects_axis.h (see there): handlers of objects that have one value for each axis, for the table in
 * objects.c, and of the outputs. Called by objects.c only. Main loop; reads under the lock. Changes the outputs at
 * standstill only, for which it takes the lock. */
#include "app/objects_axis.h"

#include "canopen/cob.h"
#include "canopen/pdo_map.h"
#include "canopen/sdo_abort.h"
#include "port/port.h"

static const struct axis *axis_of(const struct controller *controller, const struct od_entry *entry)
{
    return &controller->machine.axes[entry->sub - 1u];
}

uint64_t object_read_statusword(struct controller *controller, const struct od_entry *entry)
{
    return axis_of(controller, entry)->statusword;
}

uint64_t object_read_position(struct controller *controller, const struct od_entry *entry)
{
    return (uint64_t)(int64_t)axis_of(controller, entry)->position_counts;
}

uint64_t object_read_error_code(struct controller *controller, const struct od_entry *entry)
{
    return axis_of(controller, entry)->error_code;
}

uint64_t object_read_target(struct controller *controller, const struct od_entry *entry)
{
    return (uint64_t)(int64_t)axis_of(controller, entry)->target_sent_counts;
}

uint64_t object_read_controlword(struct controller *controller, const struct od_entry *entry)
{
    return axis_of(controller, entry)->controlword;
}

uint64_t object_read_torque_offset(struct controller *controller, const struct od_entry *entry)
{
    return (uint64_t)(int64_t)axis_of(controller, entry)->torque_offset_permille;
}

uint64_t object_read_velocity_offset(struct controller *controller, const struct od_entry *entry)
{
    return (uint64_t)(int64_t)axis_of(controller, entry)->velocity_offset_counts_s;
}

uint64_t object_read_homed(struct controller *controller, const struct od_entry *entry)
{
    return axis_of(controller, entry)->homed ? 1u : 0u;
}

uint64_t object_read_inputs(struct controller *controller, const struct od_entry *entry)
{
    return axis_of(controller, entry)->digital_inputs;
}

uint64_t object_read_following_error(struct controller *controller, const struct od_entry *entry)
{
    return (uint64_t)(int64_t)axis_of(controller, entry)->following_error_counts;
}

uint64_t object_read_missed(struct controller *controller, const struct od_entry *entry)
{
    return axis_of(controller, entry)->tpdo1.missed;
}

uint64_t object_read_drive_state(struct controller *controller, const struct od_entry *entry)
{
    const struct axis *axis = axis_of(controller, entry);
    return axis->tpdo1.present ? (uint64_t)axis->state + 1u : 0u;
}

uint64_t object_read_identity(struct controller *controller, const struct od_entry *entry)
{
    const bool is_axis = entry->sub <= controller->config.axis_count; /* then: the I/O module */
    return is_axis ? controller->boot.properties[entry->sub - 1u].value[entry->index - 0x2027u]
                   : 0u;
}

/* ---- PDO parameters: 0x1400, 0x1800, 0x1A00 + i of axis i; 0x1806, 0x1A06 + i ---- */

#define TORQUE_OFFSET   UINT32_C(0x202B0010) /* entries of a mapping, without the sub-index */
#define VELOCITY_OFFSET UINT32_C(0x202C0020)

static uint32_t pdo_axis(const struct od_entry *entry)
{
    return (entry->index & 0xFFu) % AXES_MAX;
}

static const struct axis *axis_of_pdo(const struct controller *controller,
                                      const struct od_entry *entry)
{
    return &controller->machine.axes[pdo_axis(entry)];
}

static uint32_t cob_id(const struct controller *controller, const struct od_entry *entry,
                       uint32_t base, bool on)
{
    const struct machine *machine = &controller->machine;
    const uint32_t axis = pdo_axis(entry);
    const uint32_t off = on && axis < machine->config.axis_count ? 0u : PDO_MAP_OFF;
    return off | (base + machine->axes[axis].node);
}

static uint32_t mapped(uint32_t object, const struct od_entry *entry, bool is)
{
    return is ? object | ((pdo_axis(entry) + 1u) << 8) : 0u;
}

uint64_t object_read_actual_cob_id(struct controller *controller, const struct od_entry *entry)
{
    return cob_id(controller, entry, COB_TPDO1, true);
}

uint64_t object_read_setpoint_cob_id(struct controller *controller, const struct od_entry *entry)
{
    return cob_id(controller, entry, COB_RPDO1, true);
}

uint64_t object_read_velocity_cob_id(struct controller *controller, const struct od_entry *entry)
{
    return cob_id(controller, entry, COB_RPDO2, axis_of_pdo(controller, entry)->velocity_mapped);
}

uint64_t object_read_setpoint_count(struct controller *controller, const struct od_entry *entry)
{
    return axis_of_pdo(controller, entry)->torque_mapped ? 3u : 2u;
}

uint64_t object_read_setpoint_torque(struct controller *controller, const struct od_entry *entry)
{
    return mapped(TORQUE_OFFSET, entry, axis_of_pdo(controller, entry)->torque_mapped);
}

uint64_t object_read_velocity_count(struct controller *controller, const struct od_entry *entry)
{
    return axis_of_pdo(controller, entry)->velocity_mapped ? 1u : 0u;
}

uint64_t object_read_velocity_mapped(struct controller *controller, const struct od_entry *entry)
{
    return mapped(VELOCITY_OFFSET, entry, axis_of_pdo(controller, entry)->velocity_mapped);
}

/* ---- The outputs of the path: 0x180C, 0x1A0C, 0x2036 ---- */

/* entry of a PDO mapping: object 0x2036, the outputs of the I/O module */
#define OUTPUTS UINT32_C(0x20360000)

uint64_t object_read_outputs_cob_id(struct controller *controller, const struct od_entry *entry)
{
    const uint32_t node = controller->machine.config.outputs.node;
    (void)entry;
    return (node != 0u ? 0u : PDO_MAP_OFF) | (COB_RPDO1 + node);
}

/* Entry `i` of the mapping, from 0: bytes of digital outputs are subs 1 and 2, analogue ones subs 3 to 5. */
static uint32_t outputs_entry(const struct config_outputs *outputs, uint32_t i)
{
    const uint32_t bytes = outputs->digital_count / 8u;
    const uint32_t analogue = i - bytes;
    if (i < bytes) {
        return OUTPUTS | ((i + 1u) << 8) | 8u;
    }
    return analogue < outputs->analogue_count ? OUTPUTS | ((analogue + 3u) << 8) | 16u : 0u;
}

uint64_t object_read_outputs_mapping(struct controller *controller, const struct od_entry *entry)
{
    const struct config_outputs *outputs = &controller->machine.config.outputs;
    if (entry->sub == 0u) {
        return outputs->digital_count / 8u + outputs->analogue_count;
    }
    return outputs_entry(outputs, entry->sub - 1u);
}

static uint64_t outputs_value(const struct path_outputs_values *values, uint8_t sub)
{
    if (sub <= 2u) {
        return (values->digital >> (8u * (sub - 1u))) & 0xFFu;
    }
    return (uint64_t)(int64_t)values->analogue[sub - 3u];
}

uint64_t object_read_outputs(struct controller *controller, const struct od_entry *entry)
{
    return outputs_value(&controller->tick.outputs.sent, entry->sub);
}

/* Sub 7 of object 0x2058: subs 1 to 5 one after the other, from the lowest bit on. */
#define OUTPUTS_ALL 7u

static uint64_t outputs_together(const struct path_outputs_values *values)
{
    uint64_t together = values->digital;
    for (uint32_t i = 0; i < PROGRAM_ANALOGUES; ++i) {
        together |= (uint64_t)(uint16_t)values->analogue[i] << (16u * (i + 1u));
    }
    return together;
}

static void set_outputs(struct path_outputs_values *values, uint8_t sub, uint64_t number)
{
    if (sub == OUTPUTS_ALL) {
        values->digital = (uint16_t)number;
        for (uint32_t i = 0; i < PROGRAM_ANALOGUES; ++i) {
            values->analogue[i] = (int16_t)(uint16_t)(number >> (16u * (i + 1u)));
        }
    } else if (sub <= 2u) {
        const unsigned shift = 8u * (sub - 1u);
        values->digital = (uint16_t)((values->digital & ~(0xFFu << shift)) | number << shift);
    } else {
        values->analogue[sub - 3u] = (int16_t)number;
    }
}

uint64_t object_read_rest_outputs(struct controller *controller, const struct od_entry *entry)
{
    const struct path_outputs_values *values = &controller->machine.motion.outputs.values;
    return entry->sub == OUTPUTS_ALL ? outputs_together(values) : outputs_value(values, entry->sub);
}

uint32_t object_write_rest_outputs(struct controller *controller, const struct od_entry *entry,
                                   uint64_t number)
{
    port_lock();
    struct path_outputs_values values = controller->machine.motion.outputs.values;
    set_outputs(&values, entry->sub, number);
    const bool possible = machine_set_outputs(&controller->machine, &values);
    port_unlock();
    return possible ? SDO_OK : SDO_ABORT_STATE;
}
