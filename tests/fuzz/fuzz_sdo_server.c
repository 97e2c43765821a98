/* SPDX-License-Identifier: MIT */
/*
 * Fuzz harness of canopen/sdo_server.h: the SDO server with any frames, at any time, with hooks that refuse. It keeps
 * to the rules of its hooks (checked in small_od.c), leaves constants alone, and serves the next honest client.
 *
 * Input: one byte selects what happens next: time, refusals, what an honest client would send next, the beginning of a
 * transfer, or any frame.
 *
 * Run by `make fuzz` with libFuzzer, and on its corpus by `make test` and `make unit` (replay.c). No I/O, except that a
 * broken rule is printed and aborts the process.
 */
#include <string.h>

#include "canopen/cob.h"
#include "canopen/sdo_abort.h"
#include "fuzz.h"
#include "sdo_talk.h"

#define ANSWERS_MAX 300 /* in a row: a block has 127 segments */

static struct sdo_talk talk;

static void pass_time(uint32_t us)
{
    int answers = 0;
    while (sdo_server_process(&talk.server, us, &talk.answer) != 0) {
        FUZZ_CHECK(talk.answer.id == COB_SDO_RESPONSE + TALK_NODE && talk.answer.len == 8u);
        FUZZ_CHECK(++answers < ANSWERS_MAX);
        us = 0;
    }
}

static void refuse(uint8_t bits)
{
    const uint32_t code = SDO_ABORT_GENERAL;
    talk.small.veto = (bits & 1u) != 0u ? code : SDO_OK;
    talk.small.read_refusal = (bits & 2u) != 0u ? code : SDO_OK;
    talk.small.begin_refusal = (bits & 4u) != 0u ? code : SDO_OK;
    talk.small.write_refusal = (bits & 8u) != 0u ? code : SDO_OK;
    talk.small.end_refusal = (bits & 16u) != 0u ? code : SDO_OK;
}

static void begin_transfer(struct fuzz_input *in, uint8_t request[8])
{
    static const uint8_t commands[] = {0x20, 0x21, 0x22, 0x23, 0x27, 0x2B, 0x2F, 0x40,
                                       0xA0, 0xA4, 0xC0, 0xC2, 0xC4, 0xC6, 0xA1, 0x80};
    static const uint16_t objects[] = {0x1000, 0x1008, 0x2000, 0x2001, 0x2002, 0x2003,
                                       0x2004, 0x2005, 0x2005, 0x2005, 0x2006, 0x2007,
                                       0x2008, 0x2009, 0x200A, 0x0000};
    const uint8_t which = fuzz_byte(in);
    request[0] = commands[which & 15u];
    cob_put(request + 1, objects[which >> 4], 2);
    request[3] = fuzz_byte(in);
    fuzz_bytes(in, request + 4, 4);
}

/* What an honest client would send next, with the bits of `wrong` turned in the first byte. */
static void go_on(struct fuzz_input *in, uint8_t wrong, uint8_t request[8])
{
    const struct sdo_server *s = &talk.server;
    fuzz_bytes(in, request, 8);
    switch (s->state) {
    case SDO_SERVER_DOWNLOAD:
        request[0] = (uint8_t)(s->toggle | (request[0] & 15u));
        break;
    case SDO_SERVER_UPLOAD:
        request[0] = (uint8_t)(0x60u | s->toggle);
        break;
    case SDO_SERVER_BLOCK_DOWNLOAD:
        request[0] = (uint8_t)((s->sequence + 1u) | (request[0] & 0x80u));
        break;
    case SDO_SERVER_BLOCK_DOWNLOAD_END:
        request[0] = (uint8_t)(0xC1u | (request[0] & 0x1Cu));
        cob_put(request + 1, s->crc, 2);
        break;
    case SDO_SERVER_BLOCK_UPLOAD_READY:
        request[0] = 0xA3;
        break;
    default:
        request[0] = (uint8_t)(0xA1u + (request[0] & 1u));
        break;
    }
    request[0] ^= wrong;
}

static void step(struct fuzz_input *in)
{
    const uint8_t what = fuzz_byte(in);
    uint8_t request[8] = {0};
    struct can_msg frame;
    if (what < 0x30u) {
        pass_time(what * (TALK_TIMEOUT_US / 20u));
    } else if (what < 0x38u) {
        refuse(fuzz_byte(in));
    } else if (what < 0x80u) {
        go_on(in, what < 0x70u ? 0u : fuzz_byte(in), request);
        (void)sdo_talk_send(&talk, request);
    } else if (what < 0xC0u) {
        begin_transfer(in, request);
        (void)sdo_talk_send(&talk, request);
    } else if (what < 0xF0u) {
        fuzz_bytes(in, request, 8);
        (void)sdo_talk_send(&talk, request);
    } else {
        fuzz_frame(in, &frame);
        (void)sdo_server_receive(&talk.server, &frame, &talk.answer);
    }
    FUZZ_CHECK(talk.small.open == talk.server.object.open);
    FUZZ_CHECK(sdo_talk_busy(&talk) || !talk.small.open);
    FUZZ_CHECK(talk.small.begun ==
               talk.small.ended + talk.small.aborted + (talk.small.open ? 1 : 0));
}

static void serves_an_honest_client(void)
{
    const uint8_t constant[8] = {0x43, 0x00, 0x10, 0x00, 0x78, 0x56, 0x34, 0x12};
    refuse(0);
    (void)sdo_talk_ask(&talk, 0x80, 0, 0, SDO_ABORT_GENERAL);
    FUZZ_CHECK(!sdo_talk_busy(&talk) && !talk.small.open);
    FUZZ_CHECK(sdo_talk_ask(&talk, 0x40, 0x1000, 0, 0));
    FUZZ_CHECK(memcmp(constant, talk.answer.data, 8) == 0);
    FUZZ_CHECK(strcmp("Small OD", talk.small.values.name) == 0);
    FUZZ_CHECK(talk.small.values.limited >= 1 && talk.small.values.limited <= 5);
    FUZZ_CHECK(talk.small.values.with_sign >= -100 && talk.small.values.with_sign <= 100);
    FUZZ_CHECK(talk.small.values.flag <= 1u);
}

static void harness(struct fuzz_input *in)
{
    sdo_talk_init(&talk);
    while (fuzz_left(in)) {
        step(in);
    }
    serves_an_honest_client();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    return fuzz_run(harness, data, size);
}
