/* SPDX-License-Identifier: MIT */
/* Implements canopen/sdo_client.h: reads and writes objects of other nodes. Used by app/drives. Main loop; no I/O. */
#include "canopen/sdo_client.h"

#include <string.h>

#include "canopen/cob.h"
#include "canopen/sdo_abort.h"

#define SDO_BYTES       8u
#define SEGMENT_BYTES   7u
#define EXPEDITED_BYTES 4u

/* Bits of first bytes. */
#define TOGGLE       0x10u
#define LAST_SEGMENT 0x01u
#define SIZE_GIVEN   0x01u
#define EXPEDITED    0x02u
#define ABORT        0x80u

/* First bytes of requests: command specifiers. */
#define REQUEST_DOWNLOAD         0x20u
#define REQUEST_DOWNLOAD_SEGMENT 0x00u
#define REQUEST_UPLOAD           0x40u
#define REQUEST_UPLOAD_SEGMENT   0x60u

/* Command specifiers of responses, bits 5 ... 7. */
#define SPECIFIER               0xE0u
#define ANSWER_DOWNLOAD         0x60u
#define ANSWER_DOWNLOAD_SEGMENT 0x20u
#define ANSWER_UPLOAD           0x40u
#define ANSWER_UPLOAD_SEGMENT   0x00u

/* Read: more empty segments than this in a row end the transfer. */
#define EMPTY_SEGMENTS_MAX 8u

void sdo_client_init(struct sdo_client *client, uint32_t timeout_us)
{
    memset(client, 0, sizeof *client);
    client->timeout_us = timeout_us;
    client->status = SDO_CLIENT_IDLE;
}

/* An empty request with this first byte. */
static void make_request(const struct sdo_client *client, uint8_t command, struct can_msg *out)
{
    cob_frame(out, COB_SDO_REQUEST + client->node, SDO_BYTES);
    out->data[0] = command;
}

static void make_object_request(const struct sdo_client *client, uint8_t command,
                                struct can_msg *out)
{
    make_request(client, command, out);
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
    client->waited_us = 0;
    client->moved = 0;
    client->toggle = 0;
    client->empty_segments = 0;
    return 0;
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
    make_object_request(client, REQUEST_DOWNLOAD | SIZE_GIVEN, out);
    if (size <= EXPEDITED_BYTES) {
        out->data[0] |= (uint8_t)(EXPEDITED | ((EXPEDITED_BYTES - size) << 2));
        memcpy(out->data + 4, data, size);
        client->moved = size;
    } else {
        cob_put(out->data + 4, size, 4);
    }
    return 0;
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
    make_object_request(client, REQUEST_UPLOAD, out);
    return 0;
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

bool sdo_client_cancel(struct sdo_client *client, uint32_t code, struct can_msg *out)
{
    if (client->status != SDO_CLIENT_BUSY) {
        return false;
    }
    client->status = SDO_CLIENT_FAILED;
    client->abort_code = code;
    make_object_request(client, ABORT, out);
    cob_put(out->data + 4, code, 4);
    return true;
}

bool sdo_client_process(struct sdo_client *client, uint32_t elapsed_us, struct can_msg *out)
{
    if (client->status != SDO_CLIENT_BUSY) {
        return false;
    }
    client->waited_us += elapsed_us < client->timeout_us ? elapsed_us : client->timeout_us;
    return client->waited_us >= client->timeout_us &&
           sdo_client_cancel(client, SDO_ABORT_TIMEOUT, out);
}

static bool done(struct sdo_client *client)
{
    client->status = SDO_CLIENT_DONE;
    return false;
}

/* The next segment of a write, or the end of it. */
static bool send_segment(struct sdo_client *client, struct can_msg *out)
{
    uint32_t left = client->size - client->moved;
    uint32_t size = left < SEGMENT_BYTES ? left : SEGMENT_BYTES;

    if (left == 0) {
        return done(client);
    }
    make_request(client,
                 (uint8_t)(REQUEST_DOWNLOAD_SEGMENT | client->toggle |
                           ((SEGMENT_BYTES - size) << 1) | (size == left ? LAST_SEGMENT : 0u)),
                 out);
    memcpy(out->data + 1, client->source + client->moved, size);
    client->moved += size;
    client->step = SDO_CLIENT_DOWNLOAD_SEGMENT;
    return true;
}

static bool request_segment(struct sdo_client *client, struct can_msg *out)
{
    client->step = SDO_CLIENT_UPLOAD_SEGMENT;
    make_request(client, (uint8_t)(REQUEST_UPLOAD_SEGMENT | client->toggle), out);
    return true;
}

static bool take(struct sdo_client *client, const uint8_t *data, uint32_t size, struct can_msg *out)
{
    if (size > client->capacity - client->moved) {
        return sdo_client_cancel(client, SDO_ABORT_MEMORY, out);
    }
    memcpy(client->target + client->moved, data, size);
    client->moved += size;
    client->size = client->moved;
    return false;
}

static bool answer_upload(struct sdo_client *client, const uint8_t *data, struct can_msg *out)
{
    if ((data[0] & EXPEDITED) == 0) {
        return request_segment(client, out);
    }
    uint32_t unused = (data[0] & SIZE_GIVEN) != 0 ? (data[0] >> 2) & 3u : 0;
    return take(client, data + 4, EXPEDITED_BYTES - unused, out) || done(client);
}

static bool answer_upload_segment(struct sdo_client *client, const uint8_t *data,
                                  struct can_msg *out)
{
    const uint32_t size = SEGMENT_BYTES - ((data[0] >> 1) & 7u);

    if (take(client, data + 1, size, out)) {
        return true;
    }
    if ((data[0] & LAST_SEGMENT) != 0) {
        return client->size == 0 ? sdo_client_cancel(client, SDO_ABORT_NO_DATA, out) : done(client);
    }
    client->empty_segments = size == 0u ? (uint8_t)(client->empty_segments + 1u) : 0u;
    if (client->empty_segments > EMPTY_SEGMENTS_MAX) {
        return sdo_client_cancel(client, SDO_ABORT_NO_DATA, out);
    }
    client->toggle ^= TOGGLE;
    return request_segment(client, out);
}

static bool is_about_object(const struct sdo_client *client, const uint8_t *data)
{
    return cob_get(data + 1, 2) == client->index && data[3] == client->sub;
}

static uint8_t specifier_due(enum sdo_client_step step)
{
    switch (step) {
    case SDO_CLIENT_DOWNLOAD:
        return ANSWER_DOWNLOAD;
    case SDO_CLIENT_DOWNLOAD_SEGMENT:
        return ANSWER_DOWNLOAD_SEGMENT;
    case SDO_CLIENT_UPLOAD:
        return ANSWER_UPLOAD;
    default:
        return ANSWER_UPLOAD_SEGMENT;
    }
}

/* An abort code when `data` is not the response that is due. */
static uint32_t check(const struct sdo_client *client, const uint8_t *data)
{
    const bool segment =
        client->step == SDO_CLIENT_DOWNLOAD_SEGMENT || client->step == SDO_CLIENT_UPLOAD_SEGMENT;

    if ((data[0] & SPECIFIER) != specifier_due(client->step)) {
        return SDO_ABORT_COMMAND;
    }
    return !segment || (data[0] & TOGGLE) == client->toggle ? SDO_OK : SDO_ABORT_TOGGLE;
}

/* Late responses to an earlier transfer. Aborts of object 0 come from servers that do not know the object. */
static bool is_stale(const struct sdo_client *client, const uint8_t *data)
{
    bool names_object = client->step == SDO_CLIENT_DOWNLOAD || client->step == SDO_CLIENT_UPLOAD;

    if (data[0] == ABORT) {
        return !is_about_object(client, data) && cob_get(data + 1, 2) != 0;
    }
    return names_object && !is_about_object(client, data);
}

static bool go_on(struct sdo_client *client, const uint8_t *data, struct can_msg *out)
{
    switch (client->step) {
    case SDO_CLIENT_UPLOAD:
        return answer_upload(client, data, out);
    case SDO_CLIENT_UPLOAD_SEGMENT:
        return answer_upload_segment(client, data, out);
    case SDO_CLIENT_DOWNLOAD_SEGMENT:
        client->toggle ^= TOGGLE;
        return send_segment(client, out);
    default:
        return send_segment(client, out);
    }
}

bool sdo_client_receive(struct sdo_client *client, const struct can_msg *in, struct can_msg *out)
{
    uint32_t code;

    if (client->status != SDO_CLIENT_BUSY || in->id != COB_SDO_RESPONSE + client->node ||
        in->len != SDO_BYTES || is_stale(client, in->data)) {
        return false;
    }
    if (in->data[0] == ABORT) {
        client->status = SDO_CLIENT_REFUSED;
        client->abort_code = (uint32_t)cob_get(in->data + 4, 4);
        return false;
    }
    client->waited_us = 0;
    code = check(client, in->data);
    return code != SDO_OK ? sdo_client_cancel(client, code, out) : go_on(client, in->data, out);
}
