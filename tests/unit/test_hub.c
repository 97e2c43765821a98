/* SPDX-License-Identifier: MIT */
/* A local bus in real time: frames from each member to all others, in order; members come and go. Run by
 * `make unit`; starts a hub in a thread, and opens sockets in /tmp. */
#define _GNU_SOURCE
#include <errno.h>
#include <poll.h>
#include <pthread.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "hub_thread.h"
#include "port/linux/can_socket.h"
#include "port/linux/clock.h"
#include "unity.h"

static struct can_socket members[3];

void setUp(void)
{
    char reason[128];
    hub_thread_begin((struct hub_options){.is_virtual = false});
    for (int i = 0; i < 3; ++i) {
        TEST_ASSERT_EQUAL_MESSAGE(
            0, can_socket_open(&members[i], hub_thread_paths[0], reason, sizeof reason), reason);
    }
}

void tearDown(void)
{
    for (int i = 0; i < 3; ++i) {
        can_socket_close(&members[i]);
    }
    hub_thread_end();
}

/* Waits until `wanted` frames have come; a negative errno when the bus has ended. */
static int receive(struct can_socket *member, struct can_msg *messages, int wanted)
{
    int count = 0;
    while (count < wanted) {
        struct can_msg batch[CAN_SOCKET_BATCH];
        struct pollfd wait = {.fd = member->fd, .events = POLLIN};
        int more = 0;
        TEST_ASSERT_EQUAL(1, poll(&wait, 1, -1));
        const int got = can_socket_receive(member, batch, &more);
        if (got < 0) {
            return got;
        }
        memcpy(messages + count, batch, (size_t)got * sizeof batch[0]);
        count += got;
    }
    return count;
}

static int waiting(struct can_socket *member)
{
    struct can_msg batch[CAN_SOCKET_BATCH];
    int more = 0;
    return can_socket_receive(member, batch, &more);
}

static void test_frames_reach_all_others_in_order(void)
{
    struct can_msg sent[2] = {{.id = 0x80, .len = 1, .data = {7}},
                              {.id = 0x202, .len = 2, .data = {1, 2}}};
    struct can_msg got[CAN_SOCKET_BATCH];
    TEST_ASSERT_EQUAL(2, can_socket_send_many(&members[0], sent, 2));
    for (int i = 1; i < 3; ++i) {
        TEST_ASSERT_EQUAL(2, receive(&members[i], got, 2));
        for (int k = 0; k < 2; ++k) {
            TEST_ASSERT_EQUAL(sent[k].id, got[k].id);
            TEST_ASSERT_EQUAL(sent[k].len, got[k].len);
            TEST_ASSERT_EQUAL_MEMORY(sent[k].data, got[k].data, CAN_DATA_MAX);
        }
    }
    TEST_ASSERT_EQUAL(0, waiting(&members[0]));
}

static void test_filters_are_those_of_the_socket(void)
{
    const struct can_match only = {0x580, 0x780};
    const struct can_msg sent[3] = {{.id = 0x581}, {.id = 0x601}, {.id = 0x5FF}};
    struct can_msg got[CAN_SOCKET_BATCH];
    TEST_ASSERT_EQUAL(0, can_socket_filter(&members[1], &only, 1));
    TEST_ASSERT_EQUAL(3, can_socket_send_many(&members[0], sent, 3));
    TEST_ASSERT_EQUAL(3, receive(&members[2], got, 3));
    TEST_ASSERT_EQUAL(2, receive(&members[1], got, 2));
    TEST_ASSERT_EQUAL(0x581, got[0].id);
    TEST_ASSERT_EQUAL(0x5FF, got[1].id);
    TEST_ASSERT_EQUAL(0, waiting(&members[1]));
}

static void test_one_leaves_and_the_others_go_on(void)
{
    const struct can_msg sent = {.id = 0x123};
    struct can_msg got[CAN_SOCKET_BATCH];
    can_socket_close(&members[0]);
    TEST_ASSERT_EQUAL(0, can_socket_send(&members[2], &sent));
    TEST_ASSERT_EQUAL(1, receive(&members[1], got, 1));
    hub_thread_end();
    TEST_ASSERT_EQUAL(0, hub_thread_hub.lost);
}

/* One member does not read: the others miss nothing, and what it loses is counted. */
static void test_what_a_full_member_loses_is_counted(void)
{
    enum { BATCHES = 1500 };
    struct can_msg sent[CAN_SOCKET_BATCH];
    struct can_msg got[CAN_SOCKET_BATCH];
    uint64_t taken = 0;
    int count = 0;
    memset(sent, 0, sizeof sent);
    for (int i = 0; i < BATCHES; ++i) {
        TEST_ASSERT_EQUAL(CAN_SOCKET_BATCH,
                          can_socket_send_many(&members[0], sent, CAN_SOCKET_BATCH));
        TEST_ASSERT_EQUAL(CAN_SOCKET_BATCH, receive(&members[2], got, CAN_SOCKET_BATCH));
    }
    hub_thread_end();
    while ((count = waiting(&members[1])) > 0) {
        taken += (uint64_t)count;
    }
    TEST_ASSERT_GREATER_THAN(0, hub_thread_hub.lost);
    TEST_ASSERT_EQUAL_UINT64((uint64_t)BATCHES * CAN_SOCKET_BATCH, taken + hub_thread_hub.lost);
}

/* A process that sends a frame of more than 8 bytes is none of ours: its connection ends, and nobody gets the frame. */
static void test_a_frame_of_nine_bytes_ends_the_connection(void)
{
    const struct can_frame wrong = {.can_id = 0x123, .can_dlc = CAN_MAX_DLEN + 1u};
    const struct can_msg right = {.id = 0x124};
    struct can_msg got[CAN_SOCKET_BATCH] = {{.id = 0}};
    TEST_ASSERT_EQUAL((int)sizeof wrong, write(members[0].fd, &wrong, sizeof wrong));
    TEST_ASSERT_EQUAL(0, can_socket_send(&members[1], &right));
    TEST_ASSERT_EQUAL(1, receive(&members[2], got, 1));
    TEST_ASSERT_EQUAL_HEX32(0x124, got[0].id);
    TEST_ASSERT_EQUAL(-ENETDOWN, receive(&members[0], got, 2));
}

static void test_buses_are_apart(void)
{
    const struct can_msg sent = {.id = 0x123};
    struct can_msg got[CAN_SOCKET_BATCH];
    struct can_socket other;
    char reason[128];
    TEST_ASSERT_EQUAL(0, can_socket_open(&other, hub_thread_paths[1], reason, sizeof reason));
    TEST_ASSERT_EQUAL(0, can_socket_send(&members[0], &sent));
    TEST_ASSERT_EQUAL(1, receive(&members[1], got, 1));
    TEST_ASSERT_EQUAL(0, waiting(&other));
    can_socket_close(&other);
}

static void test_the_end_is_noticed(void)
{
    struct can_msg got[CAN_SOCKET_BATCH];
    hub_thread_end();
    TEST_ASSERT_EQUAL(-ENETDOWN, receive(&members[1], got, 1));
}

static void test_nobody_serves(void)
{
    char reason[128];
    struct can_socket lonely;
    TEST_ASSERT_EQUAL(-ENOENT, can_socket_open(&lonely, "/tmp/no/such/bus", reason, sizeof reason));
    TEST_ASSERT_NOT_NULL(strstr(reason, "hodograph-hub"));
}

static void test_the_path_is_taken(void)
{
    static struct hub second;
    char unused[64]; /* of this process, since two runs of the tests may meet */
    (void)snprintf(unused, sizeof unused, "/tmp/hodograph-test-hub-%ld-free", (long)getpid());
    const char *paths[2] = {unused, hub_thread_paths[0]};
    size_t failed = 0;
    TEST_ASSERT_EQUAL(-EADDRINUSE, hub_open(&second, paths, 2, (struct hub_options){0}, &failed));
    TEST_ASSERT_EQUAL_size_t(1, failed);
    paths[1] = "/tmp/no/such/folder/bus";
    hub_close(&second);
    (void)unlink(paths[0]);
    TEST_ASSERT_EQUAL(-ENOENT, hub_open(&second, paths, 2, (struct hub_options){0}, &failed));
    hub_close(&second);
    (void)unlink(paths[0]);
}

static char left[64]; /* the path of a hub that was killed */

static void name_left(void)
{
    (void)snprintf(left, sizeof left, "/tmp/hodograph-test-hub-%ld-left", (long)getpid());
}

/* As a hub leaves it that is killed. */
static void leave_socket(const char *path)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    (void)snprintf(address.sun_path, sizeof address.sun_path, "%s", path);
    (void)unlink(path);
    const int fd = socket(AF_UNIX, SOCK_SEQPACKET, 0);
    TEST_ASSERT_TRUE(fd >= 0);
    TEST_ASSERT_EQUAL(0, bind(fd, (const struct sockaddr *)&address, sizeof address));
    (void)close(fd);
}

/* Killed while it served, and before it served. */
static void test_paths_of_killed_hubs_are_served_again(void)
{
    static struct hub second;
    const char *paths[1] = {left};
    char own[sizeof left + 4u];
    size_t failed = 0;
    name_left();
    (void)snprintf(own, sizeof own, "%s.new", left);
    leave_socket(left);
    leave_socket(own);
    TEST_ASSERT_EQUAL(0, hub_open(&second, paths, 1, (struct hub_options){0}, &failed));
    TEST_ASSERT_NOT_EQUAL(0, access(own, F_OK));
    hub_close(&second);
    (void)unlink(left);
    TEST_ASSERT_EQUAL(0, mkdir(left, 0700)); /* no socket: it stays, and no other file is left */
    TEST_ASSERT_EQUAL(-EADDRINUSE, hub_open(&second, paths, 1, (struct hub_options){0}, &failed));
    TEST_ASSERT_NOT_EQUAL(0, access(own, F_OK));
    TEST_ASSERT_EQUAL(0, rmdir(left));
}

struct starter {
    struct hub hub;
    int code;
};

static void *start_hub(void *starter)
{
    const char *paths[1] = {left};
    size_t failed = 0;
    struct starter *own = starter;
    own->code = hub_open(&own->hub, paths, 1, (struct hub_options){0}, &failed);
    return NULL;
}

static void test_one_of_two_hubs_gets_a_path_that_was_left(void)
{
    static struct starter starters[2];
    name_left();
    for (int round = 0; round < 200; ++round) {
        pthread_t threads[2];
        leave_socket(left);
        for (int i = 0; i < 2; ++i) {
            TEST_ASSERT_EQUAL(0, pthread_create(&threads[i], NULL, start_hub, &starters[i]));
        }
        for (int i = 0; i < 2; ++i) {
            TEST_ASSERT_EQUAL(0, pthread_join(threads[i], NULL));
        }
        TEST_ASSERT_EQUAL(-EADDRINUSE, starters[0].code + starters[1].code);
        hub_close(&starters[0].hub);
        hub_close(&starters[1].hub);
    }
    (void)unlink(left);
}

static void test_real_time_is_the_clock_of_the_system(void)
{
    TEST_ASSERT_EQUAL(0, clock_join(hub_thread_paths[0], "test"));
    TEST_ASSERT_FALSE(clock_is_virtual());
    TEST_ASSERT_EQUAL_UINT32(0, clock_participant());
    TEST_ASSERT_EQUAL(0, clock_join("vcan0", "test")); /* a network interface has no virtual time */
    TEST_ASSERT_FALSE(clock_is_virtual());
    TEST_ASSERT_EQUAL(-ENOENT, clock_join("/tmp/no/such/bus", "test"));
    const uint64_t before_ns = clock_ns();
    TEST_ASSERT_EQUAL(0, clock_poll(NULL, 0, 0, 2000000));
    TEST_ASSERT_GREATER_OR_EQUAL_UINT64(before_ns + 2000000u, clock_ns());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_frames_reach_all_others_in_order);
    RUN_TEST(test_filters_are_those_of_the_socket);
    RUN_TEST(test_one_leaves_and_the_others_go_on);
    RUN_TEST(test_what_a_full_member_loses_is_counted);
    RUN_TEST(test_a_frame_of_nine_bytes_ends_the_connection);
    RUN_TEST(test_buses_are_apart);
    RUN_TEST(test_the_end_is_noticed);
    RUN_TEST(test_nobody_serves);
    RUN_TEST(test_the_path_is_taken);
    RUN_TEST(test_paths_of_killed_hubs_are_served_again);
    RUN_TEST(test_one_of_two_hubs_gets_a_path_that_was_left);
    RUN_TEST(test_real_time_is_the_clock_of_the_system);
    return UNITY_END();
}
