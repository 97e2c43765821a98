/* SPDX-License-Identifier: MIT */
/* Tests the hub in virtual time. One participant uses clock.h; the others send protocol messages directly. Run by
 * `make unit`; starts a hub in a thread, and opens sockets in /tmp. */
#define _GNU_SOURCE
#include <errno.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include "hub/frame_bits.h"
#include "hub_thread.h"
#include "port/linux/can_socket.h"
#include "port/linux/clock.h"
#include "port/linux/local_connection.h"
#include "unity.h"

#define BITRATE 500000u
#define BIT_NS  2000u

/* Another participant, with a member on the first bus. */
struct other {
    int fd;
    int member;
    uint32_t number;
    uint32_t grant;
};

static struct can_socket mine;
static struct other other;

static int open_connection(uint16_t kind, uint32_t number, const char *name,
                           struct local_bus_control *welcome)
{
    struct local_bus_control hello = {.mark = LOCAL_BUS_MARK,
                                      .version = LOCAL_BUS_VERSION,
                                      .kind = kind,
                                      .flags = LOCAL_BUS_NOTICES,
                                      .number = number};
    memcpy(hello.name, name, strlen(name));
    const int fd = local_connection_open(hub_thread_paths[0], &hello, welcome);
    TEST_ASSERT_GREATER_OR_EQUAL(0, fd);
    return fd;
}

static void say_wait(const struct other *who, uint64_t until_ns)
{
    const struct local_bus_control wait = {.mark = LOCAL_BUS_MARK,
                                           .version = LOCAL_BUS_VERSION,
                                           .kind = LOCAL_BUS_WAIT,
                                           .flags = LOCAL_BUS_SENT,
                                           .number = who->grant,
                                           .time_ns = until_ns};
    TEST_ASSERT_EQUAL(sizeof wait, send(who->fd, &wait, sizeof wait, 0));
}

static struct local_bus_control next_message(const struct other *who)
{
    struct local_bus_control got;
    struct pollfd wait = {.fd = who->fd, .events = POLLIN};
    TEST_ASSERT_EQUAL(1, poll(&wait, 1, -1));
    TEST_ASSERT_EQUAL(sizeof got, recv(who->fd, &got, sizeof got, 0));
    return got;
}

static void send_frame(const struct other *who, uint32_t id, uint8_t length)
{
    const struct can_frame frame = {.can_id = id, .can_dlc = length};
    TEST_ASSERT_EQUAL(sizeof frame, send(who->member, &frame, sizeof frame, 0));
}

/* One that no test sends: so the other is woken by none of ours. */
static void want_no_frames(const struct other *who)
{
    const struct can_filter none = {0x7FF, 0x7FF};
    struct local_bus_filters reported = {
        .mark = LOCAL_BUS_MARK, .kind = LOCAL_BUS_FILTER, .count = 1};
    const size_t size = offsetof(struct local_bus_filters, filters) + sizeof none;
    reported.filters[0] = none;
    TEST_ASSERT_EQUAL(size, send(who->member, &reported, size, 0));
}

static uint64_t frame_ns(uint32_t id, uint8_t length)
{
    const struct can_frame frame = {.can_id = id, .can_dlc = length};
    return (uint64_t)frame_bits(&frame) * BIT_NS;
}

void setUp(void)
{
    char reason[128];
    struct local_bus_control welcome;
    hub_thread_begin((struct hub_options){.is_virtual = true, .bitrate = BITRATE});
    TEST_ASSERT_EQUAL(0, unsetenv(LOCAL_BUS_NAME_VARIABLE));
    TEST_ASSERT_EQUAL(0, clock_join(hub_thread_paths[0], "mine"));
    TEST_ASSERT_TRUE(clock_is_virtual());
    TEST_ASSERT_EQUAL(0, can_socket_open(&mine, hub_thread_paths[0], reason, sizeof reason));
    memset(&other, 0, sizeof other);
    other.fd = open_connection(LOCAL_BUS_HELLO_PARTICIPANT, 0, "other", &welcome);
    TEST_ASSERT_EQUAL(LOCAL_BUS_VIRTUAL, welcome.flags & LOCAL_BUS_VIRTUAL);
    other.number = welcome.number;
    other.member = open_connection(LOCAL_BUS_HELLO_MEMBER, other.number, "", &welcome);
    want_no_frames(&other);
}

void tearDown(void)
{
    can_socket_close(&mine);
    clock_leave();
    (void)close(other.fd);
    (void)close(other.member);
    hub_thread_end();
}

static int receive(struct can_msg messages[CAN_SOCKET_BATCH])
{
    int more = 0;
    return can_socket_receive(&mine, messages, &more);
}

/* Receives all frames of the bus, and wakes nobody. */
static struct can_socket open_listener(void)
{
    struct can_socket listener;
    char reason[128];
    TEST_ASSERT_EQUAL(0, can_socket_open(&listener, hub_thread_paths[0], reason, sizeof reason));
    return listener;
}

/* The four frames that came within 10 ms; closes the listener. */
static void take_four(struct can_socket *listener, struct can_msg got[CAN_SOCKET_BATCH])
{
    int more = 0;
    while (clock_ns() < VIRTUAL_TIME_BEGIN_NS + 10000000u) {
        TEST_ASSERT_GREATER_OR_EQUAL(0, clock_poll(NULL, 0, 0, 10000000));
    }
    TEST_ASSERT_EQUAL(4, can_socket_receive(listener, got, &more));
    can_socket_close(listener);
}

static void test_time_passes_as_requested_and_not_otherwise(void)
{
    const uint64_t begin_ns = clock_ns();
    TEST_ASSERT_EQUAL_UINT64(VIRTUAL_TIME_BEGIN_NS, begin_ns);
    (void)usleep(2000);
    TEST_ASSERT_EQUAL_UINT64(begin_ns, clock_ns());
    say_wait(&other, LOCAL_BUS_NEVER);
    TEST_ASSERT_EQUAL(0, clock_poll(NULL, 0, 0, 3600ull * CLOCK_NS_PER_S)); /* an hour at once */
    TEST_ASSERT_EQUAL_UINT64(begin_ns + 3600ull * CLOCK_NS_PER_S, clock_ns());
}

static void test_a_frame_takes_its_bits_and_wakes(void)
{
    struct pollfd fds = {.fd = mine.fd, .events = POLLIN};
    struct can_msg got[CAN_SOCKET_BATCH];
    const uint64_t begin_ns = clock_ns();
    send_frame(&other, 0x123, 8);
    say_wait(&other, LOCAL_BUS_NEVER);
    TEST_ASSERT_EQUAL(1, clock_poll(&fds, 1, 1, CLOCK_NEVER));
    TEST_ASSERT_EQUAL(POLLIN, fds.revents);
    TEST_ASSERT_EQUAL_UINT64(begin_ns + frame_ns(0x123, 8), clock_ns());
    TEST_ASSERT_EQUAL(1, receive(got));
    TEST_ASSERT_EQUAL(0x123, got[0].id);
}

static void test_the_lowest_identifier_goes_first_and_equal_ones_keep_their_order(void)
{
    struct can_msg got[CAN_SOCKET_BATCH];
    const struct can_msg low = {.id = 0x080, .len = 1};
    struct can_socket listener = open_listener();
    send_frame(&other, 0x300, 0);
    send_frame(&other, 0x001, 0);
    send_frame(&other, 0x300, 1);
    TEST_ASSERT_EQUAL(0, can_socket_send(&mine, &low));
    say_wait(&other, LOCAL_BUS_NEVER);
    TEST_ASSERT_EQUAL(0, clock_poll(NULL, 0, 0, CLOCK_NS_PER_S) < 0);
    take_four(&listener, got);
    TEST_ASSERT_EQUAL(0x001, got[0].id);
    TEST_ASSERT_EQUAL(0x080, got[1].id);
    TEST_ASSERT_EQUAL(0x300, got[2].id);
    TEST_ASSERT_EQUAL(0, got[2].len);
    TEST_ASSERT_EQUAL(0x300, got[3].id);
    TEST_ASSERT_EQUAL(1, got[3].len);
}

/* So two that answer each other at once leave room for the others. */
static void test_an_answer_comes_after_waiting_frames(void)
{
    struct pollfd fds = {.fd = mine.fd, .events = POLLIN};
    struct can_msg got[CAN_SOCKET_BATCH];
    const struct can_msg answer = {.id = 0x080, .len = 1};
    struct can_socket listener = open_listener();
    send_frame(&other, 0x300, 0);
    send_frame(&other, 0x301, 0);
    send_frame(&other, 0x302, 0);
    say_wait(&other, LOCAL_BUS_NEVER);
    TEST_ASSERT_EQUAL(1, clock_poll(&fds, 1, 1, CLOCK_NEVER));
    TEST_ASSERT_EQUAL(0, can_socket_send(&mine, &answer));
    take_four(&listener, got);
    TEST_ASSERT_EQUAL(0x300, got[0].id);
    TEST_ASSERT_EQUAL(0x301, got[1].id);
    TEST_ASSERT_EQUAL(0x080, got[2].id);
    TEST_ASSERT_EQUAL(0x302, got[3].id);
}

/* What a connection of no participant, as a recorder's, finds in its socket: the sum of the frames, each packet not too
 * long. */
static int frames_in(int fd)
{
    struct local_bus_frame packet[LOCAL_BUS_PACKET + 1u];
    int count = 0;
    for (ssize_t size = 1; size > 0;) {
        size = recv(fd, packet, sizeof packet, MSG_DONTWAIT);
        TEST_ASSERT_LESS_OR_EQUAL((ssize_t)(LOCAL_BUS_PACKET * sizeof packet[0]), size);
        for (size_t i = 0; size > 0 && i < (size_t)size / sizeof packet[0]; ++i) {
            TEST_ASSERT_EQUAL(0x100 + count, packet[i].frame.can_id);
            count++;
        }
    }
    return count;
}

static void test_many_frames_come_in_packets_and_in_order(void)
{
    enum { FRAMES = 2 * CAN_SOCKET_BATCH + 3 };
    struct local_bus_control welcome;
    struct can_msg got[CAN_SOCKET_BATCH];
    const int recorder = open_connection(LOCAL_BUS_HELLO_MEMBER, 0, "", &welcome);
    const struct can_match all = {0x000, 0x000};
    int more = 1;
    int count = 0;
    TEST_ASSERT_EQUAL(0, can_socket_defer(&mine, &all, 1));
    for (uint32_t i = 0; i < FRAMES; ++i) {
        send_frame(&other, 0x100 + i, 0);
    }
    say_wait(&other, LOCAL_BUS_NEVER);
    while (clock_ns() < VIRTUAL_TIME_BEGIN_NS + CLOCK_NS_PER_S) {
        TEST_ASSERT_GREATER_OR_EQUAL(0, clock_poll(NULL, 0, 0, CLOCK_NS_PER_S));
    }
    while (more != 0) {
        const int some = can_socket_receive(&mine, got, &more);
        for (int i = 0; i < some; ++i) {
            TEST_ASSERT_EQUAL(0x100 + count + i, got[i].id);
        }
        count += some;
    }
    TEST_ASSERT_EQUAL(FRAMES, count);
    hub_thread_end();
    TEST_ASSERT_EQUAL(FRAMES, frames_in(recorder));
    (void)close(recorder);
}

/* Of the hub to the members of a participant: room for a few packets only. */
static void make_little_room(uint32_t number)
{
    const int bytes = 1;
    for (size_t i = 0; i < HUB_CONNECTIONS; ++i) {
        const struct hub_connection *each = &hub_thread_hub.connections[i];
        if (each->fd >= 0 && each->role == HUB_MEMBER && each->number == number) {
            TEST_ASSERT_EQUAL(0, setsockopt(each->fd, SOL_SOCKET, SO_SNDBUF, &bytes, sizeof bytes));
        }
    }
}

static void suspend_or_continue(enum local_bus_kind kind, const char *name)
{
    struct local_bus_control control = {
        .mark = LOCAL_BUS_MARK, .version = LOCAL_BUS_VERSION, .kind = (uint16_t)kind};
    memcpy(control.name, name, strlen(name));
    TEST_ASSERT_EQUAL(sizeof control, send(other.fd, &control, sizeof control, 0));
}

/* Of the kind; notices of other kinds may come before it. */
static struct local_bus_control next_of_kind(const struct other *who, uint16_t kind)
{
    struct local_bus_control got = next_message(who);
    while (got.kind != kind) {
        got = next_message(who);
    }
    return got;
}

/* The other sends so many frames, and waits until an instant at which the last one has gone. */
static void send_and_wait(uint32_t count, uint64_t until_ns)
{
    for (uint32_t i = 0; i < count; ++i) {
        send_frame(&other, 0x100, (uint8_t)(i % 8u));
    }
    say_wait(&other, until_ns);
    other.grant = next_of_kind(&other, LOCAL_BUS_GRANT).number;
}

static struct other open_sleeper(void)
{
    struct local_bus_control welcome;
    struct other sleeper = {.grant = 0};
    sleeper.fd = open_connection(LOCAL_BUS_HELLO_PARTICIPANT, 0, "sleeper", &welcome);
    sleeper.number = welcome.number;
    sleeper.member = open_connection(LOCAL_BUS_HELLO_MEMBER, sleeper.number, "", &welcome);
    return sleeper;
}

/* It empties its full socket only after the grant: so the grant may not wait for room. */
static void test_one_that_slept_beside_a_busy_bus_gets_its_grant(void)
{
    struct local_bus_frame packet[LOCAL_BUS_PACKET];
    const struct other sleeper = open_sleeper();
    make_little_room(sleeper.number);
    clock_leave();
    suspend_or_continue(LOCAL_BUS_SUSPEND, "sleeper");
    say_wait(&sleeper, LOCAL_BUS_NEVER);
    for (uint64_t i = 1; i <= HUB_HELD / 1000u + 1u; ++i) {
        send_and_wait(1000, VIRTUAL_TIME_BEGIN_NS + i * CLOCK_NS_PER_S);
    }
    suspend_or_continue(LOCAL_BUS_CONTINUE, "sleeper");
    say_wait(&other, LOCAL_BUS_NEVER);
    TEST_ASSERT_EQUAL(LOCAL_BUS_FRAMES, next_of_kind(&sleeper, LOCAL_BUS_GRANT).flags);
    TEST_ASSERT_EQUAL(sizeof packet, recv(sleeper.member, packet, sizeof packet, MSG_DONTWAIT));
    for (uint8_t i = 0; i < LOCAL_BUS_PACKET; ++i) {
        TEST_ASSERT_EQUAL(i, packet[i].frame.can_dlc);
    }
    TEST_ASSERT_EQUAL(0, hub_thread_hub.lost); /* it was suspended */
    (void)close(sleeper.fd);
    (void)close(sleeper.member);
}

/* Nobody else ends its wait: so it is woken before there is no room any more. */
static void test_frames_that_wake_nobody_are_not_lost_however_many(void)
{
    const struct can_match all = {0x000, 0x000};
    struct pollfd fds = {.fd = mine.fd, .events = POLLIN};
    struct can_msg got[CAN_SOCKET_BATCH];
    uint32_t count = 0;
    TEST_ASSERT_EQUAL(0, can_socket_defer(&mine, &all, 1));
    for (uint32_t i = 0; i < HUB_QUEUE; ++i) {
        send_frame(&other, i, 0);
    }
    say_wait(&other, LOCAL_BUS_NEVER);
    while (count < HUB_HELD / 2u) {
        int more = 1;
        TEST_ASSERT_EQUAL(1, clock_poll(&fds, 1, 1, CLOCK_NEVER));
        while (more != 0) {
            const int some = can_socket_receive(&mine, got, &more);
            for (int i = 0; i < some; ++i) {
                TEST_ASSERT_EQUAL(count++, got[i].id);
            }
        }
    }
    TEST_ASSERT_EQUAL(0, hub_thread_hub.lost);
}

static void test_filters_and_deferred_frames_do_not_wake(void)
{
    const struct can_match wanted[2] = {{0x100, 0x7FF}, {0x200, 0x7FF}};
    const struct can_match deferred = {0x100, 0x7FF};
    struct pollfd fds = {.fd = mine.fd, .events = POLLIN};
    struct can_msg got[CAN_SOCKET_BATCH];
    const uint64_t begin_ns = clock_ns();
    TEST_ASSERT_EQUAL(0, can_socket_filter(&mine, wanted, 2));
    TEST_ASSERT_EQUAL(0, can_socket_defer(&mine, &deferred, 1));
    say_wait(&other, LOCAL_BUS_NEVER);
    TEST_ASSERT_EQUAL(0, clock_poll(&fds, 1, 1, 500000)); /* the hub takes the filters */
    const uint64_t sent_ns = clock_ns();
    TEST_ASSERT_EQUAL_UINT64(begin_ns + 500000u, sent_ns);
    send_frame(&other, 0x555, 0);
    send_frame(&other, 0x100, 0);
    send_frame(&other, 0x200, 0);
    say_wait(&other, LOCAL_BUS_NEVER);
    TEST_ASSERT_EQUAL(1, clock_poll(&fds, 1, 1, CLOCK_NEVER));
    TEST_ASSERT_EQUAL_UINT64(sent_ns + frame_ns(0x100, 0) + frame_ns(0x200, 0), clock_ns());
    TEST_ASSERT_EQUAL(2, receive(got));
    TEST_ASSERT_EQUAL(0x100, got[0].id);
    TEST_ASSERT_EQUAL(0x200, got[1].id);
}

static void test_deferred_frames_wake_one_that_waits_for_all(void)
{
    const struct can_match all = {0x000, 0x000};
    struct pollfd fds = {.fd = mine.fd, .events = POLLIN};
    struct can_msg got[CAN_SOCKET_BATCH];
    const uint64_t begin_ns = clock_ns();
    const uint64_t one_ns = frame_ns(0x100, 0);
    TEST_ASSERT_EQUAL(0, can_socket_defer(&mine, &all, 1));
    send_frame(&other, 0x100, 0);
    send_frame(&other, 0x100, 0);
    send_frame(&other, 0x100, 0);
    say_wait(&other, LOCAL_BUS_NEVER);
    TEST_ASSERT_EQUAL(1, clock_poll(&fds, 1, 1, one_ns + 1u));
    TEST_ASSERT_EQUAL_UINT64(begin_ns + one_ns + 1u, clock_ns());
    TEST_ASSERT_EQUAL(1, receive(got));
    TEST_ASSERT_EQUAL_UINT64(begin_ns + one_ns, mine.stamps_ns[0]);
    clock_wake_for_all(true);
    TEST_ASSERT_EQUAL(1, clock_poll(&fds, 1, 1, CLOCK_NEVER));
    TEST_ASSERT_EQUAL_UINT64(begin_ns + 2u * one_ns, clock_ns());
    clock_wake_for_all(false);
    TEST_ASSERT_EQUAL(1, clock_poll(&fds, 1, 1, 2u * one_ns));
    TEST_ASSERT_EQUAL_UINT64(begin_ns + 4u * one_ns, clock_ns());
}

static void test_what_a_member_sent_before_it_left_goes_out(void)
{
    struct pollfd fds = {.fd = mine.fd, .events = POLLIN};
    struct can_msg got[CAN_SOCKET_BATCH];
    send_frame(&other, 0x123, 0);
    send_frame(&other, 0x124, 0);
    say_wait(&other, LOCAL_BUS_NEVER);
    (void)close(other.member);
    (void)close(other.fd);
    other.fd = other.member = -1;
    TEST_ASSERT_EQUAL(1, clock_poll(&fds, 1, 1, CLOCK_NEVER));
    TEST_ASSERT_EQUAL(1, receive(got));
    TEST_ASSERT_EQUAL(1, clock_poll(&fds, 1, 1, CLOCK_NEVER));
    TEST_ASSERT_EQUAL(1, receive(got));
    TEST_ASSERT_EQUAL(0x124, got[0].id);
}

/* It ends as soon as it has sent, as a process does at its end: without a wait. */
static void test_what_a_participant_sent_before_it_left_is_on_the_bus_at_once(void)
{
    struct pollfd fds = {.fd = mine.fd, .events = POLLIN};
    struct can_msg got[CAN_SOCKET_BATCH];
    const struct can_msg later = {.id = 0x200};
    TEST_ASSERT_EQUAL(0, can_socket_send(&mine, &later));
    send_frame(&other, 0x100, 0);
    (void)close(other.fd);
    other.fd = -1;
    TEST_ASSERT_EQUAL(1, clock_poll(&fds, 1, 1, CLOCK_NEVER));
    TEST_ASSERT_EQUAL_UINT64(VIRTUAL_TIME_BEGIN_NS + frame_ns(0x100, 0), clock_ns());
    TEST_ASSERT_EQUAL(1, receive(got));
    TEST_ASSERT_EQUAL(0x100, got[0].id);
}

/* Frames that wait are announced at their last bit; that wakes nobody. */
static void test_tracked_frames_are_waited_for_until_their_last_bit(void)
{
    struct can_msg got[CAN_SOCKET_BATCH];
    struct pollfd fds = {.fd = mine.fd, .events = POLLIN};
    const struct can_msg setpoint = {.id = 0x202};
    const struct can_msg other_kind = {.id = 0x300};
    say_wait(&other, LOCAL_BUS_NEVER);
    TEST_ASSERT_EQUAL(0, can_socket_track(&mine, 0x202));
    TEST_ASSERT_EQUAL(0, can_socket_track(&mine, 0x202));
    TEST_ASSERT_EQUAL(0, can_socket_send(&mine, &setpoint));
    TEST_ASSERT_EQUAL(0, can_socket_send(&mine, &setpoint));
    TEST_ASSERT_EQUAL(0, can_socket_send(&mine, &other_kind));
    TEST_ASSERT_EQUAL(2, can_socket_waiting(&mine));
    const uint64_t one_ns = frame_ns(0x202, 0);
    TEST_ASSERT_EQUAL(0, clock_poll(&fds, 1, 1, one_ns - 1u));
    TEST_ASSERT_EQUAL(0, receive(got));
    TEST_ASSERT_EQUAL(2, can_socket_waiting(&mine));
    TEST_ASSERT_EQUAL(1, clock_poll(&fds, 1, 1, one_ns)); /* in the middle of the second */
    TEST_ASSERT_EQUAL_UINT64(VIRTUAL_TIME_BEGIN_NS + 2u * one_ns - 1u, clock_ns());
    TEST_ASSERT_EQUAL(0, receive(got));
    TEST_ASSERT_EQUAL(1, can_socket_waiting(&mine));
    TEST_ASSERT_EQUAL(1, clock_poll(&fds, 1, 1, 1));
    TEST_ASSERT_EQUAL(0, receive(got));
    TEST_ASSERT_EQUAL(0, can_socket_waiting(&mine));
}

static void test_no_more_frames_are_tracked_than_there_is_room_for(void)
{
    for (uint16_t i = 0; i < CAN_SOCKET_TRACKED; ++i) {
        TEST_ASSERT_EQUAL(0, can_socket_track(&mine, (uint16_t)(0x200u + i)));
    }
    TEST_ASSERT_EQUAL(-ENOSPC, can_socket_track(&mine, 0x300));
    TEST_ASSERT_EQUAL(-ENOSPC, can_socket_track(&mine, 0x200));
    can_socket_untrack(&mine, 0x201);
    can_socket_untrack(&mine, 0x201); /* there is no other */
    TEST_ASSERT_EQUAL(CAN_SOCKET_TRACKED - 1u, can_socket_waiting(&mine));
    can_socket_forget(&mine);
    TEST_ASSERT_EQUAL(0, can_socket_waiting(&mine));
}

static void test_a_descriptor_of_ones_own_ends_the_wait_at_once(void)
{
    struct pollfd fds = {.fd = eventfd(1, 0), .events = POLLIN};
    const uint64_t begin_ns = clock_ns();
    say_wait(&other, LOCAL_BUS_NEVER);
    TEST_ASSERT_EQUAL(1, clock_poll(&fds, 0, 1, CLOCK_NEVER));
    TEST_ASSERT_EQUAL(POLLIN, fds.revents);
    TEST_ASSERT_EQUAL_UINT64(begin_ns, clock_ns());
    (void)close(fds.fd);
    const struct local_bus_control reported = next_message(&other);
    TEST_ASSERT_EQUAL(LOCAL_BUS_INTERRUPTED, reported.kind);
    TEST_ASSERT_EQUAL_STRING("mine", reported.name);
}

static volatile sig_atomic_t alarms;

static void on_alarm(int number)
{
    (void)number;
    alarms++;
}

static void test_a_signal_ends_the_wait(void)
{
    const struct itimerval soon = {.it_value = {.tv_usec = 5000}, .it_interval = {.tv_usec = 5000}};
    const struct itimerval never = {.it_value = {.tv_usec = 0}};
    struct sigaction action = {.sa_handler = on_alarm};
    TEST_ASSERT_EQUAL(0, sigaction(SIGALRM, &action, NULL));
    TEST_ASSERT_EQUAL(0, setitimer(ITIMER_REAL, &soon, NULL));
    say_wait(&other, LOCAL_BUS_NEVER);
    TEST_ASSERT_EQUAL(0, clock_poll(NULL, 0, 0, CLOCK_NEVER)); /* else it would wait for ever */
    TEST_ASSERT_EQUAL(0, setitimer(ITIMER_REAL, &never, NULL));
    TEST_ASSERT_GREATER_THAN(0, alarms);
}

static void test_a_signal_before_the_wait_ends_it_too(void)
{
    const uint64_t begin_ns = clock_ns();
    say_wait(&other, LOCAL_BUS_NEVER);
    clock_note_signal();
    TEST_ASSERT_EQUAL(0, clock_poll(NULL, 0, 0, CLOCK_NEVER)); /* else it would wait for ever */
    TEST_ASSERT_EQUAL_UINT64(begin_ns, clock_ns());
    TEST_ASSERT_EQUAL(LOCAL_BUS_INTERRUPTED, next_message(&other).kind);
    say_wait(&other, LOCAL_BUS_NEVER);
    TEST_ASSERT_EQUAL(0, clock_poll(NULL, 0, 0, 1000)); /* once only */
    TEST_ASSERT_EQUAL_UINT64(begin_ns + 1000u, clock_ns());
}

static void test_the_others_are_notified_who_leaves(void)
{
    say_wait(&other, LOCAL_BUS_NEVER);
    clock_leave();
    TEST_ASSERT_FALSE(clock_is_virtual());
    const struct local_bus_control left = next_message(&other);
    TEST_ASSERT_EQUAL(LOCAL_BUS_LEFT, left.kind);
    TEST_ASSERT_EQUAL_STRING("mine", left.name);
    const struct local_bus_control woken = next_message(&other); /* so that it can act on it */
    TEST_ASSERT_EQUAL(LOCAL_BUS_GRANT, woken.kind);
    TEST_ASSERT_EQUAL_UINT64(VIRTUAL_TIME_BEGIN_NS, woken.time_ns);
}

static void test_the_end_of_the_hub_is_noticed(void)
{
    hub_thread_end();
    TEST_ASSERT_EQUAL(-ENETDOWN, clock_poll(NULL, 0, 0, 1000));
}

static void test_another_version_is_refused(void)
{
    const struct local_bus_control hello = {
        .mark = LOCAL_BUS_MARK, .version = LOCAL_BUS_VERSION + 1u, .kind = LOCAL_BUS_HELLO_MEMBER};
    struct local_bus_control welcome;
    TEST_ASSERT_EQUAL(-EPROTO, local_connection_open(hub_thread_paths[0], &hello, &welcome));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_time_passes_as_requested_and_not_otherwise);
    RUN_TEST(test_a_frame_takes_its_bits_and_wakes);
    RUN_TEST(test_the_lowest_identifier_goes_first_and_equal_ones_keep_their_order);
    RUN_TEST(test_an_answer_comes_after_waiting_frames);
    RUN_TEST(test_many_frames_come_in_packets_and_in_order);
    RUN_TEST(test_one_that_slept_beside_a_busy_bus_gets_its_grant);
    RUN_TEST(test_frames_that_wake_nobody_are_not_lost_however_many);
    RUN_TEST(test_filters_and_deferred_frames_do_not_wake);
    RUN_TEST(test_deferred_frames_wake_one_that_waits_for_all);
    RUN_TEST(test_what_a_member_sent_before_it_left_goes_out);
    RUN_TEST(test_what_a_participant_sent_before_it_left_is_on_the_bus_at_once);
    RUN_TEST(test_tracked_frames_are_waited_for_until_their_last_bit);
    RUN_TEST(test_no_more_frames_are_tracked_than_there_is_room_for);
    RUN_TEST(test_a_descriptor_of_ones_own_ends_the_wait_at_once);
    RUN_TEST(test_a_signal_ends_the_wait);
    RUN_TEST(test_a_signal_before_the_wait_ends_it_too);
    RUN_TEST(test_the_others_are_notified_who_leaves);
    RUN_TEST(test_the_end_of_the_hub_is_noticed);
    RUN_TEST(test_another_version_is_refused);
    return UNITY_END();
}
