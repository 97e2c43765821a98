/* SPDX-License-Identifier: MIT */
#include "canopen/cob.h"
#include "canopen/crc16.h"
#include "canopen/sdo_abort.h"
#include "canopen/sdo_server_private.h"

/* Subcommands of the client, bits 0 and 1. */
#define ASK_SUBCOMMAND  0x03u
#define ASK_END         0x01u
#define ASK_ACKNOWLEDGE 0x02u
#define ASK_START       0x03u
#define ANSWER_INITIATE 0xC2u /* size given */
#define ANSWER_END      0xC1u

static bool block_size_is_valid(uint8_t segments)
{
    return segments >= 1 && segments <= SDO_BLOCK_SEGMENTS_MAX;
}

int sdo_server_block_upload_initiate(struct sdo_server *s, const uint8_t *data, struct can_msg *out)
{
    uint32_t code = sdo_server_open_read(s);

    if (code == SDO_OK && !block_size_is_valid(data[4])) {
        code = SDO_ABORT_BLOCK_SIZE;
    }
    if (code != SDO_OK) {
        return sdo_server_fail(s, code, out);
    }
    s->state = SDO_SERVER_BLOCK_UPLOAD_READY;
    s->use_crc = (data[0] & SDO_CRC_SUPPORTED) != 0;
    s->crc = 0;
    s->sequence = 0;
    s->block_start = 0;
    s->block_limit = data[4];
    sdo_server_frame_with_object(s, ANSWER_INITIATE | SDO_CRC_SUPPORTED, out);
    cob_put(out->data + 4, s->announced, 4);
    return 1;
}

/* Repeated segments count once: `moved` says how far the CRC has come. */
static void add_to_crc(struct sdo_server *s, uint32_t offset, const uint8_t *data, uint32_t size)
{
    if (offset == s->moved) {
        s->crc = crc16_update(s->crc, data, size);
        s->moved += size;
    }
}

int sdo_server_block_upload_send(struct sdo_server *s, struct can_msg *out)
{
    uint32_t offset = s->block_start + s->sequence * SDO_SEGMENT_BYTES;
    uint32_t left = s->announced - offset;
    uint32_t size = left < SDO_SEGMENT_BYTES ? left : SDO_SEGMENT_BYTES;
    uint32_t code;

    s->sequence++;
    sdo_server_frame(s, s->sequence, out);
    code = sdo_server_get(s, offset, out->data + 1, size);
    if (code != SDO_OK) {
        return sdo_server_fail(s, code, out);
    }
    add_to_crc(s, offset, out->data + 1, size);
    if (size == left) {
        out->data[0] |= SDO_LAST_IN_BLOCK;
    }
    if (size == left || s->sequence == s->block_limit) {
        s->state = SDO_SERVER_BLOCK_UPLOAD_ACK;
    }
    return 1;
}

static int end(struct sdo_server *s, struct can_msg *out)
{
    uint32_t in_last = s->announced % SDO_SEGMENT_BYTES;
    uint32_t unused = in_last == 0 && s->announced > 0 ? 0 : SDO_SEGMENT_BYTES - in_last;

    s->state = SDO_SERVER_BLOCK_UPLOAD_END;
    sdo_server_frame(s, (uint8_t)(ANSWER_END | (unused << 2)), out);
    cob_put(out->data + 1, s->use_crc ? s->crc : 0, 2);
    return 1;
}

static int acknowledged(struct sdo_server *s, const uint8_t *data, struct can_msg *out)
{
    uint8_t good = data[1];

    if (good > s->sequence) {
        return sdo_server_fail(s, SDO_ABORT_SEQUENCE, out);
    }
    if (!block_size_is_valid(data[2])) {
        return sdo_server_fail(s, SDO_ABORT_BLOCK_SIZE, out);
    }
    if (good == s->sequence && s->moved == s->announced &&
        s->announced - s->block_start <= good * SDO_SEGMENT_BYTES) {
        return end(s, out);
    }
    s->block_start += good * SDO_SEGMENT_BYTES;
    s->block_limit = data[2];
    s->sequence = 0;
    s->state = SDO_SERVER_BLOCK_UPLOAD;
    return sdo_server_block_upload_send(s, out);
}

int sdo_server_block_upload_command(struct sdo_server *s, const uint8_t *data, struct can_msg *out)
{
    uint8_t subcommand = data[0] & ASK_SUBCOMMAND;

    if (s->state == SDO_SERVER_BLOCK_UPLOAD_READY && subcommand == ASK_START) {
        s->state = SDO_SERVER_BLOCK_UPLOAD;
        return sdo_server_block_upload_send(s, out);
    }
    /* A client that sees a gap may answer before the block is complete. */
    if ((s->state == SDO_SERVER_BLOCK_UPLOAD_ACK || s->state == SDO_SERVER_BLOCK_UPLOAD) &&
        subcommand == ASK_ACKNOWLEDGE) {
        return acknowledged(s, data, out);
    }
    if (s->state == SDO_SERVER_BLOCK_UPLOAD_END && subcommand == ASK_END) {
        s->state = SDO_SERVER_IDLE;
        return 0;
    }
    return sdo_server_fail(s, SDO_ABORT_COMMAND, out);
}
