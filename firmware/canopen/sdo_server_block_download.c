/* SPDX-License-Identifier: MIT */
#include <string.h>

#include "canopen/cob.h"
#include "canopen/crc16.h"
#include "canopen/sdo_abort.h"
#include "canopen/sdo_server_private.h"

#define ASK_SIZE_GIVEN  0x02u
#define ASK_END         0x01u
#define ANSWER_INITIATE 0xA0u
#define ANSWER_BLOCK    0xA2u
#define ANSWER_END      0xA1u

int sdo_server_block_download_initiate(struct sdo_server *s, const uint8_t *data,
                                       struct can_msg *out)
{
    uint32_t size = (data[0] & ASK_SIZE_GIVEN) != 0 ? (uint32_t)cob_get(data + 4, 4) : 0;
    uint32_t code = sdo_server_open_write(s, size);

    if (code != SDO_OK) {
        return sdo_server_fail(s, code, out);
    }
    s->state = SDO_SERVER_BLOCK_DOWNLOAD;
    s->use_crc = (data[0] & SDO_CRC_SUPPORTED) != 0;
    s->crc = 0;
    s->held = 0;
    s->heard = 0;
    s->sequence = 0;
    s->block_limit = s->block_size;
    s->acknowledged_early = false;
    sdo_server_frame_with_object(s, ANSWER_INITIATE | SDO_CRC_SUPPORTED, out);
    out->data[4] = s->block_size;
    return 1;
}

/* Gives the held segment's first `size` bytes to the object. */
static uint32_t release(struct sdo_server *s, uint32_t size)
{
    if (s->held == 0) {
        return SDO_OK;
    }
    s->held = 0;
    s->crc = crc16_update(s->crc, s->last, size);
    return sdo_server_put(s, s->last, size);
}

int sdo_server_block_download_acknowledge(struct sdo_server *s, struct can_msg *out)
{
    sdo_server_frame(s, ANSWER_BLOCK, out);
    out->data[1] = s->sequence;
    out->data[2] = s->block_size;
    s->sequence = 0;
    s->block_limit = s->block_size;
    return 1;
}

int sdo_server_block_download_segment(struct sdo_server *s, const uint8_t *data,
                                      struct can_msg *out)
{
    uint8_t sequence = data[0] & (uint8_t)~SDO_LAST_IN_BLOCK;
    bool last = (data[0] & SDO_LAST_IN_BLOCK) != 0;
    bool in_order = sequence == s->sequence + 1;
    bool block_ends = last || sequence == s->block_limit;

    if (sequence != 0 && sequence == s->sequence) {
        /* Doubled on the bus, or one of the two is somebody else's. */
        return memcmp(s->last, data + 1, SDO_SEGMENT_BYTES) == 0
                   ? 0
                   : sdo_server_fail(s, SDO_ABORT_SEQUENCE, out);
    }
    s->heard = block_ends ? 0 : sequence;
    if (sequence == 0 || sequence > s->block_limit) {
        return sdo_server_fail(s, SDO_ABORT_SEQUENCE, out);
    }
    if (in_order) {
        uint32_t code = release(s, SDO_SEGMENT_BYTES);
        if (code != SDO_OK) {
            return sdo_server_fail(s, code, out);
        }
        memcpy(s->last, data + 1, SDO_SEGMENT_BYTES);
        s->held = SDO_SEGMENT_BYTES;
        s->sequence = sequence;
        s->acknowledged_early = false;
    }
    if (!block_ends) {
        return 0;
    }
    if (!in_order && s->acknowledged_early) {
        return 0; /* the rest of a block that paused: it has its answer */
    }
    if (in_order && last) {
        s->state = SDO_SERVER_BLOCK_DOWNLOAD_END;
    }
    return sdo_server_block_download_acknowledge(s, out);
}

bool sdo_server_block_download_straggler(struct sdo_server *s, const uint8_t *data)
{
    uint8_t sequence = data[0] & (uint8_t)~SDO_LAST_IN_BLOCK;
    bool straggler = s->heard != 0 && sequence == s->heard + 1;
    bool more = straggler && sequence == data[0];

    s->heard = more ? sequence : 0;
    return straggler;
}

int sdo_server_block_download_end(struct sdo_server *s, const uint8_t *data, struct can_msg *out)
{
    uint32_t unused = (data[0] >> 2) & 7u;
    uint32_t code = (data[0] & ASK_END) != 0 ? SDO_OK : SDO_ABORT_COMMAND;

    if (code == SDO_OK) {
        code = release(s, SDO_SEGMENT_BYTES - unused);
    }
    if (code == SDO_OK && s->use_crc && cob_get(data + 1, 2) != s->crc) {
        code = SDO_ABORT_CRC;
    }
    if (code == SDO_OK) {
        code = sdo_server_finish_write(s);
    }
    if (code != SDO_OK) {
        return sdo_server_fail(s, code, out);
    }
    s->state = SDO_SERVER_IDLE;
    sdo_server_frame(s, ANSWER_END, out);
    return 1;
}
