/* SPDX-License-Identifier: MIT */
/* Implements canopen/pdo_map.h (see there): one remappable PDO of a device: parameters, mapping, packing, times. Used
 * by app/objects_axis, app/objects_outputs and sim/node. All functions of one PDO in one context. Changes its struct and
 * the mapped values of the dictionary; no I/O. */
#include "canopen/pdo_map.h"

#include <assert.h>
#include <stddef.h>
#include <string.h>

#include "canopen/cob.h"
#include "canopen/sdo_abort.h"

enum {
    SUB_COB_ID = 1,
    SUB_TYPE = 2,
    SUB_INHIBIT = 3,
    SUB_EVENT = 5,
    TO_MAPPING = 0x200,
    FIRST_SENT = 0x1800,
    SYNCHRONOUS_MAX = 240,
    EVENT_MIN = 254
};

#define FRAME_29_BITS UINT32_C(0x20000000)
/* Bit 30 (remote requests permitted) has no meaning: there are no remote requests. */
#define IDENTITY_BITS UINT32_C(0x3FFFFFFF)

/* ---- Parameters, as the dictionary has them ---- */

static uint32_t parameter(const struct pdo_map *map, uint16_t index, uint8_t sub)
{
    const struct od_entry *entry = od_find(map->od, index, sub);

    return entry == NULL ? 0 : (uint32_t)od_number(map->od, entry);
}

static void take_communication(struct pdo_map *map)
{
    const uint32_t cob_id = parameter(map, map->index, SUB_COB_ID);

    map->valid = (cob_id & PDO_MAP_OFF) == 0;
    map->cob_id = (uint16_t)(cob_id & CAN_ID_MAX);
    map->type = (uint8_t)parameter(map, map->index, SUB_TYPE);
    map->inhibit_us = 100u * parameter(map, map->index, SUB_INHIBIT);
    map->event_us = 1000u * parameter(map, map->index, SUB_EVENT);
}

static void take_mapping(struct pdo_map *map)
{
    const uint16_t index = (uint16_t)(map->index + TO_MAPPING);

    map->count = (uint8_t)parameter(map, index, 0);
    map->length = 0;
    for (uint8_t i = 0; i < map->count; i++) {
        const uint32_t mapped = parameter(map, index, (uint8_t)(i + 1u));
        const struct od_entry *entry =
            od_find(map->od, (uint16_t)(mapped >> 16), (uint8_t)((mapped >> 8) & 0xFFu));
        assert(entry != NULL && map->length + entry->size <= CAN_DATA_MAX);
        map->fields[i].value = map->od->storage + entry->offset;
        map->fields[i].size = (uint8_t)entry->size;
        map->length = (uint8_t)(map->length + entry->size);
    }
}

void pdo_map_init(struct pdo_map *map, struct od *od, uint16_t index)
{
    memset(map, 0, sizeof *map);
    map->od = od;
    map->index = index;
    take_communication(map);
    take_mapping(map);
    pdo_map_restart(map);
}

bool pdo_map_written(struct pdo_map *map, const struct od_entry *entry)
{
    if (entry->index == map->index) {
        take_communication(map);
        pdo_map_restart(map);
        return true;
    }
    if (entry->index == map->index + TO_MAPPING) {
        take_mapping(map);
        pdo_map_restart(map);
        return true;
    }
    return false;
}

/* ---- Checks of writes ---- */

struct id_range {
    uint16_t first;
    uint16_t last;
};

/* Identifiers of other services (CiA 301, table 40). */
static const struct id_range restricted[] = {
    {0x000, 0x07F}, {0x080, 0x080}, {0x101, 0x180}, {0x581, 0x5FF},
    {0x601, 0x67F}, {0x6E0, 0x6FF}, {0x701, 0x7FF},
};

static bool is_restricted(uint32_t id)
{
    for (size_t i = 0; i < sizeof restricted / sizeof restricted[0]; i++) {
        if (id >= restricted[i].first && id <= restricted[i].last) {
            return true;
        }
    }
    return false;
}

static uint32_t check_cob_id(const struct pdo_map *map, uint32_t value)
{
    const bool on = (value & PDO_MAP_OFF) == 0;

    if ((value & FRAME_29_BITS) != 0 || (value & IDENTITY_BITS) > CAN_ID_MAX) {
        return SDO_ABORT_VALUE;
    }
    if (map->valid && on && (value & CAN_ID_MAX) != map->cob_id) {
        return SDO_ABORT_VALUE;
    }
    return on && is_restricted(value & CAN_ID_MAX) ? SDO_ABORT_VALUE : SDO_OK;
}

static uint32_t check_communication(const struct pdo_map *map, uint8_t sub, uint32_t value)
{
    switch (sub) {
    case SUB_COB_ID:
        return check_cob_id(map, value);
    case SUB_TYPE:
        return value <= SYNCHRONOUS_MAX || value >= EVENT_MIN ? SDO_OK : SDO_ABORT_VALUE;
    case SUB_INHIBIT:
        return map->valid ? SDO_ABORT_STATE : SDO_OK;
    default:
        return SDO_OK;
    }
}

static uint32_t check_entry(const struct pdo_map *map, uint32_t mapped)
{
    const uint16_t index = (uint16_t)(mapped >> 16);
    const uint8_t sub = (uint8_t)((mapped >> 8) & 0xFFu);
    const struct od_entry *entry = od_find(map->od, index, sub);
    const unsigned direction = map->index >= FIRST_SENT ? OD_READ : OD_WRITE;

    if (entry == NULL) {
        return od_missing(map->od, index, sub);
    }
    if ((entry->access & OD_MAPPABLE) == 0 || (entry->access & direction) == 0 ||
        entry->size == 0 || (mapped & 0xFFu) != 8u * entry->size) {
        return SDO_ABORT_NOT_MAPPABLE;
    }
    return SDO_OK;
}

/* Sub 0: the entries that it puts into force. */
static uint32_t check_count(const struct pdo_map *map, uint32_t count)
{
    uint32_t bits = 0;

    if (count > PDO_MAP_ENTRIES) {
        return SDO_ABORT_PDO_LENGTH;
    }
    for (uint32_t i = 1; i <= count; i++) {
        const struct od_entry *at =
            od_find(map->od, (uint16_t)(map->index + TO_MAPPING), (uint8_t)i);
        if (at == NULL) {
            return SDO_ABORT_PDO_LENGTH;
        }
        const uint32_t mapped = (uint32_t)od_number(map->od, at);
        const uint32_t code = check_entry(map, mapped);
        if (code != SDO_OK) {
            return code;
        }
        bits += mapped & 0xFFu;
    }
    return bits > 8u * CAN_DATA_MAX ? SDO_ABORT_PDO_LENGTH : SDO_OK;
}

static uint32_t check_mapping(const struct pdo_map *map, uint8_t sub, uint32_t value)
{
    if (map->valid) {
        return SDO_ABORT_STATE;
    }
    if (sub == 0) {
        return check_count(map, value);
    }
    if (map->count != 0) {
        return SDO_ABORT_STATE;
    }
    return value == 0 ? SDO_OK : check_entry(map, value);
}

uint32_t pdo_map_write(const struct pdo_map *map, const struct od_entry *entry,
                       const uint8_t *value, uint32_t size)
{
    const uint32_t number = (uint32_t)cob_get(value, size);

    if (entry->index == map->index) {
        return check_communication(map, entry->sub, number);
    }
    if (entry->index == map->index + TO_MAPPING) {
        return check_mapping(map, entry->sub, number);
    }
    return SDO_OK;
}

/* ---- Frames ---- */

/* 2 and 4 bytes without a loop, since this is each tick's work. */
static void field_store(const struct pdo_field *field, const uint8_t *from)
{
    uint16_t u16;
    uint32_t u32;
    uint64_t u64;

    switch (field->size) {
    case 1:
        *field->value = *from;
        break;
    case 2:
        u16 = (uint16_t)(from[0] | (from[1] << 8));
        memcpy(field->value, &u16, sizeof u16);
        break;
    case 4:
        u32 = from[0] | ((uint32_t)from[1] << 8) | ((uint32_t)from[2] << 16) |
              ((uint32_t)from[3] << 24);
        memcpy(field->value, &u32, sizeof u32);
        break;
    default:
        u64 = cob_get(from, field->size);
        memcpy(field->value, &u64, sizeof u64);
        break;
    }
}

static void field_load(const struct pdo_field *field, uint8_t *to)
{
    uint16_t u16;
    uint32_t u32;
    uint64_t u64;

    switch (field->size) {
    case 1:
        *to = *field->value;
        break;
    case 2:
        memcpy(&u16, field->value, sizeof u16);
        to[0] = (uint8_t)(u16 & 0xFFu);
        to[1] = (uint8_t)(u16 >> 8);
        break;
    case 4:
        memcpy(&u32, field->value, sizeof u32);
        to[0] = (uint8_t)(u32 & 0xFFu);
        to[1] = (uint8_t)((u32 >> 8) & 0xFFu);
        to[2] = (uint8_t)((u32 >> 16) & 0xFFu);
        to[3] = (uint8_t)(u32 >> 24);
        break;
    default:
        memcpy(&u64, field->value, sizeof u64);
        cob_put(to, u64, field->size);
        break;
    }
}

void pdo_map_restart(struct pdo_map *map)
{
    map->waited_us = map->inhibit_us;
    map->syncs = 0;
    map->pending = false;
    map->watched = false;
    map->last.len = 0;
}

static void unpack(const struct pdo_map *map)
{
    const uint8_t *from = map->last.data;

    for (uint8_t i = 0; i < map->count; i++) {
        field_store(&map->fields[i], from);
        from += map->fields[i].size;
    }
}

static void pack(const struct pdo_map *map, struct can_msg *out)
{
    uint8_t *to = out->data;

    cob_frame(out, map->cob_id, map->length);
    for (uint8_t i = 0; i < map->count; i++) {
        field_load(&map->fields[i], to);
        to += map->fields[i].size;
    }
}

enum pdo_map_result pdo_map_receive(struct pdo_map *map, const struct can_msg *in)
{
    if (!map->valid || in->id != map->cob_id || map->count == 0) {
        return PDO_MAP_NOT;
    }
    if (in->len < map->length) {
        return PDO_MAP_SHORT;
    }
    map->last = *in;
    map->waited_us = 0;
    map->watched = true;
    map->pending = true;
    if (map->type > SYNCHRONOUS_MAX) {
        (void)pdo_map_apply(map);
    }
    return PDO_MAP_TAKEN;
}

bool pdo_map_apply(struct pdo_map *map)
{
    if (!map->pending) {
        return false;
    }
    map->pending = false;
    unpack(map);
    return true;
}

static void wait(struct pdo_map *map, uint32_t elapsed_us)
{
    map->waited_us =
        map->waited_us > UINT32_MAX - elapsed_us ? UINT32_MAX : map->waited_us + elapsed_us;
}

bool pdo_map_overdue(struct pdo_map *map, uint32_t elapsed_us)
{
    if (!map->watched || map->event_us == 0) {
        return false;
    }
    wait(map, elapsed_us);
    if (map->waited_us <= map->event_us) {
        return false;
    }
    map->watched = false;
    return true;
}

/* Packs; returns whether the content differs from what was sent last. */
static bool renew(struct pdo_map *map, struct can_msg *out)
{
    pack(map, out);
    return map->last.len != out->len || memcmp(map->last.data, out->data, out->len) != 0;
}

static bool sent(struct pdo_map *map, const struct can_msg *out)
{
    map->last = *out;
    map->waited_us = 0;
    map->syncs = 0;
    return true;
}

bool pdo_map_sync(struct pdo_map *map, struct can_msg *out)
{
    if (!map->valid || map->count == 0 || map->type > SYNCHRONOUS_MAX) {
        return false;
    }
    if (map->type == 0) {
        return renew(map, out) && sent(map, out);
    }
    map->syncs++;
    if (map->syncs < map->type) {
        return false;
    }
    map->syncs = 0;
    pack(map, out);
    return true;
}

bool pdo_map_event_driven(const struct pdo_map *map)
{
    return map->valid && map->count != 0 && map->type > SYNCHRONOUS_MAX;
}

bool pdo_map_process(struct pdo_map *map, uint32_t elapsed_us, struct can_msg *out)
{
    if (!pdo_map_event_driven(map)) {
        return false;
    }
    wait(map, elapsed_us);
    if (map->waited_us < map->inhibit_us) {
        return false;
    }
    const bool changed = renew(map, out);
    const bool due = map->event_us != 0 && map->waited_us >= map->event_us;
    return (changed || due) && sent(map, out);
}
