/* SPDX-License-Identifier: MIT */
#include "canopen/cob.h"
#include "canopen/sdo_abort.h"
#include "canopen/sdo_server_private.h"

#define ASK_EXPEDITED           0x02u
#define ASK_SIZE_GIVEN          0x01u
#define ANSWER_DOWNLOAD_SEGMENT 0x20u
#define ANSWER_UPLOAD_EXPEDITED 0x43u /* size given */
#define ANSWER_UPLOAD_SIZE      0x41u
#define EXPEDITED_BYTES         4u

static uint32_t download_expedited(struct sdo_server *s, const uint8_t *data)
{
    uint32_t size = EXPEDITED_BYTES - ((data[0] >> 2) & 3u);
    uint32_t code = sdo_server_open_write(s, 0);

    if (code != SDO_OK) {
        return code;
    }
    if ((data[0] & ASK_SIZE_GIVEN) == 0) {
        /* The client leaves it to the dictionary how many of the four bytes count. */
        size = s->entry->size > 0 && s->entry->size < EXPEDITED_BYTES ? s->entry->size
                                                                      : EXPEDITED_BYTES;
    }
    code = sdo_server_put(s, data + 4, size);
    return code != SDO_OK ? code : sdo_server_finish_write(s);
}

int sdo_server_download_initiate(struct sdo_server *s, const uint8_t *data, struct can_msg *out)
{
    bool expedited = (data[0] & ASK_EXPEDITED) != 0;
    uint32_t code;

    if (expedited) {
        code = download_expedited(s, data);
    } else {
        code = sdo_server_open_write(
            s, (data[0] & ASK_SIZE_GIVEN) != 0 ? (uint32_t)cob_get(data + 4, 4) : 0);
    }
    if (code != SDO_OK) {
        return sdo_server_fail(s, code, out);
    }
    s->state = expedited ? SDO_SERVER_IDLE : SDO_SERVER_DOWNLOAD;
    sdo_server_frame_with_object(s, SDO_DOWNLOADED_BYTE, out);
    return 1;
}

int sdo_server_download_segment(struct sdo_server *s, const uint8_t *data, struct can_msg *out)
{
    uint32_t size = SDO_SEGMENT_BYTES - ((data[0] >> 1) & 7u);
    bool last = (data[0] & SDO_LAST_SEGMENT) != 0;
    uint32_t code = (data[0] & SDO_TOGGLE) == s->toggle ? SDO_OK : SDO_ABORT_TOGGLE;

    if (code == SDO_OK) {
        code = sdo_server_put(s, data + 1, size);
    }
    if (code == SDO_OK && last) {
        code = sdo_server_finish_write(s);
    }
    if (code != SDO_OK) {
        return sdo_server_fail(s, code, out);
    }
    sdo_server_frame(s, (uint8_t)(ANSWER_DOWNLOAD_SEGMENT | s->toggle), out);
    s->toggle ^= SDO_TOGGLE;
    if (last) {
        s->state = SDO_SERVER_IDLE;
    }
    return 1;
}

int sdo_server_upload_initiate(struct sdo_server *s, struct can_msg *out)
{
    uint32_t code = sdo_server_open_read(s);
    bool expedited = s->announced > 0 && s->announced <= EXPEDITED_BYTES;

    sdo_server_frame_with_object(s, ANSWER_UPLOAD_SIZE, out);
    if (code == SDO_OK && expedited) {
        out->data[0] = (uint8_t)(ANSWER_UPLOAD_EXPEDITED | ((EXPEDITED_BYTES - s->announced) << 2));
        code = sdo_server_get(s, 0, out->data + 4, s->announced);
    } else {
        cob_put(out->data + 4, s->announced, 4);
    }
    if (code != SDO_OK) {
        return sdo_server_fail(s, code, out);
    }
    s->state = expedited ? SDO_SERVER_IDLE : SDO_SERVER_UPLOAD;
    return 1;
}

int sdo_server_upload_segment(struct sdo_server *s, const uint8_t *data, struct can_msg *out)
{
    uint32_t left = s->announced - s->moved;
    uint32_t size = left < SDO_SEGMENT_BYTES ? left : SDO_SEGMENT_BYTES;
    uint32_t code = (data[0] & SDO_TOGGLE) == s->toggle ? SDO_OK : SDO_ABORT_TOGGLE;

    sdo_server_frame(s, (uint8_t)(s->toggle | ((SDO_SEGMENT_BYTES - size) << 1)), out);
    if (code == SDO_OK) {
        code = sdo_server_get(s, s->moved, out->data + 1, size);
    }
    if (code != SDO_OK) {
        return sdo_server_fail(s, code, out);
    }
    s->moved += size;
    s->toggle ^= SDO_TOGGLE;
    if (size == left) {
        out->data[0] |= SDO_LAST_SEGMENT;
        s->state = SDO_SERVER_IDLE;
    }
    return 1;
}
