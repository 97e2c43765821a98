/* SPDX-License-Identifier: MIT */
/* A PDO at work: frames taken and sent as its parameters say. */
#include <stddef.h>
#include <string.h>

#include "canopen/cob.h"
#include "canopen/pdo_map.h"

enum { SYNCHRONOUS_MAX = 240 };

void pdo_map_rest(struct pdo_map *map)
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
        pdo_field_store(&map->fields[i], from);
        from += map->fields[i].size;
    }
}

static void pack(const struct pdo_map *map, struct can_msg *out)
{
    uint8_t *to = out->data;

    cob_frame(out, map->cob_id, map->length);
    for (uint8_t i = 0; i < map->count; i++) {
        pdo_field_load(&map->fields[i], to);
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

static int sent(struct pdo_map *map, const struct can_msg *out)
{
    map->last = *out;
    map->waited_us = 0;
    map->syncs = 0;
    return 1;
}

int pdo_map_sync(struct pdo_map *map, struct can_msg *out)
{
    if (!map->valid || map->count == 0 || map->type > SYNCHRONOUS_MAX) {
        return 0;
    }
    if (map->type == 0) {
        return renew(map, out) ? sent(map, out) : 0;
    }
    map->syncs++;
    if (map->syncs < map->type) {
        return 0;
    }
    map->syncs = 0;
    pack(map, out);
    return 1;
}

bool pdo_map_event_driven(const struct pdo_map *map)
{
    return map->valid && map->count != 0 && map->type > SYNCHRONOUS_MAX;
}

int pdo_map_process(struct pdo_map *map, uint32_t elapsed_us, struct can_msg *out)
{
    if (!pdo_map_event_driven(map)) {
        return 0;
    }
    wait(map, elapsed_us);
    if (map->waited_us < map->inhibit_us) {
        return 0;
    }
    const bool changed = renew(map, out);
    const bool due = map->event_us != 0 && map->waited_us >= map->event_us;
    return changed || due ? sent(map, out) : 0;
}
