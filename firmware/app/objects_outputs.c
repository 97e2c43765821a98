/* SPDX-License-Identifier: MIT */
/* Implements app/objects_outputs.h (see there): handlers of the objects of the outputs, for the table in objects.c.
 * Called by objects.c only. Main loop; readers under the lock. Changes the outputs at standstill, for which it takes the
 * lock, and outputs_stay. */
#include "app/objects_outputs.h"

#include "canopen/cob.h"
#include "canopen/pdo_map.h"
#include "canopen/sdo_abort.h"
#include "port/port.h"

/* ---- TPDO13: 0x180C, 0x1A0C, 0x2036 ---- */

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

/* ---- 0x2058: the outputs at standstill ---- */

/* Sub 7: subs 1 to 5 one after the other, from the lowest bit on. */
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

void object_written_outputs_stay(struct controller *controller)
{
    uint8_t *stay = &controller->values.outputs_at_standstill.stay_at_end;
    port_lock();
    if (machine_on_path(&controller->machine)) {
        controller->machine.outputs_stay = *stay != 0u;
        *stay = 0;
    }
    port_unlock();
}
