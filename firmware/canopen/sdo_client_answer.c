/* SPDX-License-Identifier: MIT */
#include <string.h>

#include "canopen/cob.h"
#include "canopen/sdo_abort.h"
#include "canopen/sdo_client_private.h"

#define ASK_DOWNLOAD_SEGMENT 0x00u
#define ASK_UPLOAD_SEGMENT   0x60u

#define EMPTY_SEGMENTS_MAX 8u

/* Command specifiers of answers, bits 5 ... 7. */
#define SPECIFIER               0xE0u
#define ANSWER_DOWNLOAD         0x60u
#define ANSWER_DOWNLOAD_SEGMENT 0x20u
#define ANSWER_UPLOAD           0x40u
#define ANSWER_UPLOAD_SEGMENT   0x00u

static int done(struct sdo_client *client)
{
    client->status = SDO_CLIENT_DONE;
    return 0;
}

/* The next segment of a write, or the end of it. */
static int send_segment(struct sdo_client *client, struct can_msg *out)
{
    uint32_t left = client->size - client->moved;
    uint32_t size = left < SEGMENT_BYTES ? left : SEGMENT_BYTES;

    if (left == 0) {
        return done(client);
    }
    sdo_client_ask(client,
                   (uint8_t)(ASK_DOWNLOAD_SEGMENT | client->toggle | ((SEGMENT_BYTES - size) << 1) |
                             (size == left ? LAST_SEGMENT : 0u)),
                   out);
    memcpy(out->data + 1, client->source + client->moved, size);
    client->moved += size;
    client->step = SDO_CLIENT_DOWNLOAD_SEGMENT;
    return 1;
}

static int ask_segment(struct sdo_client *client, struct can_msg *out)
{
    client->step = SDO_CLIENT_UPLOAD_SEGMENT;
    sdo_client_ask(client, (uint8_t)(ASK_UPLOAD_SEGMENT | client->toggle), out);
    return 1;
}

static int take(struct sdo_client *client, const uint8_t *data, uint32_t size, struct can_msg *out)
{
    if (size > client->capacity - client->moved) {
        return sdo_client_cancel(client, SDO_ABORT_MEMORY, out);
    }
    memcpy(client->target + client->moved, data, size);
    client->moved += size;
    client->size = client->moved;
    return 0;
}

static int answer_upload(struct sdo_client *client, const uint8_t *data, struct can_msg *out)
{
    if ((data[0] & EXPEDITED) == 0) {
        return ask_segment(client, out);
    }
    uint32_t unused = (data[0] & SIZE_GIVEN) != 0 ? (data[0] >> 2) & 3u : 0;
    int aborted = take(client, data + 4, EXPEDITED_BYTES - unused, out);
    return aborted != 0 ? aborted : done(client);
}

static int answer_upload_segment(struct sdo_client *client, const uint8_t *data,
                                 struct can_msg *out)
{
    const uint32_t size = SEGMENT_BYTES - ((data[0] >> 1) & 7u);
    int aborted = take(client, data + 1, size, out);

    if (aborted != 0) {
        return aborted;
    }
    if ((data[0] & LAST_SEGMENT) != 0) {
        return client->size == 0 ? sdo_client_cancel(client, SDO_ABORT_NO_DATA, out) : done(client);
    }
    client->empty_segments = size == 0u ? (uint8_t)(client->empty_segments + 1u) : 0u;
    if (client->empty_segments > EMPTY_SEGMENTS_MAX) {
        return sdo_client_cancel(client, SDO_ABORT_NO_DATA, out);
    }
    client->toggle ^= TOGGLE;
    return ask_segment(client, out);
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

/* An abort code when `data` is not the answer that is due. */
static uint32_t check(const struct sdo_client *client, const uint8_t *data)
{
    const bool segment =
        client->step == SDO_CLIENT_DOWNLOAD_SEGMENT || client->step == SDO_CLIENT_UPLOAD_SEGMENT;

    if ((data[0] & SPECIFIER) != specifier_due(client->step)) {
        return SDO_ABORT_COMMAND;
    }
    return !segment || (data[0] & TOGGLE) == client->toggle ? SDO_OK : SDO_ABORT_TOGGLE;
}

/* Late words about an earlier transfer. Aborts of object 0 come from servers that do not know it.
 */
static bool is_stale(const struct sdo_client *client, const uint8_t *data)
{
    bool names_object = client->step == SDO_CLIENT_DOWNLOAD || client->step == SDO_CLIENT_UPLOAD;

    if (data[0] == ABORT) {
        return !is_about_object(client, data) && cob_get(data + 1, 2) != 0;
    }
    return names_object && !is_about_object(client, data);
}

static int go_on(struct sdo_client *client, const uint8_t *data, struct can_msg *out)
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

int sdo_client_receive(struct sdo_client *client, const struct can_msg *in, struct can_msg *out)
{
    uint32_t code;

    if (client->status != SDO_CLIENT_BUSY || in->id != COB_SDO_ANSWER + client->node ||
        in->len != SDO_BYTES || is_stale(client, in->data)) {
        return 0;
    }
    if (in->data[0] == ABORT) {
        client->status = SDO_CLIENT_REFUSED;
        client->abort_code = (uint32_t)cob_get(in->data + 4, 4);
        return 0;
    }
    client->silence_us = 0;
    code = check(client, in->data);
    return code != SDO_OK ? sdo_client_cancel(client, code, out) : go_on(client, in->data, out);
}
