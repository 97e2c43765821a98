/* SPDX-License-Identifier: MIT */
#include <stddef.h>

#include "canopen/cob.h"
#include "canopen/pdo_map.h"
#include "canopen/sdo_abort.h"

enum {
    SUB_COB_ID = 1,
    SUB_TYPE = 2,
    SUB_INHIBIT = 3,
    TO_MAPPING = 0x200,
    FIRST_SENT = 0x1800,
    SYNCHRONOUS_MAX = 240,
    EVENT_MIN = 254
};

#define FRAME_29_BITS UINT32_C(0x20000000)
/* Bit 30 only says whether a remote request is permitted: there are none here. */
#define IDENTITY_BITS UINT32_C(0x3FFFFFFF)

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
    const unsigned way = map->index >= FIRST_SENT ? OD_READ : OD_WRITE;

    if (entry == NULL) {
        return od_missing(map->od, index, sub);
    }
    if ((entry->access & OD_MAPPABLE) == 0 || (entry->access & way) == 0 || entry->size == 0 ||
        (mapped & 0xFFu) != 8u * entry->size) {
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
