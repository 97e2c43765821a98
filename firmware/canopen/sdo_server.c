/* SPDX-License-Identifier: MIT */
#include "canopen/sdo_server.h"

#include <assert.h>
#include <string.h>

#include "canopen/cob.h"
#include "canopen/sdo_abort.h"
#include "canopen/sdo_server_private.h"

/* Command specifiers of a client, bits 5 ... 7 of the first byte. */
enum client_command {
    CLIENT_DOWNLOAD_SEGMENT = 0,
    CLIENT_DOWNLOAD = 1,
    CLIENT_UPLOAD = 2,
    CLIENT_UPLOAD_SEGMENT = 3,
    CLIENT_ABORT = 4,
    CLIENT_BLOCK_UPLOAD = 5,
    CLIENT_BLOCK_DOWNLOAD = 6
};

/* Within CLIENT_BLOCK_...: initiate has these bits 0. */
#define BLOCK_UPLOAD_SUBCOMMAND   0x03u
#define BLOCK_DOWNLOAD_SUBCOMMAND 0x01u

#define EXPEDITED_BYTE 0x2Fu /* initiate download: expedited, one byte */

void sdo_server_init(struct sdo_server *server, struct od *od, uint8_t node, uint32_t timeout_us,
                     uint8_t block_segments)
{
    memset(server, 0, sizeof *server);
    server->od = od;
    server->node = node;
    server->timeout_us = timeout_us;
    assert(block_segments >= 1 && block_segments <= SDO_BLOCK_SEGMENTS_MAX);
    server->block_size = block_segments;
    server->state = SDO_SERVER_IDLE;
}

void sdo_server_reset(struct sdo_server *server)
{
    sdo_server_drop(server);
}

bool sdo_server_wants(const struct sdo_server *server, const struct can_msg *in)
{
    return in->id == COB_SDO_ASK + server->node && in->len == SDO_BYTES;
}

/* Forgets a transfer under way and notes the object of the new one. */
static void begin(struct sdo_server *s, const uint8_t *data)
{
    sdo_server_drop(s);
    s->index = (uint16_t)cob_get(data + 1, 2);
    s->sub = data[3];
    s->toggle = 0;
}

static bool is_initiate(const uint8_t *data)
{
    switch (data[0] >> 5) {
    case CLIENT_DOWNLOAD:
    case CLIENT_UPLOAD:
        return true;
    case CLIENT_BLOCK_UPLOAD:
        return (data[0] & BLOCK_UPLOAD_SUBCOMMAND) == 0;
    case CLIENT_BLOCK_DOWNLOAD:
        return (data[0] & BLOCK_DOWNLOAD_SUBCOMMAND) == 0;
    default:
        return false;
    }
}

static int initiate(struct sdo_server *s, const uint8_t *data, struct can_msg *out)
{
    begin(s, data);
    switch (data[0] >> 5) {
    case CLIENT_DOWNLOAD:
        return sdo_server_download_initiate(s, data, out);
    case CLIENT_UPLOAD:
        return sdo_server_upload_initiate(s, out);
    case CLIENT_BLOCK_UPLOAD:
        return sdo_server_block_upload_initiate(s, data, out);
    default:
        return sdo_server_block_download_initiate(s, data, out);
    }
}

static int go_on(struct sdo_server *s, const uint8_t *data, struct can_msg *out)
{
    uint8_t command = data[0] >> 5;

    switch (s->state) {
    case SDO_SERVER_DOWNLOAD:
        return command == CLIENT_DOWNLOAD_SEGMENT ? sdo_server_download_segment(s, data, out)
                                                  : sdo_server_fail(s, SDO_ABORT_COMMAND, out);
    case SDO_SERVER_UPLOAD:
        return command == CLIENT_UPLOAD_SEGMENT ? sdo_server_upload_segment(s, data, out)
                                                : sdo_server_fail(s, SDO_ABORT_COMMAND, out);
    case SDO_SERVER_BLOCK_DOWNLOAD_END:
        return command == CLIENT_BLOCK_DOWNLOAD ? sdo_server_block_download_end(s, data, out)
                                                : sdo_server_fail(s, SDO_ABORT_COMMAND, out);
    case SDO_SERVER_BLOCK_UPLOAD_READY:
    case SDO_SERVER_BLOCK_UPLOAD:
    case SDO_SERVER_BLOCK_UPLOAD_ACK:
    case SDO_SERVER_BLOCK_UPLOAD_END:
        return command == CLIENT_BLOCK_UPLOAD ? sdo_server_block_upload_command(s, data, out)
                                              : sdo_server_fail(s, SDO_ABORT_COMMAND, out);
    default:
        s->index = 0;
        s->sub = 0;
        return sdo_server_fail(s, SDO_ABORT_COMMAND, out);
    }
}

/* A request by all its bits, for an object that there is: few segments that have such a first byte look like one. */
static bool is_sound_initiate(const struct sdo_server *s, const uint8_t *data)
{
    const uint8_t first = data[0];
    const bool expedited = (first & 0xF3u) == 0x23u || first == 0x22u;
    const bool known = expedited || first == 0x20u || first == 0x21u || first == 0x40u ||
                       first == 0xA0u || first == 0xA4u || (first & 0xF9u) == 0xC0u;
    return known && od_find(s->od, (uint16_t)cob_get(data + 1, 2), data[3]) != NULL;
}

/* Within a block: no segment of this client, by its number. (After a loss one of its segments may look like this, if its
 * bytes are those of a request.) */
static bool is_strange(const struct sdo_server *s, const uint8_t *data)
{
    const uint8_t sequence = data[0] & (uint8_t)~SDO_LAST_IN_BLOCK;
    const bool doubled = sequence == s->sequence && sequence != 0u;
    const bool next = sequence == s->heard + 1u || sequence == s->heard + 2u; /* one may be lost */
    return !next && !doubled && is_sound_initiate(s, data);
}

static bool same_object(const struct sdo_server *s, const uint8_t *data)
{
    return cob_get(data + 1, 2) == s->index && data[3] == s->sub;
}

/* The client of this transfer has lost the answer to its first request. */
static bool begins_again(const struct sdo_server *s, const uint8_t *data)
{
    return same_object(s, data) && s->moved == 0 && s->held == 0;
}

/* The same within a block, where a segment may look like it. */
static bool restarts(const struct sdo_server *s, const uint8_t *data)
{
    return begins_again(s, data) && is_strange(s, data);
}

static int refuse_stranger(const struct sdo_server *s, const uint8_t *data, struct can_msg *out)
{
    sdo_server_frame(s, SDO_ABORT_COMMAND_BYTE, out);
    memcpy(out->data + 1, data + 1, 3);
    cob_put(out->data + 4, SDO_ABORT_LOCAL, 4);
    return 1;
}

/* The entry of a write that waits for nobody; NULL: it is another frame. */
static const struct od_entry *urgent_entry(const struct sdo_server *s, const uint8_t *data)
{
    const bool whole = data[5] == 0u && data[6] == 0u && data[7] == 0u;
    if (s->od->hooks->urgent == NULL || data[0] != EXPEDITED_BYTE || !whole) {
        return NULL;
    }
    const struct od_entry *entry = od_find(s->od, (uint16_t)cob_get(data + 1, 2), data[3]);
    const bool taken = entry != NULL && entry->size == 1u && (entry->access & OD_WRITE) != 0u;
    return taken && s->od->hooks->urgent(entry, data[4]) ? entry : NULL;
}

/* Beside the transfer under way, which is not touched. */
static int write_beside(const struct sdo_server *s, const struct od_entry *entry,
                        const uint8_t *data, struct can_msg *out)
{
    const uint32_t code = od_write(s->od, entry, data + 4, 1);
    sdo_server_frame(s, code == SDO_OK ? SDO_DOWNLOADED_BYTE : SDO_ABORT_COMMAND_BYTE, out);
    memcpy(out->data + 1, data + 1, 3);
    cob_put(out->data + 4, code, 4);
    return 1;
}

static bool from_stranger(const struct sdo_server *s, const uint8_t *data)
{
    if (s->state == SDO_SERVER_IDLE || begins_again(s, data)) {
        return false;
    }
    if (data[0] == SDO_ABORT_COMMAND_BYTE) {
        return false;
    }
    return s->state == SDO_SERVER_BLOCK_DOWNLOAD ? is_strange(s, data) : is_initiate(data);
}

/* A stranger that gives up its own transfer does not end this one. */
static void take_abort(struct sdo_server *s, const uint8_t *data)
{
    const bool named = cob_get(data + 1, 2) != 0u;
    if (s->state == SDO_SERVER_IDLE || !named || same_object(s, data)) {
        sdo_server_drop(s);
        s->heard = 0;
    }
}

int sdo_server_receive(struct sdo_server *server, const struct can_msg *in, struct can_msg *out)
{
    if (!sdo_server_wants(server, in)) {
        return 0;
    }
    const struct od_entry *urgent =
        server->state == SDO_SERVER_IDLE ? NULL : urgent_entry(server, in->data);
    if (urgent != NULL) {
        return write_beside(server, urgent, in->data, out);
    }
    if (from_stranger(server, in->data)) {
        return refuse_stranger(server, in->data, out);
    }
    server->silence_us = 0;
    /* A whole byte: within a block, 0x81 ... 0xFF are last segments. */
    if (in->data[0] == SDO_ABORT_COMMAND_BYTE) {
        take_abort(server, in->data);
        return 0;
    }
    if (server->state == SDO_SERVER_BLOCK_DOWNLOAD && !restarts(server, in->data)) {
        return sdo_server_block_download_segment(server, in->data, out);
    }
    if (server->state == SDO_SERVER_IDLE && sdo_server_block_download_straggler(server, in->data)) {
        return 0;
    }
    if (is_initiate(in->data)) {
        return initiate(server, in->data, out);
    }
    return go_on(server, in->data, out);
}

/* A block whose last segment was lost is answered before the client gives up, once. Not when no
 * segment of it has come: a client that only paused would then send the whole block twice. */
static int acknowledge_early(struct sdo_server *s, struct can_msg *out)
{
    const bool begun = s->sequence != 0 || (s->heard != 0 && !s->acknowledged_early);

    if (s->state != SDO_SERVER_BLOCK_DOWNLOAD || !begun || s->silence_us < s->timeout_us / 2) {
        return 0;
    }
    s->acknowledged_early = true;
    return sdo_server_block_download_acknowledge(s, out);
}

int sdo_server_process(struct sdo_server *server, uint32_t elapsed_us, struct can_msg *out)
{
    if (server->state == SDO_SERVER_IDLE) {
        return 0;
    }
    if (server->state == SDO_SERVER_BLOCK_UPLOAD) {
        server->silence_us = 0; /* it is the server that talks */
        return sdo_server_block_upload_send(server, out);
    }
    server->silence_us =
        elapsed_us > UINT32_MAX - server->silence_us ? UINT32_MAX : server->silence_us + elapsed_us;
    if (server->silence_us >= server->timeout_us) {
        return sdo_server_fail(server, SDO_ABORT_TIMEOUT, out);
    }
    return acknowledge_early(server, out);
}
