/* SPDX-License-Identifier: MIT */
/* Block transfers, with and without losses. Run by `make unit`; no I/O. */
#include "canopen/sdo_server.h"

#include <string.h>

#include "canopen/cob.h"
#include "canopen/sdo_abort.h"
#include "sdo_talk.h"
#include "unity.h"

#define IMAGE_MAX 1000u

static struct sdo_talk talk;
static uint8_t image[IMAGE_MAX];

void setUp(void)
{
    sdo_talk_init(&talk);
    for (uint32_t i = 0; i < IMAGE_MAX; i++) {
        image[i] = (uint8_t)(i * 37 + i / 256 + 1);
    }
}

void tearDown(void)
{
}

/* ---- download: a client that repeats what was lost ---- */

/* Which transmission of a segment (counted from 0 over the whole transfer) is lost. In downloads the first of a block
 * always comes: when all of a block is lost the server can but time out. */
static bool never(uint32_t transmission)
{
    (void)transmission;
    return false;
}

static bool third(uint32_t transmission)
{
    return transmission == 2;
}

static bool every_fifth(uint32_t transmission)
{
    return transmission % 5 == 4;
}

static bool last_of_first_block(uint32_t transmission)
{
    return transmission == TALK_BLOCK - 1;
}

static void initiate(uint32_t size)
{
    const uint8_t expected[8] = {0xA4, 0x05, 0x20, 0x00, TALK_BLOCK};

    TEST_ASSERT_TRUE(sdo_talk_ask(&talk, 0xC6, 0x2005, 0, size));
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, talk.answer.data, 8);
}

/* One block from `at` on; returns the number of segments that the server has taken. */
static uint32_t send_block(uint32_t at, uint32_t size, bool (*lost)(uint32_t), uint32_t *sent)
{
    bool answered = false;

    for (uint32_t sequence = 1; sequence <= TALK_BLOCK && !answered; sequence++) {
        uint32_t left = size - at;
        uint32_t now = left < 7 ? left : 7;
        uint8_t first = (uint8_t)(sequence | (now == left ? 0x80u : 0u));

        if (!lost((*sent)++) || sequence == 1) {
            answered = sdo_talk_segment(&talk, first, image + at, now);
        }
        at += now;
        if (at == size) {
            break;
        }
    }
    if (!answered) {
        TEST_ASSERT_TRUE(sdo_server_process(&talk.server, TALK_TIMEOUT_US / 2, &talk.answer));
    }
    TEST_ASSERT_EQUAL_HEX8(0xA2, talk.answer.data[0]);
    TEST_ASSERT_EQUAL_UINT8(TALK_BLOCK, talk.answer.data[2]);
    return talk.answer.data[1];
}

static void finish(uint32_t size, uint16_t crc)
{
    uint8_t request[8] = {0};
    uint32_t unused = (7 - size % 7) % 7;

    request[0] = (uint8_t)(0xC1u | unused << 2);
    cob_put(request + 1, crc, 2);
    TEST_ASSERT_TRUE(sdo_talk_send(&talk, request));
}

static void download(uint32_t size, bool (*lost)(uint32_t))
{
    uint32_t at = 0;
    uint32_t sent = 0;

    initiate(size);
    while (at < size) {
        at += 7 * send_block(at, size, lost, &sent);
        TEST_ASSERT_LESS_THAN_UINT32_MESSAGE(10000, sent, "the transfer does not come to an end");
    }
    finish(size, sdo_block_crc(0, image, size));
    TEST_ASSERT_EQUAL_HEX8(0xA1, talk.answer.data[0]);
    TEST_ASSERT_FALSE(sdo_talk_busy(&talk));
    TEST_ASSERT_EQUAL_UINT32(size, talk.small.domain_size);
    TEST_ASSERT_EQUAL_MEMORY(image, talk.small.domain, size);
    TEST_ASSERT_EQUAL_INT(0, talk.small.aborted);
}

static void test_crc_check_value(void)
{
    TEST_ASSERT_EQUAL_HEX16(0x31C3, sdo_block_crc(0, (const uint8_t *)"123456789", 9));
    TEST_ASSERT_EQUAL_HEX16(sdo_block_crc(0, image, 100),
                            sdo_block_crc(sdo_block_crc(0, image, 33), image + 33, 67));
}

static void test_download_of_every_size(void)
{
    for (uint32_t size = 1; size <= 2 * 7 * TALK_BLOCK + 8; size++) {
        download(size, never);
    }
}

static void test_download_repeats_what_was_lost(void)
{
    download(IMAGE_MAX, third);
    download(IMAGE_MAX, every_fifth);
    download(1, never);
}

/* At the end of the block, not after half of the timeout. */
static void test_a_gap_is_answered_with_the_last_segment(void)
{
    initiate(IMAGE_MAX);
    sdo_talk_segment(&talk, 1, image, 7);
    for (uint8_t sequence = 3; sequence < TALK_BLOCK; sequence++) {
        TEST_ASSERT_FALSE(sdo_talk_segment(&talk, sequence, image, 7));
    }
    TEST_ASSERT_TRUE(sdo_talk_segment(&talk, TALK_BLOCK, image, 7));
    TEST_ASSERT_EQUAL_HEX8(0xA2, talk.answer.data[0]);
    TEST_ASSERT_EQUAL_UINT8(1, talk.answer.data[1]);
}

static void test_download_when_the_last_segment_of_a_block_is_lost(void)
{
    download(IMAGE_MAX, last_of_first_block);
    download(7 * TALK_BLOCK, last_of_first_block);
}

static void test_download_without_size_and_crc(void)
{
    uint32_t sent = 0;

    TEST_ASSERT_TRUE(sdo_talk_ask(&talk, 0xC0, 0x2005, 0, 0));
    TEST_ASSERT_EQUAL_UINT32(0, talk.small.announced);
    send_block(0, 20, never, &sent);
    finish(20, 0xBEEF);
    TEST_ASSERT_EQUAL_HEX8(0xA1, talk.answer.data[0]);
    TEST_ASSERT_EQUAL_MEMORY(image, talk.small.domain, 20);
}

static void test_download_of_a_value(void)
{
    TEST_ASSERT_TRUE(sdo_talk_ask(&talk, 0xC6, 0x2003, 0, 4));
    sdo_talk_segment(&talk, 0x81, image, 4);
    TEST_ASSERT_EQUAL_HEX32(0, talk.small.values.word);
    finish(4, sdo_block_crc(0, image, 4));
    TEST_ASSERT_EQUAL_HEX8(0xA1, talk.answer.data[0]);
    TEST_ASSERT_EQUAL_HEX32(cob_get(image, 4), talk.small.values.word);
}

static void expect_abort(uint32_t code)
{
    TEST_ASSERT_EQUAL_HEX32(code, sdo_talk_abort_code(&talk));
    TEST_ASSERT_FALSE(sdo_talk_busy(&talk));
    TEST_ASSERT_FALSE(talk.small.open);
}

static void test_download_refusals(void)
{
    sdo_talk_ask(&talk, 0xC6, 0x3000, 0, 4);
    expect_abort(SDO_ABORT_NO_OBJECT);
    sdo_talk_ask(&talk, 0xC6, 0x1000, 0, 4);
    expect_abort(SDO_ABORT_READ_ONLY);
    sdo_talk_ask(&talk, 0xC6, 0x2003, 0, 5);
    expect_abort(SDO_ABORT_TOO_LONG);
    talk.small.begin_refusal = SDO_ABORT_STATE;
    sdo_talk_ask(&talk, 0xC6, 0x2005, 0, 4);
    expect_abort(SDO_ABORT_STATE);
    talk.small.begin_refusal = SDO_OK;
    sdo_talk_ask(&talk, 0xC6, 0x2005, 0, UINT32_MAX);
    expect_abort(SDO_ABORT_MEMORY);
    TEST_ASSERT_EQUAL_INT(0, talk.small.begun);
}

static void test_wrong_crc(void)
{
    uint32_t sent = 0;

    initiate(20);
    send_block(0, 20, never, &sent);
    finish(20, (uint16_t)(sdo_block_crc(0, image, 20) ^ 1u));
    expect_abort(SDO_ABORT_CRC);
    TEST_ASSERT_EQUAL_INT(1, talk.small.aborted);
    TEST_ASSERT_EQUAL_INT(0, talk.small.ended);
}

static void test_size_that_was_not_announced(void)
{
    uint32_t sent = 0;

    initiate(20);
    send_block(0, 21, never, &sent);
    finish(21, sdo_block_crc(0, image, 21));
    expect_abort(SDO_ABORT_TOO_LONG);
    initiate(20);
    send_block(0, 19, never, &sent);
    finish(19, sdo_block_crc(0, image, 19));
    expect_abort(SDO_ABORT_TOO_SHORT);
    initiate(8);
    sdo_talk_segment(&talk, 1, image, 7);
    sdo_talk_segment(&talk, 2, image, 7);
    sdo_talk_segment(&talk, 3, image, 7);
    expect_abort(SDO_ABORT_TOO_LONG);
    TEST_ASSERT_EQUAL_INT(0, talk.small.ended);
}

static void test_sequence_numbers_out_of_range(void)
{
    initiate(20);
    TEST_ASSERT_TRUE(sdo_talk_segment(&talk, 0x00, image, 7));
    expect_abort(SDO_ABORT_SEQUENCE);
    initiate(20);
    TEST_ASSERT_TRUE(sdo_talk_segment(&talk, TALK_BLOCK + 1, image, 7));
    expect_abort(SDO_ABORT_SEQUENCE);
}

static void test_domain_refuses_in_the_middle(void)
{
    initiate(100);
    sdo_talk_segment(&talk, 1, image, 7);
    talk.small.write_refusal = SDO_ABORT_TRANSFER;
    TEST_ASSERT_TRUE(sdo_talk_segment(&talk, 2, image + 7, 7));
    expect_abort(SDO_ABORT_TRANSFER);
    TEST_ASSERT_EQUAL_INT(1, talk.small.aborted);
}

/* A client that sends a block does not receive. Its frames after the abort have the form of requests: 0x23
 * with these bytes would write to 0x2003. */
static void test_the_rest_of_a_block_after_an_abort_is_no_request(void)
{
    const uint8_t bytes[7] = {0x03, 0x20, 0x00, 1, 2, 3, 4};

    sdo_server_init(&talk.server, &talk.small.od, TALK_NODE, TALK_TIMEOUT_US, 127);
    TEST_ASSERT_TRUE(sdo_talk_ask(&talk, 0xC6, 0x2005, 0, IMAGE_MAX));
    sdo_talk_segment(&talk, 1, bytes, 7);
    talk.small.write_refusal = SDO_ABORT_TRANSFER;
    TEST_ASSERT_TRUE(sdo_talk_segment(&talk, 2, bytes, 7));
    expect_abort(SDO_ABORT_TRANSFER);
    for (uint8_t sequence = 3; sequence <= 126; sequence++) {
        TEST_ASSERT_FALSE(sdo_talk_segment(&talk, sequence, bytes, 7));
    }
    TEST_ASSERT_FALSE(sdo_talk_segment(&talk, 0xFF, bytes, 7));
    TEST_ASSERT_EQUAL_HEX32(0, talk.small.values.word);
    TEST_ASSERT_TRUE(sdo_talk_segment(&talk, 0x23, bytes, 7));
    TEST_ASSERT_EQUAL_HEX32(0x04030201, talk.small.values.word);
}

static void test_a_request_after_an_abort_is_answered(void)
{
    initiate(100);
    sdo_talk_segment(&talk, 1, image, 7);
    talk.small.write_refusal = SDO_ABORT_TRANSFER;
    TEST_ASSERT_TRUE(sdo_talk_segment(&talk, 2, image + 7, 7));
    TEST_ASSERT_FALSE(sdo_talk_segment(&talk, 3, image + 14, 7));
    talk.small.write_refusal = SDO_OK;
    initiate(100);
    sdo_talk_segment(&talk, 1, image, 7);
    TEST_ASSERT_FALSE(sdo_talk_ask(&talk, 0x80, 0x2005, 0, SDO_ABORT_GENERAL));
    TEST_ASSERT_TRUE(sdo_talk_segment(&talk, 2, image, 7)); /* the client itself broke off */
}

/* Somebody else's requests, whose first bytes are numbers of segments too. */
static void test_a_second_client_inside_a_block(void)
{
    static const uint8_t asks[] = {0x20, 0x21, 0x23, 0x2F, 0x40, 0xA0, 0xA4, 0xC0, 0xC6};
    uint8_t sequence = 1;
    sdo_server_init(&talk.server, &talk.small.od, TALK_NODE, TALK_TIMEOUT_US, 127);
    TEST_ASSERT_TRUE(sdo_talk_ask(&talk, 0xC6, 0x2005, 0, 100));
    for (unsigned i = 0; i < sizeof asks; ++i) {
        sdo_talk_segment(&talk, sequence, image + 7u * (sequence - 1u), 7);
        sequence++;
        TEST_ASSERT_TRUE(sdo_talk_ask(&talk, asks[i], 0x2003, 0, 1));
        TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_LOCAL, sdo_talk_abort_code(&talk));
        TEST_ASSERT_TRUE(sdo_talk_busy(&talk));
        TEST_ASSERT_EQUAL_UINT8(0, talk.answer.data[3]);
    }
    for (; sequence <= 15; ++sequence) {
        const uint32_t at = 7u * (sequence - 1u);
        sdo_talk_segment(&talk, (uint8_t)(sequence | (sequence == 15 ? 0x80u : 0u)), image + at,
                         at + 7 <= 100 ? 7 : 100 - at);
    }
    finish(100, sdo_block_crc(0, image, 100));
    TEST_ASSERT_EQUAL_HEX8(0xA1, talk.answer.data[0]);
    TEST_ASSERT_EQUAL_MEMORY(image, talk.small.domain, 100);
}

/* A client that asks again and again whether the server is free must not keep a transfer alive whose client is gone. */
static void test_probes_inside_a_block_whose_client_is_gone(void)
{
    const uint32_t asked = 8;
    initiate(300);
    sdo_talk_segment(&talk, 1, image, 7);
    for (uint32_t i = 1; i < asked; ++i) {
        (void)sdo_server_process(&talk.server, TALK_TIMEOUT_US / asked, &talk.answer);
        TEST_ASSERT_TRUE(sdo_talk_ask(&talk, 0x40, (uint16_t)(0x5000u + i), (uint8_t)i, 0));
        TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_LOCAL, sdo_talk_abort_code(&talk));
    }
    TEST_ASSERT_TRUE(sdo_server_process(&talk.server, TALK_TIMEOUT_US / asked, &talk.answer));
    expect_abort(SDO_ABORT_TIMEOUT);
    TEST_ASSERT_TRUE(sdo_talk_ask(&talk, 0x40, 0x5FFF, 0xFF, 0));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_NO_OBJECT, sdo_talk_abort_code(&talk));
}

/* The one request whose number is the next one in the block: the transfer does not survive it, and nobody takes the
 * value. */
static void test_a_second_client_that_hits_the_next_number(void)
{
    const uint8_t request[7] = {0x03, 0x20, 0x00, 1, 2, 3, 4};
    sdo_server_init(&talk.server, &talk.small.od, TALK_NODE, TALK_TIMEOUT_US, 127);
    TEST_ASSERT_TRUE(sdo_talk_ask(&talk, 0xC6, 0x2005, 0, 300));
    for (uint8_t sequence = 1; sequence < 0x23; ++sequence) {
        sdo_talk_segment(&talk, sequence, image, 7);
    }
    TEST_ASSERT_FALSE(sdo_talk_segment(&talk, 0x23, request, 7));
    TEST_ASSERT_TRUE(sdo_talk_segment(&talk, 0x23, image, 7));
    expect_abort(SDO_ABORT_SEQUENCE);
    TEST_ASSERT_EQUAL_INT(1, talk.small.aborted);
    TEST_ASSERT_EQUAL_INT(0, talk.small.ended);
}

static void test_a_segment_doubled_on_the_bus_is_taken_once(void)
{
    initiate(14);
    sdo_talk_segment(&talk, 1, image, 7);
    TEST_ASSERT_FALSE(sdo_talk_segment(&talk, 1, image, 7));
    sdo_talk_segment(&talk, 0x82, image + 7, 7);
    finish(14, sdo_block_crc(0, image, 14));
    TEST_ASSERT_EQUAL_HEX8(0xA1, talk.answer.data[0]);
}

/* A sender repeats the last frame of a block, or of the transfer, whose acknowledgement was disturbed. */
static void test_frames_at_the_end_of_a_download_may_be_doubled(void)
{
    for (uint32_t size = 1; size <= 2 * 7 * TALK_BLOCK + 8; size++) {
        uint32_t at = 0;
        initiate(size);
        while (at < size) {
            const uint32_t begin = at;
            uint32_t sent = 0;
            at += 7 * send_block(at, size, never, &sent);
            const uint32_t final = begin + 7 * (sent - 1);
            const uint32_t bytes = size - final < 7 ? size - final : 7;
            const uint8_t first = (uint8_t)(sent | (final + bytes == size ? 0x80u : 0u));
            TEST_ASSERT_FALSE(sdo_talk_segment(&talk, first, image + final, bytes));
        }
        finish(size, sdo_block_crc(0, image, size));
        TEST_ASSERT_EQUAL_HEX8(0xA1, talk.answer.data[0]);
        uint8_t end[8] = {(uint8_t)(0xC1u | ((7 - size % 7) % 7) << 2)};
        cob_put(end + 1, sdo_block_crc(0, image, size), 2);
        TEST_ASSERT_FALSE(sdo_talk_send(&talk, end));
        TEST_ASSERT_EQUAL_UINT32(size, talk.small.domain_size);
        TEST_ASSERT_EQUAL_MEMORY(image, talk.small.domain, size);
    }
    TEST_ASSERT_EQUAL_INT(0, talk.small.aborted);
}

/* In blocks of one segment equal segments are no doubles. */
static void test_equal_segments_in_blocks_of_one(void)
{
    const uint8_t zeros[21] = {0};
    talk.server.block_size = 1;
    TEST_ASSERT_TRUE(sdo_talk_ask(&talk, 0xC6, 0x2005, 0, 21));
    TEST_ASSERT_TRUE(sdo_talk_segment(&talk, 1, zeros, 7));
    TEST_ASSERT_TRUE(sdo_talk_segment(&talk, 1, zeros, 7));
    TEST_ASSERT_TRUE(sdo_talk_segment(&talk, 0x81, zeros, 7));
    finish(21, sdo_block_crc(0, zeros, 21));
    TEST_ASSERT_EQUAL_HEX8(0xA1, talk.answer.data[0]);
}

static void test_abort_by_the_client_inside_a_block(void)
{
    initiate(100);
    sdo_talk_segment(&talk, 1, image, 7);
    TEST_ASSERT_FALSE(sdo_talk_ask(&talk, 0x80, 0x2005, 0, SDO_ABORT_GENERAL));
    TEST_ASSERT_EQUAL_INT(1, talk.small.aborted);
    sdo_talk_ask(&talk, 0xC6, 0x2005, 0, 7);
    TEST_ASSERT_EQUAL_HEX8(0xA4, talk.answer.data[0]);
    TEST_ASSERT_EQUAL_INT(2, talk.small.begun);
}

/* The client is slow, nothing is lost: the early answer makes it repeat; no second one confuses. */
static void test_a_pause_inside_a_block_is_no_loss(void)
{
    initiate(100);
    sdo_talk_segment(&talk, 1, image, 7);
    sdo_talk_segment(&talk, 2, image + 7, 7);
    TEST_ASSERT_TRUE(sdo_server_process(&talk.server, TALK_TIMEOUT_US / 2, &talk.answer));
    TEST_ASSERT_EQUAL_UINT8(2, talk.answer.data[1]);
    for (uint8_t sequence = 3; sequence <= 15; sequence++) {
        uint8_t first = (uint8_t)(sequence | (sequence == 15 ? 0x80u : 0u));
        TEST_ASSERT_FALSE(sdo_talk_segment(&talk, first, image, 2));
    }
    for (uint8_t sequence = 1; sequence <= 13; sequence++) {
        uint8_t first = (uint8_t)(sequence | (sequence == 13 ? 0x80u : 0u));
        uint32_t at = 7u * (sequence + 1u);
        sdo_talk_segment(&talk, first, image + at, at + 7 <= 100 ? 7 : 100 - at);
    }
    TEST_ASSERT_EQUAL_HEX8(0xA2, talk.answer.data[0]);
    TEST_ASSERT_EQUAL_UINT8(13, talk.answer.data[1]);
    finish(100, sdo_block_crc(0, image, 100));
    TEST_ASSERT_EQUAL_HEX8(0xA1, talk.answer.data[0]);
    TEST_ASSERT_EQUAL_MEMORY(image, talk.small.domain, 100);
}

static void test_no_early_answer_before_the_first_segment(void)
{
    initiate(100);
    TEST_ASSERT_FALSE(sdo_server_process(&talk.server, TALK_TIMEOUT_US - 1, &talk.answer));
    TEST_ASSERT_TRUE(sdo_server_process(&talk.server, 1, &talk.answer));
    expect_abort(SDO_ABORT_TIMEOUT);
}

static void test_silence_inside_a_block(void)
{
    initiate(100);
    sdo_talk_segment(&talk, 1, image, 7);
    TEST_ASSERT_TRUE(sdo_server_process(&talk.server, TALK_TIMEOUT_US / 2, &talk.answer));
    TEST_ASSERT_EQUAL_UINT8(1, talk.answer.data[1]);
    TEST_ASSERT_FALSE(sdo_server_process(&talk.server, 1, &talk.answer));
    TEST_ASSERT_TRUE(sdo_server_process(&talk.server, TALK_TIMEOUT_US / 2, &talk.answer));
    expect_abort(SDO_ABORT_TIMEOUT);
}

/* ---- upload ---- */

static void provide(uint32_t size)
{
    memcpy(talk.small.domain, image, size);
    talk.small.domain_size = size;
}

static void start_upload(uint32_t size, uint8_t segments)
{
    const uint8_t go[8] = {0xA3};

    provide(size);
    TEST_ASSERT_TRUE(sdo_talk_ask(&talk, 0xA4, 0x2005, 0, segments));
    TEST_ASSERT_EQUAL_HEX8(0xC6, talk.answer.data[0]);
    TEST_ASSERT_EQUAL_UINT32(size, cob_get(talk.answer.data + 4, 4));
    TEST_ASSERT_TRUE(sdo_talk_send(&talk, go));
}

static bool acknowledge(uint8_t good, uint8_t segments)
{
    const uint8_t request[8] = {0xA2, good, segments};

    return sdo_talk_send(&talk, request);
}

/* Takes a block whose first segment is in talk.answer; `lost` as above. Returns segments in order.
 */
static uint8_t take_block(uint8_t *to, uint32_t room, bool (*lost)(uint32_t), uint32_t *sent,
                          bool *last)
{
    uint8_t good = 0;

    *last = false;
    do {
        const uint8_t *data = talk.answer.data;
        if (!lost((*sent)++) && (data[0] & 0x7F) == good + 1) {
            TEST_ASSERT_LESS_OR_EQUAL_UINT32(room, good * 7u + 7u);
            memcpy(to + good * 7u, data + 1, 7);
            good++;
            *last = (data[0] & 0x80) != 0;
        }
    } while (sdo_server_process(&talk.server, 0, &talk.answer));
    return good;
}

static void upload(uint32_t size, uint8_t segments, bool (*lost)(uint32_t))
{
    const uint8_t finished[8] = {0xA1};
    uint8_t got[IMAGE_MAX + 7];
    uint32_t at = 0;
    uint32_t sent = 0;
    bool last = false;

    start_upload(size, segments);
    while (!last) {
        uint8_t good = take_block(got + at, (uint32_t)sizeof got - at, lost, &sent, &last);
        at += good * 7u;
        TEST_ASSERT_TRUE(acknowledge(good, segments));
        TEST_ASSERT_LESS_THAN_UINT32_MESSAGE(10000, sent, "the transfer does not come to an end");
    }
    TEST_ASSERT_EQUAL_HEX8(0xC1, talk.answer.data[0] & 0xE3);
    TEST_ASSERT_EQUAL_UINT32(size, at - ((talk.answer.data[0] >> 2) & 7u));
    TEST_ASSERT_EQUAL_HEX16(sdo_block_crc(0, image, size), cob_get(talk.answer.data + 1, 2));
    TEST_ASSERT_FALSE(sdo_talk_send(&talk, finished));
    TEST_ASSERT_FALSE(sdo_talk_busy(&talk));
    if (size > 0) {
        TEST_ASSERT_EQUAL_MEMORY(image, got, size);
    }
}

static void test_upload_of_every_size(void)
{
    for (uint32_t size = 0; size < 100; size++) {
        upload(size, 1, never);
        upload(size, 4, never);
        upload(size, 127, never);
    }
}

static void test_upload_repeats_what_was_lost(void)
{
    upload(IMAGE_MAX, 16, third);
    upload(IMAGE_MAX, 16, every_fifth);
    upload(7 * TALK_BLOCK, TALK_BLOCK, last_of_first_block);
    upload(IMAGE_MAX, 127, every_fifth);
}

/* The double comes before the segments that the request asks for have been sent. */
static void test_commands_of_an_upload_may_be_doubled(void)
{
    const uint8_t go[8] = {0xA3};
    const uint8_t finished[8] = {0xA1};
    start_upload(100, 8);
    TEST_ASSERT_FALSE(sdo_talk_send(&talk, go));
    while (sdo_server_process(&talk.server, 0, &talk.answer)) {
    }
    TEST_ASSERT_TRUE(acknowledge(8, 8));
    TEST_ASSERT_FALSE(acknowledge(8, 8));
    while (sdo_server_process(&talk.server, 0, &talk.answer)) {
    }
    TEST_ASSERT_EQUAL_HEX8(0x87, talk.answer.data[0]);
    TEST_ASSERT_TRUE(acknowledge(7, 8));
    TEST_ASSERT_FALSE(acknowledge(7, 8));
    TEST_ASSERT_EQUAL_HEX8(0xC1, talk.answer.data[0] & 0xE3);
    TEST_ASSERT_FALSE(sdo_talk_send(&talk, finished));
    TEST_ASSERT_FALSE(sdo_talk_send(&talk, finished));
    TEST_ASSERT_FALSE(sdo_talk_busy(&talk));
}

static void test_upload_refusals(void)
{
    sdo_talk_ask(&talk, 0xA4, 0x2005, 0, 0);
    expect_abort(SDO_ABORT_BLOCK_SIZE);
    sdo_talk_ask(&talk, 0xA4, 0x2005, 0, 128);
    expect_abort(SDO_ABORT_BLOCK_SIZE);
    sdo_talk_ask(&talk, 0xA4, 0x2002, 0, 4);
    expect_abort(SDO_ABORT_WRITE_ONLY);
    start_upload(100, 4);
    while (sdo_server_process(&talk.server, 0, &talk.answer)) {
    }
    TEST_ASSERT_TRUE(acknowledge(5, 4));
    expect_abort(SDO_ABORT_SEQUENCE);
    start_upload(100, 4);
    TEST_ASSERT_TRUE(acknowledge(1, 0));
    expect_abort(SDO_ABORT_BLOCK_SIZE);
}

static void test_upload_times_out(void)
{
    start_upload(100, 4);
    while (sdo_server_process(&talk.server, 0, &talk.answer)) {
    }
    TEST_ASSERT_TRUE(sdo_server_process(&talk.server, TALK_TIMEOUT_US, &talk.answer));
    expect_abort(SDO_ABORT_TIMEOUT);
}

static void urgent(void)
{
    TEST_ASSERT_TRUE(sdo_talk_ask(&talk, 0x2F, 0x2000, 0, SMALL_URGENT));
    TEST_ASSERT_EQUAL_HEX8(0x60, talk.answer.data[0]);
    TEST_ASSERT_EQUAL_HEX16(0x2000, cob_get(talk.answer.data + 1, 2));
    TEST_ASSERT_EQUAL_UINT8(SMALL_URGENT, talk.small.values.limited);
    talk.small.values.limited = 0;
}

/* Before each segment, also where its own number is the next one (0x2F is 47). */
static void test_an_urgent_write_beside_a_block_download(void)
{
    sdo_talk_init(&talk);
    sdo_server_init(&talk.server, &talk.small.od, TALK_NODE, TALK_TIMEOUT_US, 127);
    TEST_ASSERT_TRUE(sdo_talk_ask(&talk, 0xC6, 0x2005, 0, 127 * 7));
    for (uint32_t sequence = 1; sequence <= 127; sequence++) {
        urgent();
        const uint8_t first = (uint8_t)(sequence | (sequence == 127 ? 0x80u : 0u));
        TEST_ASSERT_EQUAL(sequence == 127,
                          sdo_talk_segment(&talk, first, image + (sequence - 1) * 7, 7));
    }
    TEST_ASSERT_EQUAL_UINT8(127, talk.answer.data[1]);
    urgent();
    finish(127 * 7, sdo_block_crc(0, image, 127 * 7));
    TEST_ASSERT_EQUAL_INT(1, talk.small.ended);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(image, talk.small.domain, 127 * 7);
}

/* The frame that would be the next segment of an aborted block, also long after the client has gone. */
static void test_an_urgent_write_after_an_aborted_block(void)
{
    sdo_talk_init(&talk);
    sdo_server_init(&talk.server, &talk.small.od, TALK_NODE, TALK_TIMEOUT_US, 127);
    TEST_ASSERT_TRUE(sdo_talk_ask(&talk, 0xC6, 0x2005, 0, 127 * 7));
    for (uint8_t sequence = 1; sequence < 0x2F; sequence++) {
        sdo_talk_segment(&talk, sequence, image, 7);
    }
    TEST_ASSERT_TRUE(sdo_server_process(&talk.server, TALK_TIMEOUT_US, &talk.answer));
    expect_abort(SDO_ABORT_TIMEOUT);
    urgent();
    TEST_ASSERT_FALSE(sdo_talk_segment(&talk, 0x2F, image, 7));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_crc_check_value);
    RUN_TEST(test_download_of_every_size);
    RUN_TEST(test_download_repeats_what_was_lost);
    RUN_TEST(test_a_gap_is_answered_with_the_last_segment);
    RUN_TEST(test_download_when_the_last_segment_of_a_block_is_lost);
    RUN_TEST(test_download_without_size_and_crc);
    RUN_TEST(test_download_of_a_value);
    RUN_TEST(test_download_refusals);
    RUN_TEST(test_wrong_crc);
    RUN_TEST(test_size_that_was_not_announced);
    RUN_TEST(test_sequence_numbers_out_of_range);
    RUN_TEST(test_domain_refuses_in_the_middle);
    RUN_TEST(test_the_rest_of_a_block_after_an_abort_is_no_request);
    RUN_TEST(test_a_request_after_an_abort_is_answered);
    RUN_TEST(test_frames_at_the_end_of_a_download_may_be_doubled);
    RUN_TEST(test_equal_segments_in_blocks_of_one);
    RUN_TEST(test_abort_by_the_client_inside_a_block);
    RUN_TEST(test_a_second_client_inside_a_block);
    RUN_TEST(test_probes_inside_a_block_whose_client_is_gone);
    RUN_TEST(test_a_second_client_that_hits_the_next_number);
    RUN_TEST(test_a_segment_doubled_on_the_bus_is_taken_once);
    RUN_TEST(test_a_pause_inside_a_block_is_no_loss);
    RUN_TEST(test_no_early_answer_before_the_first_segment);
    RUN_TEST(test_silence_inside_a_block);
    RUN_TEST(test_upload_of_every_size);
    RUN_TEST(test_upload_repeats_what_was_lost);
    RUN_TEST(test_commands_of_an_upload_may_be_doubled);
    RUN_TEST(test_upload_refusals);
    RUN_TEST(test_upload_times_out);
    RUN_TEST(test_an_urgent_write_beside_a_block_download);
    RUN_TEST(test_an_urgent_write_after_an_aborted_block);
    return UNITY_END();
}
