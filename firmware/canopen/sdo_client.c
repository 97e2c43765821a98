/* SPDX-License-Identifier: MIT */
#include "canopen/sdo_client.h"

#include <string.h>

#include "canopen/cob.h"
#include "canopen/sdo_abort.h"
#include "canopen/sdo_client_private.h"

#define ASK_DOWNLOAD 0x20u
#define ASK_UPLOAD   0x40u

void sdo_client_init(struct sdo_client *client, uint32_t timeout_us)
{
    memset(client, 0, sizeof *client);
    client->timeout_us = timeout_us;
    client->status = SDO_CLIENT_IDLE;
}

void sdo_client_ask(const struct sdo_client *client, uint8_t command, struct can_msg *out)
{
    cob_frame(out, COB_SDO_ASK + client->node, SDO_BYTES);
    out->data[0] = command;
}

static void ask_about_object(const struct sdo_client *client, uint8_t command, struct can_msg *out)
{
    sdo_client_ask(client, command, out);
    cob_put(out->data + 1, client->index, 2);
    out->data[3] = client->sub;
}

static int begin(struct sdo_client *client, uint8_t node, uint16_t index, uint8_t sub,
                 uint32_t size)
{
    if (client->status == SDO_CLIENT_BUSY) {
        return SDO_CLIENT_ERR_BUSY;
    }
    if (node < NODE_ID_MIN || node > NODE_ID_MAX || size == 0) {
        return SDO_CLIENT_ERR_ARGUMENT;
    }
    client->status = SDO_CLIENT_BUSY;
    client->node = node;
    client->index = index;
    client->sub = sub;
    client->abort_code = SDO_OK;
    client->silence_us = 0;
    client->moved = 0;
    client->toggle = 0;
    client->empty_segments = 0;
    return 1;
}

int sdo_client_write(struct sdo_client *client, uint8_t node, uint16_t index, uint8_t sub,
                     const uint8_t *data, uint32_t size, struct can_msg *out)
{
    int begun = begin(client, node, index, sub, size);

    if (begun < 0) {
        return begun;
    }
    client->source = data;
    client->size = size;
    client->step = SDO_CLIENT_DOWNLOAD;
    ask_about_object(client, ASK_DOWNLOAD | SIZE_GIVEN, out);
    if (size <= EXPEDITED_BYTES) {
        out->data[0] |= (uint8_t)(EXPEDITED | ((EXPEDITED_BYTES - size) << 2));
        memcpy(out->data + 4, data, size);
        client->moved = size;
    } else {
        cob_put(out->data + 4, size, 4);
    }
    return 1;
}

int sdo_client_read(struct sdo_client *client, uint8_t node, uint16_t index, uint8_t sub,
                    uint8_t *buffer, uint32_t capacity, struct can_msg *out)
{
    int begun = begin(client, node, index, sub, capacity);

    if (begun < 0) {
        return begun;
    }
    client->target = buffer;
    client->capacity = capacity;
    client->size = 0;
    client->step = SDO_CLIENT_UPLOAD;
    ask_about_object(client, ASK_UPLOAD, out);
    return 1;
}

int sdo_client_write_number(struct sdo_client *client, uint8_t node, uint16_t index, uint8_t sub,
                            uint64_t value, uint8_t size, struct can_msg *out)
{
    if (client->status == SDO_CLIENT_BUSY) {
        return SDO_CLIENT_ERR_BUSY;
    }
    if (size > sizeof client->number) {
        return SDO_CLIENT_ERR_ARGUMENT;
    }
    cob_put(client->number, value, size);
    return sdo_client_write(client, node, index, sub, client->number, size, out);
}

int sdo_client_read_number(struct sdo_client *client, uint8_t node, uint16_t index, uint8_t sub,
                           struct can_msg *out)
{
    return sdo_client_read(client, node, index, sub, client->number, sizeof client->number, out);
}

uint64_t sdo_client_unsigned(const struct sdo_client *client)
{
    return cob_get(client->number, client->size);
}

int64_t sdo_client_signed(const struct sdo_client *client)
{
    return cob_signed(sdo_client_unsigned(client), client->size);
}

int sdo_client_cancel(struct sdo_client *client, uint32_t code, struct can_msg *out)
{
    if (client->status != SDO_CLIENT_BUSY) {
        return 0;
    }
    client->status = SDO_CLIENT_FAILED;
    client->abort_code = code;
    ask_about_object(client, ABORT, out);
    cob_put(out->data + 4, code, 4);
    return 1;
}

int sdo_client_process(struct sdo_client *client, uint32_t elapsed_us, struct can_msg *out)
{
    if (client->status != SDO_CLIENT_BUSY) {
        return 0;
    }
    client->silence_us += elapsed_us < client->timeout_us ? elapsed_us : client->timeout_us;
    return client->silence_us >= client->timeout_us
               ? sdo_client_cancel(client, SDO_ABORT_TIMEOUT, out)
               : 0;
}
