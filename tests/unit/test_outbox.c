/* SPDX-License-Identifier: MIT */
/* The bus is the other end of a pair of sockets. Run by `make unit`; opens a pair of sockets. */
#define _GNU_SOURCE
#include "injector/outbox.h"

#include <errno.h>
#include <linux/can.h>
#include <sys/socket.h>
#include <unistd.h>

#include "unity.h"

static struct outbox box;
static struct can_socket member;
static int bus;

void setUp(void)
{
    int pair[2];
    TEST_ASSERT_EQUAL(0, socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK, 0, pair));
    box.count = 0;
    member = (struct can_socket){.fd = pair[0], .local = true};
    bus = pair[1];
}

void tearDown(void)
{
    can_socket_close(&member);
    (void)close(bus);
}

static int put(uint32_t id)
{
    const struct can_msg frame = {.id = id, .len = 1, .data = {(uint8_t)id}};
    return outbox_put(&box, &member, &frame);
}

/* Frames that have left, which must be those with the next identifiers. */
static uint32_t left(uint32_t first)
{
    struct can_frame frame;
    uint32_t count = 0;
    while (recv(bus, &frame, sizeof frame, 0) == (ssize_t)sizeof frame) {
        TEST_ASSERT_EQUAL_HEX32(first + count, frame.can_id);
        count++;
    }
    return count;
}

static void test_frames_leave_together(void)
{
    TEST_ASSERT_EQUAL_INT(0, put(1));
    TEST_ASSERT_EQUAL_INT(0, put(2));
    TEST_ASSERT_EQUAL_UINT32(0, left(1));
    TEST_ASSERT_EQUAL_INT(0, outbox_flush(&box, &member));
    TEST_ASSERT_EQUAL_UINT32(2, left(1));
    TEST_ASSERT_EQUAL_INT(0, outbox_flush(&box, &member));
    TEST_ASSERT_EQUAL_UINT32(0, left(1));
}

static void test_a_full_box_is_flushed(void)
{
    for (uint32_t i = 1; i < CAN_SOCKET_BATCH; i++) {
        TEST_ASSERT_EQUAL_INT(0, put(i));
    }
    TEST_ASSERT_EQUAL_UINT32(0, left(1));
    TEST_ASSERT_EQUAL_INT(0, put(CAN_SOCKET_BATCH));
    TEST_ASSERT_EQUAL_UINT32(CAN_SOCKET_BATCH, left(1));
    TEST_ASSERT_EQUAL_INT(0, put(7));
    TEST_ASSERT_EQUAL_INT(0, outbox_flush(&box, &member));
    TEST_ASSERT_EQUAL_UINT32(1, left(7));
}

/* A queue that stays full is a bus that is off: the frames are lost, without an error. */
static void test_a_queue_that_stays_full_loses_frames(void)
{
    const int bytes = 1;
    const struct can_frame any = {.can_id = 1};
    struct can_frame frame;
    TEST_ASSERT_EQUAL(0, setsockopt(member.fd, SOL_SOCKET, SO_SNDBUF, &bytes, sizeof bytes));
    while (send(member.fd, &any, sizeof any, MSG_DONTWAIT) > 0) {
    }
    TEST_ASSERT_EQUAL_INT(0, put(2));
    TEST_ASSERT_EQUAL_INT(0, outbox_flush(&box, &member));
    while (recv(bus, &frame, sizeof frame, 0) > 0) {
        TEST_ASSERT_EQUAL_HEX32(1, frame.can_id);
    }
    TEST_ASSERT_EQUAL_INT(0, put(3));
    TEST_ASSERT_EQUAL_INT(0, outbox_flush(&box, &member));
    TEST_ASSERT_EQUAL_UINT32(1, left(3));
}

static void test_a_bus_that_has_failed(void)
{
    (void)close(bus);
    bus = -1;
    TEST_ASSERT_EQUAL_INT(0, put(1));
    TEST_ASSERT_EQUAL_INT(-EPIPE, outbox_flush(&box, &member));
    TEST_ASSERT_EQUAL_INT(0, outbox_flush(&box, &member));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_frames_leave_together);
    RUN_TEST(test_a_full_box_is_flushed);
    RUN_TEST(test_a_queue_that_stays_full_loses_frames);
    RUN_TEST(test_a_bus_that_has_failed);
    return UNITY_END();
}
