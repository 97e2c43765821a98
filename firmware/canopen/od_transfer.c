/* SPDX-License-Identifier: MIT */
/* Implements canopen/od_transfer.h: writes or reads one object of a dictionary piece by piece. Called by
 * canopen/sdo_server. Main loop. Changes its struct and the dictionary; no I/O. */
#include "canopen/od_transfer.h"

#include <stddef.h>
#include <string.h>

#include "canopen/sdo_abort.h"

void od_transfer_init(struct od_transfer *t, struct od *od)
{
    memset(t, 0, sizeof *t);
    t->od = od;
}

/* Finds the transfer's entry and checks the access. */
static uint32_t find(struct od_transfer *t, uint16_t index, uint8_t sub, uint8_t access,
                     uint32_t refusal)
{
    t->entry = od_find(t->od, index, sub);
    if (t->entry == NULL) {
        return od_missing(t->od, index, sub);
    }
    return (t->entry->access & access) == 0 ? refusal : SDO_OK;
}

static uint32_t room(const struct od_transfer *t)
{
    return t->entry->size < OD_VALUE_MAX ? t->entry->size : OD_VALUE_MAX;
}

static uint32_t open_value(const struct od_transfer *t)
{
    if (t->size > room(t)) {
        return SDO_ABORT_TOO_LONG;
    }
    if (t->size != 0 && t->size < t->entry->size && t->entry->type != OD_VISIBLE_STRING) {
        return SDO_ABORT_TOO_SHORT;
    }
    return SDO_OK;
}

static uint32_t open_domain(struct od_transfer *t)
{
    const struct od_hooks *hooks = t->od->hooks;
    uint32_t code;

    if (hooks->domain_begin == NULL || hooks->domain_write == NULL) {
        return SDO_ABORT_ACCESS;
    }
    code = hooks->domain_begin(t->od->context, t->entry, t->size);
    t->open = code == SDO_OK;
    return code;
}

uint32_t od_transfer_begin_write(struct od_transfer *t, uint16_t index, uint8_t sub,
                                 uint32_t announced)
{
    const uint32_t code = find(t, index, sub, OD_WRITE, SDO_ABORT_READ_ONLY);

    t->size = announced;
    t->moved = 0;
    if (code != SDO_OK) {
        return code;
    }
    return t->entry->type == OD_DOMAIN ? open_domain(t) : open_value(t);
}

uint32_t od_transfer_put(struct od_transfer *t, const uint8_t *data, uint32_t size)
{
    uint32_t code = SDO_OK;

    if (t->size != 0 && size > t->size - t->moved) {
        return SDO_ABORT_TOO_LONG;
    }
    if (t->entry->type != OD_DOMAIN) {
        if (size > room(t) - t->moved) {
            return SDO_ABORT_TOO_LONG;
        }
        memcpy(t->value + t->moved, data, size);
    } else if (size > UINT32_MAX - t->moved) {
        code = SDO_ABORT_MEMORY;
    } else if (size > 0) {
        code = t->od->hooks->domain_write(t->od->context, t->entry, t->moved, data, size);
    }
    if (code == SDO_OK) {
        t->moved += size;
    }
    return code;
}

uint32_t od_transfer_finish_write(struct od_transfer *t)
{
    const struct od_hooks *hooks = t->od->hooks;
    uint32_t code = SDO_OK;

    if (t->size != 0 && t->moved < t->size) {
        return SDO_ABORT_TOO_SHORT;
    }
    if (t->entry->type != OD_DOMAIN) {
        return od_write(t->od, t->entry, t->value, t->moved);
    }
    if (hooks->domain_end != NULL) {
        code = hooks->domain_end(t->od->context, t->entry, t->moved);
    }
    t->open = t->open && code != SDO_OK;
    return code;
}

uint32_t od_transfer_begin_read(struct od_transfer *t, uint16_t index, uint8_t sub)
{
    const struct od_hooks *hooks = t->od->hooks;
    const uint32_t code = find(t, index, sub, OD_READ, SDO_ABORT_WRITE_ONLY);

    t->size = 0;
    t->moved = 0;
    if (code != SDO_OK) {
        return code;
    }
    if (t->entry->type != OD_DOMAIN) {
        return od_read(t->od, t->entry, t->value, sizeof t->value, &t->size);
    }
    if (hooks->domain_size == NULL || hooks->domain_read == NULL) {
        return SDO_ABORT_ACCESS;
    }
    return hooks->domain_size(t->od->context, t->entry, &t->size);
}

uint32_t od_transfer_get(struct od_transfer *t, uint32_t offset, uint8_t *data, uint32_t size)
{
    if (t->entry->type == OD_DOMAIN) {
        return size == 0 ? SDO_OK
                         : t->od->hooks->domain_read(t->od->context, t->entry, offset, data, size);
    }
    memcpy(data, t->value + offset, size);
    return SDO_OK;
}

void od_transfer_drop(struct od_transfer *t)
{
    if (!t->open) {
        return;
    }
    t->open = false;
    if (t->od->hooks->domain_abort != NULL) {
        t->od->hooks->domain_abort(t->od->context, t->entry);
    }
}
