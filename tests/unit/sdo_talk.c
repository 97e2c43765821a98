/* SPDX-License-Identifier: MIT */
/* Implements sdo_talk.h (see there): a client made of raw frames, for tests of the SDO server. Part of the C tests;
 * no I/O. */
#include "sdo_talk.h"

#include <string.h>

#include "canopen/cob.h"
#include "unity.h"

void sdo_talk_init(struct sdo_talk *talk)
{
    memset(talk, 0, sizeof *talk);
    small_od_init(&talk->small);
    sdo_server_init(&talk->server, &talk->small.od, TALK_NODE, TALK_TIMEOUT_US, TALK_BLOCK);
}

bool sdo_talk_send(struct sdo_talk *talk, const uint8_t request[8])
{
    struct can_msg in;

    cob_frame(&in, COB_SDO_REQUEST + TALK_NODE, 8);
    memcpy(in.data, request, 8);
    if (!sdo_server_receive(&talk->server, &in, &talk->answer)) {
        return false;
    }
    TEST_ASSERT_EQUAL_HEX32(COB_SDO_RESPONSE + TALK_NODE, talk->answer.id);
    TEST_ASSERT_EQUAL_UINT8(8, talk->answer.len);
    return true;
}

bool sdo_talk_ask(struct sdo_talk *talk, uint8_t command, uint16_t index, uint8_t sub,
                  uint32_t data)
{
    uint8_t request[8] = {command};

    cob_put(request + 1, index, 2);
    request[3] = sub;
    cob_put(request + 4, data, 4);
    return sdo_talk_send(talk, request);
}

bool sdo_talk_segment(struct sdo_talk *talk, uint8_t first, const uint8_t *data, uint32_t size)
{
    uint8_t request[8] = {first};

    memcpy(request + 1, data, size);
    return sdo_talk_send(talk, request);
}

bool sdo_talk_busy(const struct sdo_talk *talk)
{
    return talk->server.state != SDO_SERVER_IDLE;
}

uint32_t sdo_talk_abort_code(const struct sdo_talk *talk)
{
    return talk->answer.data[0] == 0x80 ? (uint32_t)cob_get(talk->answer.data + 4, 4) : 0;
}
