/* SPDX-License-Identifier: MIT */
/* The Linux port on SocketCAN: when the frames of a tick have been sent. The kernel, the clock and the interrupts
 * are stood in for here; every test is linked with fake_port, so the functions of port.h are compiled under other
 * names. Run by `make unit`; no I/O. */
#define _GNU_SOURCE
#include <errno.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "unity.h"

#define SYSTEM_FRAMES 64u

static struct {
    struct mmsghdr_frame {
        uint32_t id;
        int flags; /* MSG_CONFIRM: ours, given back */
    } given[SYSTEM_FRAMES];
    unsigned given_count;
    unsigned written;
    int refuses; /* errno of write(), 0: takes */
    bool no_receipts;
    bool in_tick;
    bool virtual_time;
    uint64_t now_ns;
} kernel;

/* ---- The kernel ---- */

static ssize_t kernel_write(int fd, const void *data, size_t size)
{
    (void)fd;
    (void)data;
    if (kernel.refuses != 0) {
        errno = kernel.refuses;
        return -1;
    }
    kernel.written++;
    return (ssize_t)size;
}

static int kernel_setsockopt(int fd, int level, int name, const void *value, socklen_t size)
{
    (void)fd;
    (void)level;
    (void)name;
    (void)value;
    (void)size;
    errno = ENOPROTOOPT;
    return kernel.no_receipts ? -1 : 0;
}

static int kernel_recvmmsg(int fd, struct mmsghdr *headers, unsigned count, int flags,
                           struct timespec *timeout);

#define write      kernel_write
#define setsockopt kernel_setsockopt
#define recvmmsg   kernel_recvmmsg
#include "port/linux/can_socket.c" /* NOLINT(bugprone-suspicious-include) */
#undef write
#undef setsockopt
#undef recvmmsg

static int kernel_recvmmsg(int fd, struct mmsghdr *headers, unsigned count, int flags,
                           struct timespec *timeout)
{
    unsigned i = 0;
    (void)fd;
    (void)flags;
    (void)timeout;
    for (; i < kernel.given_count && i < count; ++i) {
        struct can_frame *frame = headers[i].msg_hdr.msg_iov[0].iov_base;
        memset(frame, 0, sizeof *frame);
        frame->can_id = kernel.given[i].id;
        headers[i].msg_hdr.msg_flags = kernel.given[i].flags;
        headers[i].msg_len = (unsigned)sizeof *frame;
    }
    kernel.given_count = 0;
    return (int)i;
}

/* ---- What else the port is made from ---- */

#define port_begin          linux_begin
#define port_end            linux_end
#define port_stop_requested linux_stop_requested
#define port_stop_insisted  linux_stop_insisted
#define port_node_id        linux_node_id
#define port_can_accept     linux_can_accept
#define port_can_send       linux_can_send
#define port_can_delivered  linux_can_delivered
#define port_time_ns        linux_time_ns
#define port_time_us        linux_time_us
#define port_start          linux_start
#define port_tick_period    linux_tick_period
#define port_tick_await     linux_tick_await
#define port_tick_ready     linux_tick_ready
#define port_tick_urgent    linux_tick_urgent
#define port_timing         linux_timing
#define port_lock           linux_lock
#define port_unlock         linux_unlock
#define port_wait           linux_wait
#define port_wake           linux_wake
#define port_progress       linux_progress
#define port_store_size     linux_store_size
#define port_store_erase    linux_store_erase
#define port_store_write    linux_store_write
#define port_store_data     linux_store_data
#define port_stream_memory  linux_stream_memory
#define port_cache_memory   linux_cache_memory
#define port_log            linux_log
#include "port/linux/port_linux.c" /* NOLINT(bugprone-suspicious-include) */

bool interrupts_in_tick(void)
{
    return kernel.in_tick;
}

int interrupts_begin(struct can_socket *socket, bool lock_step)
{
    (void)socket;
    (void)lock_step;
    return 0;
}

int interrupts_start(const struct port_handlers *handlers, uint32_t period_us)
{
    (void)handlers;
    (void)period_us;
    return 0;
}

void interrupts_main_loop_sleeps(void)
{
}

void interrupts_run(uint64_t longest_ns)
{
    (void)longest_ns;
}

void interrupts_end(void)
{
}

int interrupts_error(void)
{
    return 0;
}

bool interrupts_keep_time(void)
{
    return true;
}

int store_open(const char *file)
{
    (void)file;
    return 0;
}

void store_ring(uint32_t bytes)
{
    (void)bytes;
}

int clock_join(const char *bus, const char *name)
{
    (void)bus;
    (void)name;
    return 0;
}

void clock_leave(void)
{
}

bool clock_is_virtual(void)
{
    return kernel.virtual_time;
}

uint32_t clock_participant(void)
{
    return 0;
}

void clock_note_sent(void)
{
}

uint64_t clock_ns(void)
{
    return kernel.now_ns;
}

int clock_poll(struct pollfd *fds, size_t buses, size_t count, uint64_t timeout_ns)
{
    (void)fds;
    (void)buses;
    (void)count;
    kernel.now_ns += timeout_ns;
    return 0;
}

/* ---- Tests ---- */

static int send_frame(uint16_t id, bool from_tick)
{
    const struct can_msg message = {.id = id, .len = 1};
    kernel.in_tick = from_tick;
    const int result = linux_can_send(&message);
    kernel.in_tick = false;
    return result;
}

/* The kernel gives a frame to the socket; returns how many the application gets. */
static int give(uint16_t id, int flags)
{
    struct can_msg messages[CAN_SOCKET_BATCH];
    int more = 0;
    kernel.given[kernel.given_count++] = (struct mmsghdr_frame){id, flags};
    return can_socket_receive(&self.socket, messages, &more);
}

static void pass_ms(uint32_t ms)
{
    kernel.now_ns += ms * UINT64_C(1000000);
}

void setUp(void)
{
    const struct can_match everything = {0, 0};
    memset(&kernel, 0, sizeof kernel);
    memset(&self, 0, sizeof self);
    kernel.now_ns = 1;
    TEST_ASSERT_EQUAL_INT(0, linux_can_accept(&everything, 1));
}

void tearDown(void)
{
}

static void test_before_the_first_tick_nothing_waits(void)
{
    TEST_ASSERT_TRUE(linux_can_delivered());
}

static void test_frames_of_the_main_loop_are_not_waited_for(void)
{
    TEST_ASSERT_EQUAL_INT(0, send_frame(0x601, false));
    TEST_ASSERT_TRUE(linux_can_delivered());
}

/* Each frame of the tick comes back when it has left; the application sees none of them. */
static void test_every_frame_of_a_tick_is_waited_for(void)
{
    const uint16_t ids[] = {0x080, 0x202, 0x203};
    for (unsigned i = 0; i < 3u; ++i) {
        TEST_ASSERT_EQUAL_INT(0, send_frame(ids[i], true));
    }
    for (unsigned i = 0; i < 3u; ++i) {
        TEST_ASSERT_FALSE(linux_can_delivered());
        TEST_ASSERT_EQUAL_INT(0, give(ids[i], MSG_CONFIRM));
    }
    TEST_ASSERT_TRUE(linux_can_delivered());
}

/* Another node may use the identifier of a setpoint. */
static void test_a_frame_of_another_node_is_no_receipt(void)
{
    TEST_ASSERT_EQUAL_INT(0, send_frame(0x202, true));
    TEST_ASSERT_EQUAL_INT(1, give(0x202, 0));
    TEST_ASSERT_FALSE(linux_can_delivered());
    TEST_ASSERT_EQUAL_INT(0, give(0x202, MSG_CONFIRM));
    TEST_ASSERT_TRUE(linux_can_delivered());
}

static void test_a_receipt_counts_once(void)
{
    TEST_ASSERT_EQUAL_INT(0, send_frame(0x080, true));
    TEST_ASSERT_EQUAL_INT(0, send_frame(0x080, true));
    (void)give(0x080, MSG_CONFIRM);
    TEST_ASSERT_FALSE(linux_can_delivered());
    (void)give(0x080, MSG_CONFIRM);
    TEST_ASSERT_TRUE(linux_can_delivered());
}

static void test_a_refused_frame_is_not_waited_for(void)
{
    kernel.refuses = ENOBUFS;
    TEST_ASSERT_EQUAL_INT(PORT_ERR_FULL, send_frame(0x080, true));
    TEST_ASSERT_TRUE(linux_can_delivered());
    kernel.refuses = 0;
    TEST_ASSERT_EQUAL_INT(0, send_frame(0x080, true));
    kernel.refuses = EAGAIN;
    TEST_ASSERT_EQUAL_INT(PORT_ERR_FULL, send_frame(0x202, true));
    TEST_ASSERT_FALSE(linux_can_delivered());
    (void)give(0x080, MSG_CONFIRM);
    TEST_ASSERT_TRUE(linux_can_delivered());
}

/* Bus-off: the driver drops them, and nothing reports it. */
static void test_frames_that_are_lost_are_given_up_after_a_tenth_of_a_second(void)
{
    TEST_ASSERT_EQUAL_INT(0, send_frame(0x080, true));
    pass_ms(1000); /* counted from the first tick that reads it */
    TEST_ASSERT_FALSE(linux_can_delivered());
    pass_ms(100);
    TEST_ASSERT_FALSE(linux_can_delivered());
    pass_ms(1);
    TEST_ASSERT_TRUE(linux_can_delivered());
    TEST_ASSERT_EQUAL_INT(0, send_frame(0x080, true));
    TEST_ASSERT_FALSE(linux_can_delivered());
    pass_ms(100);
    TEST_ASSERT_FALSE(linux_can_delivered());
    (void)give(0x080, MSG_CONFIRM);
    TEST_ASSERT_TRUE(linux_can_delivered());
}

/* A wait that ended does not shorten the next one. */
static void test_each_wait_has_its_own_time(void)
{
    for (unsigned i = 0; i < 10u; ++i) {
        TEST_ASSERT_EQUAL_INT(0, send_frame(0x080, true));
        TEST_ASSERT_FALSE(linux_can_delivered());
        pass_ms(60);
        TEST_ASSERT_FALSE(linux_can_delivered());
        (void)give(0x080, MSG_CONFIRM);
        TEST_ASSERT_TRUE(linux_can_delivered());
    }
}

static void test_a_kernel_that_gives_no_receipts_is_not_waited_for(void)
{
    kernel.no_receipts = true;
    TEST_ASSERT_EQUAL_INT(0, send_frame(0x080, true));
    TEST_ASSERT_EQUAL_UINT(1, kernel.written);
    TEST_ASSERT_TRUE(linux_can_delivered());
}

/* Without bit times nothing waits there. */
static void test_a_local_bus_in_real_time_is_not_waited_for(void)
{
    self.socket.local = true;
    TEST_ASSERT_EQUAL_INT(0, send_frame(0x080, true));
    TEST_ASSERT_TRUE(linux_can_delivered());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_before_the_first_tick_nothing_waits);
    RUN_TEST(test_frames_of_the_main_loop_are_not_waited_for);
    RUN_TEST(test_every_frame_of_a_tick_is_waited_for);
    RUN_TEST(test_a_frame_of_another_node_is_no_receipt);
    RUN_TEST(test_a_receipt_counts_once);
    RUN_TEST(test_a_refused_frame_is_not_waited_for);
    RUN_TEST(test_frames_that_are_lost_are_given_up_after_a_tenth_of_a_second);
    RUN_TEST(test_each_wait_has_its_own_time);
    RUN_TEST(test_a_kernel_that_gives_no_receipts_is_not_waited_for);
    RUN_TEST(test_a_local_bus_in_real_time_is_not_waited_for);
    return UNITY_END();
}
