/* SPDX-License-Identifier: MIT */
/* Random and half-right frames. The SDO server must keep to the rules of its hooks (checked in small_od.c), touch no
 * byte that is not its own (sanitizers), leave constants alone, and serve the next honest client. Run by
 * `make unit`; no I/O. */
#include "canopen/sdo_client.h"
#include "canopen/sdo_server.h"

#include <string.h>

#include "canopen/cob.h"
#include "canopen/sdo_abort.h"
#include "sdo_talk.h"
#include "unity.h"

#define SEEDS           200u
#define FRAMES_PER_SEED 2000u

static struct sdo_talk talk;
static uint32_t random_state;

void setUp(void)
{
    sdo_talk_init(&talk);
}

void tearDown(void)
{
}

/* Xorshift, Marsaglia 2003 */
static uint32_t random_word(void)
{
    random_state ^= random_state << 13;
    random_state ^= random_state >> 17;
    random_state ^= random_state << 5;
    return random_state;
}

static uint32_t random_below(uint32_t limit)
{
    return random_word() % limit;
}

static void random_bytes(uint8_t *to, uint32_t size)
{
    for (uint32_t i = 0; i < size; i++) {
        to[i] = (uint8_t)random_below(256);
    }
}

static void random_initiate(uint8_t request[8])
{
    static const uint8_t commands[] = {0x20, 0x21, 0x22, 0x23, 0x27, 0x2B, 0x2F,
                                       0x40, 0xA0, 0xA4, 0xC0, 0xC2, 0xC6};
    static const uint16_t objects[] = {0x1000, 0x1008, 0x2000, 0x2001, 0x2002, 0x2003, 0x2004,
                                       0x2005, 0x2005, 0x2005, 0x2006, 0x2007, 0x2008};

    request[0] = commands[random_below(sizeof commands)];
    cob_put(request + 1, objects[random_below(sizeof objects / sizeof objects[0])], 2);
    request[3] = (uint8_t)(random_below(3) == 0 ? random_below(5) : 0);
    cob_put(request + 4, random_below(4) == 0 ? random_word() : random_below(40), 4);
}

/* What an honest client would send next, more or less. */
static void random_continuation(uint8_t request[8])
{
    const struct sdo_server *s = &talk.server;

    random_bytes(request, 8);
    switch (s->state) {
    case SDO_SERVER_DOWNLOAD:
        request[0] = (uint8_t)(s->toggle | random_below(16));
        break;
    case SDO_SERVER_UPLOAD:
        request[0] = (uint8_t)(0x60u | s->toggle);
        break;
    case SDO_SERVER_BLOCK_DOWNLOAD:
        request[0] = (uint8_t)(s->sequence + 1u + (random_below(10) == 0 ? 0x80u : 0u));
        break;
    case SDO_SERVER_BLOCK_DOWNLOAD_END:
        request[0] = (uint8_t)(0xC1u | random_below(8) << 2);
        cob_put(request + 1, s->crc, 2);
        break;
    case SDO_SERVER_BLOCK_UPLOAD_READY:
        request[0] = 0xA3;
        break;
    default:
        request[0] = (uint8_t)(0xA1u + random_below(2));
        request[1] = (uint8_t)random_below(s->sequence + 2u);
        request[2] = (uint8_t)random_below(129);
        break;
    }
}

static void random_request(uint8_t request[8])
{
    uint32_t kind = random_below(100);

    if (kind < 10) {
        random_bytes(request, 8);
    } else if (kind < 14) {
        memset(request, 0, 8);
        request[0] = 0x80;
    } else if (kind < 25 || !sdo_talk_busy(&talk)) {
        random_initiate(request);
    } else {
        random_continuation(request);
    }
}

static void random_time(void)
{
    uint32_t frames = random_below(10);

    while (frames-- > 0) {
        sdo_server_process(&talk.server, random_below(TALK_TIMEOUT_US / 20), &talk.answer);
    }
}

static void check_that_an_honest_client_is_served(void)
{
    const uint8_t constant[8] = {0x43, 0x00, 0x10, 0x00, 0x78, 0x56, 0x34, 0x12};

    sdo_talk_ask(&talk, 0x80, 0, 0, SDO_ABORT_GENERAL);
    TEST_ASSERT_FALSE(sdo_talk_busy(&talk));
    TEST_ASSERT_FALSE(talk.small.open);
    TEST_ASSERT_TRUE(sdo_talk_ask(&talk, 0x40, 0x1000, 0, 0));
    TEST_ASSERT_EQUAL_HEX8_ARRAY(constant, talk.answer.data, 8);
    TEST_ASSERT_EQUAL_STRING("Small OD", talk.small.values.name);
    TEST_ASSERT_TRUE(talk.small.values.limited >= 1 && talk.small.values.limited <= 5);
    TEST_ASSERT_INT16_WITHIN(100, 0, talk.small.values.with_sign);
    TEST_ASSERT_LESS_OR_EQUAL_UINT8(1, talk.small.values.flag);
}

static void test_random_frames(void)
{
    int finished = 0;
    int stored = 0;

    for (uint32_t seed = 1; seed <= SEEDS; seed++) {
        random_state = seed * 2654435761u | 1u;
        sdo_talk_init(&talk);
        for (uint32_t i = 0; i < FRAMES_PER_SEED; i++) {
            uint8_t request[8];
            random_request(request);
            sdo_talk_send(&talk, request);
            if (random_below(5) == 0) {
                random_time();
            }
            TEST_ASSERT_TRUE(talk.small.open == talk.server.object.open);
            TEST_ASSERT_TRUE(sdo_talk_busy(&talk) || !talk.small.open);
        }
        finished += talk.small.ended;
        stored += talk.small.written;
        TEST_ASSERT_EQUAL_INT(talk.small.begun,
                              talk.small.ended + talk.small.aborted + (talk.small.open ? 1 : 0));
        check_that_an_honest_client_is_served();
    }
    /* The frames must be right often enough to reach the inner states. */
    TEST_ASSERT_GREATER_THAN_INT((int)SEEDS, finished);
    TEST_ASSERT_GREATER_THAN_INT((int)SEEDS, stored);
}

/* An answer to the client: often of the right kind, with random sizes, toggles and contents. */
static void random_answer(const struct sdo_client *client, struct can_msg *answer)
{
    static const uint8_t kinds[] = {0x60, 0x20, 0x41, 0x43, 0x4F, 0x42, 0x00, 0x10, 0x01, 0x80};

    cob_frame(answer, COB_SDO_RESPONSE + TALK_NODE, 8);
    random_bytes(answer->data, 8);
    if (random_below(10) != 0) {
        answer->data[0] = kinds[random_below(sizeof kinds)];
        answer->data[0] ^= (uint8_t)(random_below(4) == 0 ? random_below(16) : 0);
    }
    if (random_below(3) != 0) {
        cob_put(answer->data + 1, client->index, 2);
        answer->data[3] = client->sub;
    }
}

static void test_random_answers_to_the_client(void)
{
    struct sdo_client client;
    struct can_msg in;
    struct can_msg out;
    uint8_t value[30] = {0}; /* the sanitizer checks its end */
    int done = 0;

    random_state = 20260101;
    sdo_client_init(&client, 1000);
    for (uint32_t i = 0; i < 200000; i++) {
        uint32_t size = 1 + random_below(sizeof value);

        if (client.status != SDO_CLIENT_BUSY) {
            done += client.status == SDO_CLIENT_DONE;
            int begun = random_below(2) == 0
                            ? sdo_client_write(&client, TALK_NODE, 0x2003, 0, value, size, &out)
                            : sdo_client_read(&client, TALK_NODE, 0x2003, 0, value, size, &out);
            TEST_ASSERT_EQUAL_INT(0, begun);
        }
        random_answer(&client, &in);
        sdo_client_receive(&client, &in, &out);
        if (client.status == SDO_CLIENT_DONE) {
            TEST_ASSERT_TRUE(client.size >= 1 && client.size <= sizeof value);
        }
        sdo_client_process(&client, random_below(100), &out);
    }
    TEST_ASSERT_GREATER_THAN_INT(1000, done);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_random_frames);
    RUN_TEST(test_random_answers_to_the_client);
    return UNITY_END();
}
