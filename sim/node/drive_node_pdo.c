/* SPDX-License-Identifier: MIT */
#include <stddef.h>

#include "canopen/cob.h"
#include "canopen/sdo_abort.h"
#include "node/drive_node_private.h"

enum { FIRST_RPDO = 0x1400, FIRST_TPDO = 0x1800, MAPPING_LAST = 0x1BFF };

/* Fields that are up to date at each SYNC anyway. */
static bool drive_node_always_fresh(const struct drive_node *node, const void *field)
{
    const struct od_drive *v = &node->values;
    return field == &v->statusword || field == &v->position_actual_value ||
           field == &v->motor_voltage || field == &v->digital_inputs;
}

/* What the mapping means for the rest of the node. */
static void drive_node_pdo_note(struct drive_node *node)
{
    node->pdos_moved = true;
    node->pdos_want_all = false;
    node->rpdo_count = 0;
    node->tpdo_count = 0;
    for (uint8_t i = 0; i < DRIVE_NODE_PDOS; i++) {
        const struct pdo_map *map = &node->tpdos[i];
        node->rpdo_count = node->rpdos[i].valid ? (uint8_t)(i + 1u) : node->rpdo_count;
        node->tpdo_count = map->valid ? (uint8_t)(i + 1u) : node->tpdo_count;
        for (int k = 0; map->valid && k < map->count; k++) {
            if (!drive_node_always_fresh(node, map->fields[k].value)) {
                node->pdos_want_all = true;
            }
        }
    }
}

void drive_node_pdo_begin(struct drive_node *node)
{
    for (uint16_t i = 0; i < DRIVE_NODE_PDOS; i++) {
        pdo_map_init(&node->rpdos[i], &node->od, (uint16_t)(FIRST_RPDO + i));
        pdo_map_init(&node->tpdos[i], &node->od, (uint16_t)(FIRST_TPDO + i));
    }
    drive_node_pdo_note(node);
}

void drive_node_pdo_rest(struct drive_node *node)
{
    for (int i = 0; i < DRIVE_NODE_PDOS; i++) {
        pdo_map_rest(&node->rpdos[i]);
        pdo_map_rest(&node->tpdos[i]);
    }
}

static bool drive_node_pdo_owns(const struct od_entry *entry)
{
    return entry->index >= FIRST_RPDO && entry->index <= MAPPING_LAST;
}

uint32_t drive_node_pdo_write(const struct drive_node *node, const struct od_entry *entry,
                              const uint8_t *value, uint32_t size)
{
    uint32_t code = SDO_OK;
    for (int i = 0; drive_node_pdo_owns(entry) && i < DRIVE_NODE_PDOS && code == SDO_OK; i++) {
        code = pdo_map_write(&node->rpdos[i], entry, value, size);
        code = code == SDO_OK ? pdo_map_write(&node->tpdos[i], entry, value, size) : code;
    }
    return code;
}

void drive_node_pdo_written(struct drive_node *node, const struct od_entry *entry)
{
    if (!drive_node_pdo_owns(entry)) {
        return;
    }
    for (int i = 0; i < DRIVE_NODE_PDOS; i++) {
        (void)pdo_map_written(&node->rpdos[i], entry);
        (void)pdo_map_written(&node->tpdos[i], entry);
    }
    drive_node_pdo_note(node);
}

/* Values of this PDO are in their fields now. */
static void drive_node_pdo_applied(struct drive_node *node, const struct pdo_map *map)
{
    for (int k = 0; k < map->count; k++) {
        if (map->fields[k].value == (const uint8_t *)&node->values.target_position) {
            node->setpoint_fresh = true;
        }
    }
}

/* Told once, not for every frame. */
static void drive_node_pdo_short(struct drive_node *node, int i, const struct can_msg *in)
{
    const struct pdo_map *map = &node->rpdos[i];
    const bool told = node->rpdos_short != 0u;
    node->rpdos_short |= (uint8_t)(1u << i);
    if (told) {
        return;
    }
    const uint8_t detail[EMCY_DETAIL_SIZE] = {(uint8_t)(map->index & 0xFFu),
                                              (uint8_t)(map->index >> 8), in->len, map->length, 0};
    emcy_producer_raise(&node->emcy, EMCY_PDO_LENGTH, EMCY_REGISTER_COMMUNICATION, detail);
}

/* The error is over with good frames, unless communication failed otherwise too. */
static void drive_node_pdo_long_enough(struct drive_node *node, int i)
{
    const bool was_short = node->rpdos_short != 0u;
    node->rpdos_short &= (uint8_t)~(1u << i);
    if (was_short && node->rpdos_short == 0u && node->values.error_code == EMCY_NO_ERROR) {
        emcy_producer_clear(&node->emcy, EMCY_REGISTER_COMMUNICATION);
    }
}

bool drive_node_pdo_receive(struct drive_node *node, const struct can_msg *in)
{
    bool ours = false;
    for (int i = 0; i < node->rpdo_count; i++) {
        struct pdo_map *map = &node->rpdos[i];
        const enum pdo_map_result result = pdo_map_receive(map, in);
        ours = ours || result != PDO_MAP_NOT;
        if (result == PDO_MAP_SHORT) {
            drive_node_pdo_short(node, i, in);
            continue;
        }
        if (result == PDO_MAP_TAKEN) {
            drive_node_pdo_long_enough(node, i);
        }
        if (result == PDO_MAP_TAKEN && !map->pending) {
            drive_node_pdo_applied(node, map);
            drive_node_control(node, node->values.controlword);
        }
    }
    return ours;
}

void drive_node_pdo_latch(struct drive_node *node)
{
    for (int i = 0; i < node->rpdo_count; i++) {
        if (pdo_map_apply(&node->rpdos[i])) {
            drive_node_pdo_applied(node, &node->rpdos[i]);
        }
    }
    drive_node_control(node, node->values.controlword);
}

void drive_node_pdo_report(struct drive_node *node)
{
    struct can_msg frame;
    drive_node_od_refresh_cyclic(node);
    if (node->pdos_want_all) {
        drive_node_od_refresh(node);
    }
    for (int i = 0; i < node->tpdo_count; i++) {
        if (pdo_map_sync(&node->tpdos[i], &frame) != 0) {
            drive_node_send(node, &frame);
        }
    }
}

static void drive_node_pdo_events(struct drive_node *node, uint32_t elapsed_us)
{
    struct can_msg frame;
    for (int i = 0; i < node->tpdo_count; i++) {
        if (!pdo_map_event_driven(&node->tpdos[i])) {
            continue;
        }
        drive_node_od_refresh(node);
        if (pdo_map_process(&node->tpdos[i], elapsed_us, &frame) != 0) {
            drive_node_send(node, &frame);
        }
    }
}

void drive_node_pdo_process(struct drive_node *node, uint32_t elapsed_us)
{
    drive_node_pdo_events(node, elapsed_us);
    for (int i = 0; i < node->rpdo_count; i++) {
        if (pdo_map_overdue(&node->rpdos[i], elapsed_us)) {
            drive_node_disconnect(node, EMCY_RPDO_TIMEOUT);
        }
    }
}
