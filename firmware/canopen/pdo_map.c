/* SPDX-License-Identifier: MIT */
/* What the dictionary says of a PDO, taken over. */
#include "canopen/pdo_map.h"

#include <assert.h>
#include <stddef.h>
#include <string.h>

#include "canopen/cob.h"

enum { SUB_COB_ID = 1, SUB_TYPE = 2, SUB_INHIBIT = 3, SUB_EVENT = 5, TO_MAPPING = 0x200 };

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
    pdo_map_rest(map);
}

bool pdo_map_written(struct pdo_map *map, const struct od_entry *entry)
{
    if (entry->index == map->index) {
        take_communication(map);
        pdo_map_rest(map);
        return true;
    }
    if (entry->index == map->index + TO_MAPPING) {
        take_mapping(map);
        pdo_map_rest(map);
        return true;
    }
    return false;
}
