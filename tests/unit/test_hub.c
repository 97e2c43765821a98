/* SPDX-License-Identifier: MIT */
/* A local bus: frames from each member to all others, in order; members come and go. */
#define _GNU_SOURCE
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "hub/hub.h"
#include "port/linux/can_socket.h"
#include "unity.h"

static struct hub hub;
static struct can_socket members[3];
static char path[64];
static int pipe_fds[2];

static void turn(void)
{
    TEST_ASSERT_TRUE(hub_turn(&hub, pipe_fds[0]));
}

void setUp(void)
{
    char reason[128];
    (void)snprintf(path, sizeof path, "/tmp/hodograph-test-hub-%ld", (long)getpid());
    TEST_ASSERT_EQUAL(0, pipe(pipe_fds));
    TEST_ASSERT_EQUAL(0, hub_open(&hub, path));
    for (int i = 0; i < 3; ++i) {
        TEST_ASSERT_EQUAL_MESSAGE(0, can_socket_open(&members[i], path, reason, sizeof reason),
                                  reason);
        turn();
    }
}

void tearDown(void)
{
    for (int i = 0; i < 3; ++i) {
        can_socket_close(&members[i]);
    }
    hub_close(&hub);
    (void)unlink(path);
    (void)close(pipe_fds[0]);
    (void)close(pipe_fds[1]);
}

static int received(struct can_socket *member, struct can_msg messages[CAN_SOCKET_BATCH])
{
    int more = 0;
    return can_socket_receive(member, messages, &more);
}

static void test_frames_reach_all_others_in_order(void)
{
    struct can_msg sent[2] = {{.id = 0x80, .len = 1, .data = {7}},
                              {.id = 0x202, .len = 2, .data = {1, 2}}};
    struct can_msg got[CAN_SOCKET_BATCH];
    TEST_ASSERT_EQUAL(2, can_socket_send_many(&members[0], sent, 2));
    turn();
    for (int i = 1; i < 3; ++i) {
        TEST_ASSERT_EQUAL(2, received(&members[i], got));
        for (int k = 0; k < 2; ++k) {
            TEST_ASSERT_EQUAL(sent[k].id, got[k].id);
            TEST_ASSERT_EQUAL(sent[k].len, got[k].len);
            TEST_ASSERT_EQUAL_MEMORY(sent[k].data, got[k].data, CAN_DATA_MAX);
        }
    }
    TEST_ASSERT_EQUAL(0, received(&members[0], got));
}

static void test_filters_are_those_of_the_socket(void)
{
    const struct can_match only = {0x580, 0x780};
    const struct can_msg sent[3] = {{.id = 0x581}, {.id = 0x601}, {.id = 0x5FF}};
    struct can_msg got[CAN_SOCKET_BATCH];
    TEST_ASSERT_EQUAL(0, can_socket_filter(&members[1], &only, 1));
    TEST_ASSERT_EQUAL(3, can_socket_send_many(&members[0], sent, 3));
    turn();
    TEST_ASSERT_EQUAL(2, received(&members[1], got));
    TEST_ASSERT_EQUAL(0x5FF, got[1].id);
    TEST_ASSERT_EQUAL(3, received(&members[2], got));
}

static void test_one_leaves_and_the_others_go_on(void)
{
    const struct can_msg sent = {.id = 0x123};
    struct can_msg got[CAN_SOCKET_BATCH];
    can_socket_close(&members[0]);
    turn();
    TEST_ASSERT_EQUAL(2, hub.count);
    TEST_ASSERT_EQUAL(0, can_socket_send(&members[2], &sent));
    turn();
    TEST_ASSERT_EQUAL(1, received(&members[1], got));
    TEST_ASSERT_EQUAL(0, hub.lost);
}

static void test_the_end_is_noticed(void)
{
    struct can_msg got[CAN_SOCKET_BATCH];
    TEST_ASSERT_EQUAL(1, write(pipe_fds[1], "", 1));
    TEST_ASSERT_FALSE(hub_turn(&hub, pipe_fds[0]));
    hub_close(&hub);
    TEST_ASSERT_LESS_THAN(0, received(&members[1], got));
    (void)unlink(path);
    TEST_ASSERT_EQUAL(0, hub_open(&hub, path)); /* for tearDown */
}

static void test_nobody_serves(void)
{
    char reason[128];
    struct can_socket lonely;
    TEST_ASSERT_LESS_THAN(0, can_socket_open(&lonely, "/tmp/no/such/bus", reason, sizeof reason));
    TEST_ASSERT_NOT_NULL(strstr(reason, "hodograph-hub"));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_frames_reach_all_others_in_order);
    RUN_TEST(test_filters_are_those_of_the_socket);
    RUN_TEST(test_one_leaves_and_the_others_go_on);
    RUN_TEST(test_the_end_is_noticed);
    RUN_TEST(test_nobody_serves);
    return UNITY_END();
}
