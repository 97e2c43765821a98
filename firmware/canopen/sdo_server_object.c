/* SPDX-License-Identifier: MIT */
#include <stddef.h>
#include <string.h>

#include "canopen/sdo_abort.h"
#include "canopen/sdo_server_private.h"

/* The transfer's entry, with the access that is wanted. */
static uint32_t find(struct sdo_server *s, uint8_t access, uint32_t refusal)
{
    s->entry = od_find(s->od, s->index, s->sub);
    if (s->entry == NULL) {
        return od_missing(s->od, s->index, s->sub);
    }
    return (s->entry->access & access) == 0 ? refusal : SDO_OK;
}

static uint32_t room(const struct sdo_server *s)
{
    return s->entry->size < SDO_VALUE_MAX ? s->entry->size : SDO_VALUE_MAX;
}

static uint32_t open_value(const struct sdo_server *s)
{
    if (s->announced > room(s)) {
        return SDO_ABORT_TOO_LONG;
    }
    if (s->announced != 0 && s->announced < s->entry->size && s->entry->type != OD_VISIBLE_STRING) {
        return SDO_ABORT_TOO_SHORT;
    }
    return SDO_OK;
}

static uint32_t open_domain(struct sdo_server *s)
{
    const struct od_hooks *hooks = s->od->hooks;
    uint32_t code;

    if (hooks->domain_begin == NULL || hooks->domain_write == NULL) {
        return SDO_ABORT_ACCESS;
    }
    code = hooks->domain_begin(s->od->context, s->entry, s->announced);
    s->domain_open = code == SDO_OK;
    return code;
}

uint32_t sdo_server_open_write(struct sdo_server *s, uint32_t announced)
{
    uint32_t code = find(s, OD_WRITE, SDO_ABORT_READ_ONLY);

    s->announced = announced;
    s->moved = 0;
    if (code != SDO_OK) {
        return code;
    }
    return s->entry->type == OD_DOMAIN ? open_domain(s) : open_value(s);
}

uint32_t sdo_server_put(struct sdo_server *s, const uint8_t *data, uint32_t size)
{
    uint32_t code = SDO_OK;

    if (s->announced != 0 && size > s->announced - s->moved) {
        return SDO_ABORT_TOO_LONG;
    }
    if (s->entry->type != OD_DOMAIN) {
        if (size > room(s) - s->moved) {
            return SDO_ABORT_TOO_LONG;
        }
        memcpy(s->value + s->moved, data, size);
    } else if (size > UINT32_MAX - s->moved) {
        code = SDO_ABORT_MEMORY;
    } else if (size > 0) {
        code = s->od->hooks->domain_write(s->od->context, s->entry, s->moved, data, size);
    }
    if (code == SDO_OK) {
        s->moved += size;
    }
    return code;
}

uint32_t sdo_server_finish_write(struct sdo_server *s)
{
    const struct od_hooks *hooks = s->od->hooks;
    uint32_t code = SDO_OK;

    if (s->announced != 0 && s->moved < s->announced) {
        return SDO_ABORT_TOO_SHORT;
    }
    if (s->entry->type != OD_DOMAIN) {
        return od_write(s->od, s->entry, s->value, s->moved);
    }
    if (hooks->domain_end != NULL) {
        code = hooks->domain_end(s->od->context, s->entry, s->moved);
    }
    s->domain_open = s->domain_open && code != SDO_OK;
    return code;
}

uint32_t sdo_server_open_read(struct sdo_server *s)
{
    const struct od_hooks *hooks = s->od->hooks;
    uint32_t code = find(s, OD_READ, SDO_ABORT_WRITE_ONLY);

    s->announced = 0;
    s->moved = 0;
    if (code != SDO_OK) {
        return code;
    }
    if (s->entry->type != OD_DOMAIN) {
        return od_read(s->od, s->entry, s->value, sizeof s->value, &s->announced);
    }
    if (hooks->domain_size == NULL || hooks->domain_read == NULL) {
        return SDO_ABORT_ACCESS;
    }
    return hooks->domain_size(s->od->context, s->entry, &s->announced);
}

uint32_t sdo_server_get(struct sdo_server *s, uint32_t offset, uint8_t *data, uint32_t size)
{
    if (s->entry->type == OD_DOMAIN) {
        return size == 0 ? SDO_OK
                         : s->od->hooks->domain_read(s->od->context, s->entry, offset, data, size);
    }
    memcpy(data, s->value + offset, size);
    return SDO_OK;
}

void sdo_server_drop(struct sdo_server *s)
{
    if (s->domain_open) {
        s->domain_open = false;
        if (s->od->hooks->domain_abort != NULL) {
            s->od->hooks->domain_abort(s->od->context, s->entry);
        }
    }
    s->state = SDO_SERVER_IDLE;
}
