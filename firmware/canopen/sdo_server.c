/* SPDX-License-Identifier: MIT */
/* Implements canopen/sdo_server.h (see there): gives an object dictionary to one SDO client. Used by
 * app/controller_state, app/controller and sim/node. No I/O: frames in, frames out. */
#include "canopen/sdo_server.h"

#include <assert.h>
#include <stddef.h>
#include <string.h>

#include "canopen/cob.h"
#include "canopen/sdo_abort.h"

#define SDO_BYTES       8u
#define SEGMENT_BYTES   7u
#define EXPEDITED_BYTES 4u

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

/* First bytes: bits of segments. */
#define TOGGLE        0x10u
#define LAST_SEGMENT  0x01u /* segmented transfer */
#define LAST_IN_BLOCK 0x80u

/* First bytes of the client: bits within a command. Those of a subcommand are 0 where a block transfer is initiated. */
#define REQUEST_EXPEDITED          0x02u
#define REQUEST_SIZE_GIVEN         0x01u
#define EXPEDITED_BYTE             0x2Fu /* initiate download: expedited, one byte */
#define CRC_SUPPORTED              0x04u
#define REQUEST_BLOCK_SIZE_GIVEN   0x02u
#define BLOCK_DOWNLOAD_SUBCOMMAND  0x01u
#define REQUEST_DOWNLOAD_END       0x01u
#define BLOCK_UPLOAD_SUBCOMMAND    0x03u
#define REQUEST_UPLOAD_END         0x01u
#define REQUEST_UPLOAD_ACKNOWLEDGE 0x02u
#define REQUEST_UPLOAD_START       0x03u

/* First bytes of the server. */
#define ABORT_BYTE                0x80u
#define DOWNLOADED_BYTE           0x60u /* answer to an initiated, or expedited, download */
#define ANSWER_DOWNLOAD_SEGMENT   0x20u
#define ANSWER_UPLOAD_EXPEDITED   0x43u /* size given */
#define ANSWER_UPLOAD_SIZE        0x41u
#define ANSWER_BLOCK_DOWNLOAD     0xA0u
#define ANSWER_BLOCK_RECEIVED     0xA2u
#define ANSWER_BLOCK_DOWNLOAD_END 0xA1u
#define ANSWER_BLOCK_UPLOAD       0xC2u /* size given */
#define ANSWER_BLOCK_UPLOAD_END   0xC1u

#define CRC_POLYNOMIAL 0x1021u

/* Functions that give a frame return true when *out is to be sent; those that return uint32_t give an abort code. */

/* Calls the hooks and becomes idle. */
static void drop(struct sdo_server *s)
{
    od_transfer_drop(&s->object);
    s->state = SDO_SERVER_IDLE;
    s->closing = 0;
}

static uint32_t begin_write(struct sdo_server *s, uint32_t announced)
{
    return od_transfer_begin_write(&s->object, s->index, s->sub, announced);
}

static uint32_t begin_read(struct sdo_server *s)
{
    return od_transfer_begin_read(&s->object, s->index, s->sub);
}

static void frame(const struct sdo_server *s, uint8_t command, struct can_msg *out)
{
    cob_frame(out, COB_SDO_RESPONSE + s->node, SDO_BYTES);
    out->data[0] = command;
}

static void frame_with_object(const struct sdo_server *s, uint8_t command, struct can_msg *out)
{
    frame(s, command, out);
    cob_put(out->data + 1, s->index, 2);
    out->data[3] = s->sub;
}

/* Drops the transfer: *out is the abort. */
static bool fail(struct sdo_server *s, uint32_t code, struct can_msg *out)
{
    drop(s);
    frame_with_object(s, ABORT_BYTE, out);
    cob_put(out->data + 4, code, 4);
    return true;
}

/* ---- Expedited and segmented ---- */

static uint32_t download_expedited(struct sdo_server *s, const uint8_t *data)
{
    uint32_t size = EXPEDITED_BYTES - ((data[0] >> 2) & 3u);
    uint32_t code = begin_write(s, 0);

    if (code != SDO_OK) {
        return code;
    }
    if ((data[0] & REQUEST_SIZE_GIVEN) == 0) {
        /* The client leaves it to the dictionary how many of the four bytes count. */
        size = s->object.entry->size > 0 && s->object.entry->size < EXPEDITED_BYTES
                   ? s->object.entry->size
                   : EXPEDITED_BYTES;
    }
    code = od_transfer_put(&s->object, data + 4, size);
    return code != SDO_OK ? code : od_transfer_finish_write(&s->object);
}

static bool download_initiate(struct sdo_server *s, const uint8_t *data, struct can_msg *out)
{
    bool expedited = (data[0] & REQUEST_EXPEDITED) != 0;
    uint32_t code;

    if (expedited) {
        code = download_expedited(s, data);
    } else {
        code = begin_write(s, (data[0] & REQUEST_SIZE_GIVEN) != 0 ? (uint32_t)cob_get(data + 4, 4)
                                                                  : 0);
    }
    if (code != SDO_OK) {
        return fail(s, code, out);
    }
    s->state = expedited ? SDO_SERVER_IDLE : SDO_SERVER_DOWNLOAD;
    frame_with_object(s, DOWNLOADED_BYTE, out);
    return true;
}

static bool download_segment(struct sdo_server *s, const uint8_t *data, struct can_msg *out)
{
    uint32_t size = SEGMENT_BYTES - ((data[0] >> 1) & 7u);
    bool last = (data[0] & LAST_SEGMENT) != 0;
    uint32_t code = (data[0] & TOGGLE) == s->toggle ? SDO_OK : SDO_ABORT_TOGGLE;

    if (code == SDO_OK) {
        code = od_transfer_put(&s->object, data + 1, size);
    }
    if (code == SDO_OK && last) {
        code = od_transfer_finish_write(&s->object);
    }
    if (code != SDO_OK) {
        return fail(s, code, out);
    }
    frame(s, (uint8_t)(ANSWER_DOWNLOAD_SEGMENT | s->toggle), out);
    s->toggle ^= TOGGLE;
    if (last) {
        s->state = SDO_SERVER_IDLE;
    }
    return true;
}

static bool upload_initiate(struct sdo_server *s, struct can_msg *out)
{
    uint32_t code = begin_read(s);
    bool expedited = s->object.size > 0 && s->object.size <= EXPEDITED_BYTES;

    frame_with_object(s, ANSWER_UPLOAD_SIZE, out);
    if (code == SDO_OK && expedited) {
        out->data[0] =
            (uint8_t)(ANSWER_UPLOAD_EXPEDITED | ((EXPEDITED_BYTES - s->object.size) << 2));
        code = od_transfer_get(&s->object, 0, out->data + 4, s->object.size);
    } else {
        cob_put(out->data + 4, s->object.size, 4);
    }
    if (code != SDO_OK) {
        return fail(s, code, out);
    }
    s->state = expedited ? SDO_SERVER_IDLE : SDO_SERVER_UPLOAD;
    return true;
}

static bool upload_segment(struct sdo_server *s, const uint8_t *data, struct can_msg *out)
{
    uint32_t left = s->object.size - s->object.moved;
    uint32_t size = left < SEGMENT_BYTES ? left : SEGMENT_BYTES;
    uint32_t code = (data[0] & TOGGLE) == s->toggle ? SDO_OK : SDO_ABORT_TOGGLE;

    frame(s, (uint8_t)(s->toggle | ((SEGMENT_BYTES - size) << 1)), out);
    if (code == SDO_OK) {
        code = od_transfer_get(&s->object, s->object.moved, out->data + 1, size);
    }
    if (code != SDO_OK) {
        return fail(s, code, out);
    }
    s->object.moved += size;
    s->toggle ^= TOGGLE;
    if (size == left) {
        out->data[0] |= LAST_SEGMENT;
        s->state = SDO_SERVER_IDLE;
    }
    return true;
}

/* ---- Block download ---- */

static uint16_t crc_byte(uint16_t crc, uint8_t byte)
{
    uint32_t shifted = (uint32_t)crc ^ ((uint32_t)byte << 8);

    for (int bit = 0; bit < 8; bit++) {
        shifted <<= 1;
        if ((shifted & 0x10000u) != 0) {
            shifted ^= 0x10000u | CRC_POLYNOMIAL;
        }
    }
    return (uint16_t)shifted;
}

uint16_t sdo_block_crc(uint16_t crc, const uint8_t *data, uint32_t size)
{
    for (uint32_t i = 0; i < size; i++) {
        crc = crc_byte(crc, data[i]);
    }
    return crc;
}

static bool block_download_initiate(struct sdo_server *s, const uint8_t *data, struct can_msg *out)
{
    uint32_t size = (data[0] & REQUEST_BLOCK_SIZE_GIVEN) != 0 ? (uint32_t)cob_get(data + 4, 4) : 0;
    uint32_t code = begin_write(s, size);

    if (code != SDO_OK) {
        return fail(s, code, out);
    }
    s->state = SDO_SERVER_BLOCK_DOWNLOAD;
    s->use_crc = (data[0] & CRC_SUPPORTED) != 0;
    s->crc = 0;
    s->held = 0;
    s->received = 0;
    s->sequence = 0;
    s->block_limit = s->block_size;
    s->acknowledged_early = false;
    frame_with_object(s, ANSWER_BLOCK_DOWNLOAD | CRC_SUPPORTED, out);
    out->data[4] = s->block_size;
    return true;
}

/* Gives the held segment's first `size` bytes to the object. */
static uint32_t release_held(struct sdo_server *s, uint32_t size)
{
    if (s->held == 0) {
        return SDO_OK;
    }
    s->held = 0;
    s->crc = sdo_block_crc(s->crc, s->last, size);
    return od_transfer_put(&s->object, s->last, size);
}

static bool block_download_acknowledge(struct sdo_server *s, struct can_msg *out)
{
    frame(s, ANSWER_BLOCK_RECEIVED, out);
    out->data[1] = s->sequence;
    out->data[2] = s->block_size;
    s->sequence = 0;
    s->block_limit = s->block_size;
    return true;
}

static bool block_download_segment(struct sdo_server *s, const uint8_t *data, struct can_msg *out)
{
    uint8_t sequence = data[0] & (uint8_t)~LAST_IN_BLOCK;
    bool last = (data[0] & LAST_IN_BLOCK) != 0;
    bool in_order = sequence == s->sequence + 1;
    bool block_ends = last || sequence == s->block_limit;

    if (sequence != 0 && sequence == s->sequence) {
        /* Doubled on the bus, or one of the two is from another client. */
        return memcmp(s->last, data + 1, SEGMENT_BYTES) != 0 && fail(s, SDO_ABORT_SEQUENCE, out);
    }
    s->received = block_ends ? 0 : sequence;
    if (sequence == 0 || sequence > s->block_limit) {
        return fail(s, SDO_ABORT_SEQUENCE, out);
    }
    if (in_order) {
        uint32_t code = release_held(s, SEGMENT_BYTES);
        if (code != SDO_OK) {
            return fail(s, code, out);
        }
        memcpy(s->last, data + 1, SEGMENT_BYTES);
        s->held = SEGMENT_BYTES;
        s->sequence = sequence;
        s->acknowledged_early = false;
    }
    if (!block_ends) {
        return false;
    }
    if (!in_order && s->acknowledged_early) {
        return false; /* remaining segments of a block that paused: the response was sent */
    }
    if (in_order && last) {
        s->state = SDO_SERVER_BLOCK_DOWNLOAD_END;
    }
    s->closing = in_order ? data[0] : 0u;
    return block_download_acknowledge(s, out);
}

/* While idle: true for each remaining segment of a block whose transfer the server has aborted. */
static bool block_download_late_segment(struct sdo_server *s, const uint8_t *data)
{
    uint8_t sequence = data[0] & (uint8_t)~LAST_IN_BLOCK;
    bool late_segment = s->received != 0 && sequence == s->received + 1;
    bool more = late_segment && sequence == data[0];

    s->received = more ? sequence : 0;
    return late_segment;
}

static bool block_download_end(struct sdo_server *s, const uint8_t *data, struct can_msg *out)
{
    uint32_t unused = (data[0] >> 2) & 7u;
    uint32_t code = (data[0] & REQUEST_DOWNLOAD_END) != 0 ? SDO_OK : SDO_ABORT_COMMAND;

    if (code == SDO_OK) {
        code = release_held(s, SEGMENT_BYTES - unused);
    }
    if (code == SDO_OK && s->use_crc && cob_get(data + 1, 2) != s->crc) {
        code = SDO_ABORT_CRC;
    }
    if (code == SDO_OK) {
        code = od_transfer_finish_write(&s->object);
    }
    if (code != SDO_OK) {
        return fail(s, code, out);
    }
    s->state = SDO_SERVER_IDLE;
    s->closing = data[0];
    frame(s, ANSWER_BLOCK_DOWNLOAD_END, out);
    return true;
}

/* ---- Block upload ---- */

static bool block_size_is_valid(uint8_t segments)
{
    return segments >= 1 && segments <= SDO_BLOCK_SEGMENTS_MAX;
}

static bool block_upload_initiate(struct sdo_server *s, const uint8_t *data, struct can_msg *out)
{
    uint32_t code = begin_read(s);

    if (code == SDO_OK && !block_size_is_valid(data[4])) {
        code = SDO_ABORT_BLOCK_SIZE;
    }
    if (code != SDO_OK) {
        return fail(s, code, out);
    }
    s->state = SDO_SERVER_BLOCK_UPLOAD_READY;
    s->use_crc = (data[0] & CRC_SUPPORTED) != 0;
    s->crc = 0;
    s->sequence = 0;
    s->block_start = 0;
    s->block_limit = data[4];
    frame_with_object(s, ANSWER_BLOCK_UPLOAD | CRC_SUPPORTED, out);
    cob_put(out->data + 4, s->object.size, 4);
    return true;
}

/* Repeated segments count once: the CRC covers the first `moved` bytes. */
static void add_to_crc(struct sdo_server *s, uint32_t offset, const uint8_t *data, uint32_t size)
{
    if (offset == s->object.moved) {
        s->crc = sdo_block_crc(s->crc, data, size);
        s->object.moved += size;
    }
}

static bool block_upload_send(struct sdo_server *s, struct can_msg *out)
{
    uint32_t offset = s->block_start + s->sequence * SEGMENT_BYTES;
    uint32_t left = s->object.size - offset;
    uint32_t size = left < SEGMENT_BYTES ? left : SEGMENT_BYTES;
    uint32_t code;

    s->sequence++;
    frame(s, s->sequence, out);
    code = od_transfer_get(&s->object, offset, out->data + 1, size);
    if (code != SDO_OK) {
        return fail(s, code, out);
    }
    add_to_crc(s, offset, out->data + 1, size);
    if (size == left) {
        out->data[0] |= LAST_IN_BLOCK;
    }
    if (size == left || s->sequence == s->block_limit) {
        s->state = SDO_SERVER_BLOCK_UPLOAD_ACK;
    }
    return true;
}

static bool block_upload_end(struct sdo_server *s, struct can_msg *out)
{
    uint32_t in_last = s->object.size % SEGMENT_BYTES;
    uint32_t unused = in_last == 0 && s->object.size > 0 ? 0 : SEGMENT_BYTES - in_last;

    s->state = SDO_SERVER_BLOCK_UPLOAD_END;
    frame(s, (uint8_t)(ANSWER_BLOCK_UPLOAD_END | (unused << 2)), out);
    cob_put(out->data + 1, s->use_crc ? s->crc : 0, 2);
    return true;
}

static bool block_upload_acknowledged(struct sdo_server *s, const uint8_t *data,
                                      struct can_msg *out)
{
    uint8_t good = data[1];

    if (good > s->sequence) {
        return fail(s, SDO_ABORT_SEQUENCE, out);
    }
    if (!block_size_is_valid(data[2])) {
        return fail(s, SDO_ABORT_BLOCK_SIZE, out);
    }
    if (good == s->sequence && s->object.moved == s->object.size &&
        s->object.size - s->block_start <= good * SEGMENT_BYTES) {
        s->closing = good;
        return block_upload_end(s, out);
    }
    s->closing = good;
    s->block_start += good * SEGMENT_BYTES;
    s->block_limit = data[2];
    s->sequence = 0;
    s->state = SDO_SERVER_BLOCK_UPLOAD;
    return block_upload_send(s, out);
}

static bool block_upload_command(struct sdo_server *s, const uint8_t *data, struct can_msg *out)
{
    uint8_t subcommand = data[0] & BLOCK_UPLOAD_SUBCOMMAND;

    if (s->state == SDO_SERVER_BLOCK_UPLOAD_READY && subcommand == REQUEST_UPLOAD_START) {
        s->state = SDO_SERVER_BLOCK_UPLOAD;
        return block_upload_send(s, out);
    }
    /* A client that detects a gap may answer before the block is complete. */
    if ((s->state == SDO_SERVER_BLOCK_UPLOAD_ACK || s->state == SDO_SERVER_BLOCK_UPLOAD) &&
        subcommand == REQUEST_UPLOAD_ACKNOWLEDGE) {
        return block_upload_acknowledged(s, data, out);
    }
    if (s->state == SDO_SERVER_BLOCK_UPLOAD_END && subcommand == REQUEST_UPLOAD_END) {
        s->state = SDO_SERVER_IDLE;
        s->closing = data[0];
        return false;
    }
    return fail(s, SDO_ABORT_COMMAND, out);
}

/* ---- Doubled frames ---- */

/* A sender of CAN repeats a frame whose acknowledgement was disturbed in its last bit: the receiver then has it twice.
 * Within a block the numbers of the segments show it; these are the frames that end a block or a transfer. */

static bool is_doubled_segment(const struct sdo_server *s, const uint8_t *data)
{
    return data[0] == s->closing && memcmp(s->last, data + 1, SEGMENT_BYTES) == 0;
}

static bool is_doubled_upload_command(const struct sdo_server *s, const uint8_t *data)
{
    if (data[0] >> 5 != CLIENT_BLOCK_UPLOAD) {
        return false;
    }
    switch (data[0] & BLOCK_UPLOAD_SUBCOMMAND) {
    case REQUEST_UPLOAD_START:
        return s->block_start == 0u && s->closing == 0u;
    case REQUEST_UPLOAD_ACKNOWLEDGE:
        return s->closing != 0u && data[1] == s->closing &&
               (s->state == SDO_SERVER_BLOCK_UPLOAD_END || data[1] > s->sequence);
    default:
        return false;
    }
}

static bool is_doubled(const struct sdo_server *s, const uint8_t *data)
{
    switch (s->state) {
    case SDO_SERVER_IDLE:
        return s->closing != 0u && data[0] == s->closing;
    case SDO_SERVER_BLOCK_DOWNLOAD: /* in a block of one segment the next one has the same number */
        return s->sequence == 0u && s->received == 0u && s->closing > 1u &&
               is_doubled_segment(s, data);
    case SDO_SERVER_BLOCK_DOWNLOAD_END:
        return is_doubled_segment(s, data);
    case SDO_SERVER_BLOCK_UPLOAD:
    case SDO_SERVER_BLOCK_UPLOAD_ACK:
    case SDO_SERVER_BLOCK_UPLOAD_END:
        return is_doubled_upload_command(s, data);
    default:
        return false;
    }
}

/* ---- Requests, and who may make them ---- */

void sdo_server_init(struct sdo_server *server, struct od *od, uint8_t node, uint32_t timeout_us,
                     uint8_t block_segments)
{
    memset(server, 0, sizeof *server);
    od_transfer_init(&server->object, od);
    server->node = node;
    server->timeout_us = timeout_us;
    assert(block_segments >= 1 && block_segments <= SDO_BLOCK_SEGMENTS_MAX);
    server->block_size = block_segments;
    server->state = SDO_SERVER_IDLE;
}

void sdo_server_reset(struct sdo_server *server)
{
    drop(server);
}

bool sdo_server_wants(const struct sdo_server *server, const struct can_msg *in)
{
    return in->id == COB_SDO_REQUEST + server->node && in->len == SDO_BYTES;
}

/* Drops a transfer under way and stores the object of the new one. */
static void begin(struct sdo_server *s, const uint8_t *data)
{
    drop(s);
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

static bool initiate(struct sdo_server *s, const uint8_t *data, struct can_msg *out)
{
    begin(s, data);
    switch (data[0] >> 5) {
    case CLIENT_DOWNLOAD:
        return download_initiate(s, data, out);
    case CLIENT_UPLOAD:
        return upload_initiate(s, out);
    case CLIENT_BLOCK_UPLOAD:
        return block_upload_initiate(s, data, out);
    default:
        return block_download_initiate(s, data, out);
    }
}

static bool go_on(struct sdo_server *s, const uint8_t *data, struct can_msg *out)
{
    uint8_t command = data[0] >> 5;

    switch (s->state) {
    case SDO_SERVER_DOWNLOAD:
        return command == CLIENT_DOWNLOAD_SEGMENT ? download_segment(s, data, out)
                                                  : fail(s, SDO_ABORT_COMMAND, out);
    case SDO_SERVER_UPLOAD:
        return command == CLIENT_UPLOAD_SEGMENT ? upload_segment(s, data, out)
                                                : fail(s, SDO_ABORT_COMMAND, out);
    case SDO_SERVER_BLOCK_DOWNLOAD_END:
        return command == CLIENT_BLOCK_DOWNLOAD ? block_download_end(s, data, out)
                                                : fail(s, SDO_ABORT_COMMAND, out);
    case SDO_SERVER_BLOCK_UPLOAD_READY:
    case SDO_SERVER_BLOCK_UPLOAD:
    case SDO_SERVER_BLOCK_UPLOAD_ACK:
    case SDO_SERVER_BLOCK_UPLOAD_END:
        return command == CLIENT_BLOCK_UPLOAD ? block_upload_command(s, data, out)
                                              : fail(s, SDO_ABORT_COMMAND, out);
    default:
        s->index = 0;
        s->sub = 0;
        return fail(s, SDO_ABORT_COMMAND, out);
    }
}

/* A read of an index without objects, by which host tools find out whether the server is free
 * (docs/reference/protocol.md 3.6). */
static bool is_probe(const uint8_t *data)
{
    return data[0] == 0x40u && (data[2] & 0xF0u) == 0x50u && cob_get(data + 4, 4) == 0u;
}

/* A request by all its bits, for an existing object or a probe: few segments with such a first byte have this form. */
static bool is_sound_initiate(const struct sdo_server *s, const uint8_t *data)
{
    const uint8_t first = data[0];
    const bool expedited = (first & 0xF3u) == 0x23u || first == 0x22u;
    const bool known = expedited || first == 0x20u || first == 0x21u || first == 0x40u ||
                       first == 0xA0u || first == 0xA4u || (first & 0xF9u) == 0xC0u;
    return is_probe(data) ||
           (known && od_find(s->object.od, (uint16_t)cob_get(data + 1, 2), data[3]) != NULL);
}

/* Within a block: by its number not a segment of this client. (After a loss this may also be one of its segments, if
 * its bytes have the form of a request.) */
static bool is_foreign(const struct sdo_server *s, const uint8_t *data)
{
    const uint8_t sequence = data[0] & (uint8_t)~LAST_IN_BLOCK;
    const bool doubled = sequence == s->sequence && sequence != 0u;
    const bool next =
        sequence == s->received + 1u || sequence == s->received + 2u; /* one may be lost */
    return !next && !doubled && is_sound_initiate(s, data);
}

static bool same_object(const struct sdo_server *s, const uint8_t *data)
{
    return cob_get(data + 1, 2) == s->index && data[3] == s->sub;
}

/* The client of this transfer has lost the response to its first request. */
static bool begins_again(const struct sdo_server *s, const uint8_t *data)
{
    return same_object(s, data) && s->object.moved == 0 && s->held == 0;
}

/* The same within a block, where a segment may have the same form. */
static bool restarts(const struct sdo_server *s, const uint8_t *data)
{
    return begins_again(s, data) && is_foreign(s, data);
}

static bool refuse_other_client(const struct sdo_server *s, const uint8_t *data,
                                struct can_msg *out)
{
    frame(s, ABORT_BYTE, out);
    memcpy(out->data + 1, data + 1, 3);
    cob_put(out->data + 4, SDO_ABORT_LOCAL, 4);
    return true;
}

/* The entry of an urgent write; NULL: the frame is not one. */
static const struct od_entry *urgent_entry(const struct sdo_server *s, const uint8_t *data)
{
    const bool whole = data[5] == 0u && data[6] == 0u && data[7] == 0u;
    if (s->object.od->hooks->urgent == NULL || data[0] != EXPEDITED_BYTE || !whole) {
        return NULL;
    }
    const struct od_entry *entry = od_find(s->object.od, (uint16_t)cob_get(data + 1, 2), data[3]);
    const bool taken = entry != NULL && entry->size == 1u && (entry->access & OD_WRITE) != 0u;
    return taken && s->object.od->hooks->urgent(entry, data[4]) ? entry : NULL;
}

/* Executes a write during the transfer under way, which does not change. */
static bool write_meanwhile(const struct sdo_server *s, const struct od_entry *entry,
                            const uint8_t *data, struct can_msg *out)
{
    const uint32_t code = od_write(s->object.od, entry, data + 4, 1);
    frame(s, code == SDO_OK ? DOWNLOADED_BYTE : ABORT_BYTE, out);
    memcpy(out->data + 1, data + 1, 3);
    cob_put(out->data + 4, code, 4);
    return true;
}

static bool from_other_client(const struct sdo_server *s, const uint8_t *data)
{
    if (s->state == SDO_SERVER_IDLE || begins_again(s, data)) {
        return false;
    }
    if (data[0] == ABORT_BYTE) {
        return false;
    }
    return s->state == SDO_SERVER_BLOCK_DOWNLOAD ? is_foreign(s, data) : is_initiate(data);
}

/* Another client that gives up its own transfer does not end this one. */
static void take_abort(struct sdo_server *s, const uint8_t *data)
{
    const bool named = cob_get(data + 1, 2) != 0u;
    if (s->state == SDO_SERVER_IDLE || !named || same_object(s, data)) {
        drop(s);
        s->received = 0;
    }
}

bool sdo_server_receive(struct sdo_server *server, const struct can_msg *in, struct can_msg *out)
{
    if (!sdo_server_wants(server, in) || is_doubled(server, in->data)) {
        return false;
    }
    /* After an aborted block also while idle: there it could be taken for a late segment. */
    const bool idle = server->state == SDO_SERVER_IDLE && server->received == 0u;
    const struct od_entry *urgent = idle ? NULL : urgent_entry(server, in->data);
    if (urgent != NULL) {
        return write_meanwhile(server, urgent, in->data, out);
    }
    if (from_other_client(server, in->data)) {
        return refuse_other_client(server, in->data, out);
    }
    server->waited_us = 0;
    /* A whole byte: within a block, 0x81 ... 0xFF are last segments. */
    if (in->data[0] == ABORT_BYTE) {
        take_abort(server, in->data);
        return false;
    }
    if (server->state == SDO_SERVER_BLOCK_DOWNLOAD && !restarts(server, in->data)) {
        return block_download_segment(server, in->data, out);
    }
    if (server->state == SDO_SERVER_IDLE && block_download_late_segment(server, in->data)) {
        return false;
    }
    if (is_initiate(in->data)) {
        return initiate(server, in->data, out);
    }
    return go_on(server, in->data, out);
}

/* A block whose last segment was lost is acknowledged once before the client's timeout. Not if no segment of it has
 * come: a client that only paused would then send the whole block twice. */
static bool acknowledge_early(struct sdo_server *s, struct can_msg *out)
{
    const bool begun = s->sequence != 0 || (s->received != 0 && !s->acknowledged_early);

    if (s->state != SDO_SERVER_BLOCK_DOWNLOAD || !begun || s->waited_us < s->timeout_us / 2) {
        return false;
    }
    s->acknowledged_early = true;
    return block_download_acknowledge(s, out);
}

bool sdo_server_process(struct sdo_server *server, uint32_t elapsed_us, struct can_msg *out)
{
    if (server->state == SDO_SERVER_IDLE) {
        return false;
    }
    if (server->state == SDO_SERVER_BLOCK_UPLOAD) {
        server->waited_us = 0; /* the server sends, so no frame of the client is due */
        return block_upload_send(server, out);
    }
    server->waited_us =
        elapsed_us > UINT32_MAX - server->waited_us ? UINT32_MAX : server->waited_us + elapsed_us;
    if (server->waited_us >= server->timeout_us) {
        return fail(server, SDO_ABORT_TIMEOUT, out);
    }
    return acknowledge_early(server, out);
}
