/* SPDX-License-Identifier: MIT */
/* The drives of one process on a bus, of which the test is the hub: the other end of a pair of sockets. Run by
 * `make unit`; opens pairs of sockets, starts a thread, and writes a temporary file. */
#define _GNU_SOURCE
#include "node/drives.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <pthread.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "canopen/cob.h"
#include "drive_bench.h"
#include "hub_thread.h"
#include "port/linux/clock.h"
#include "port/linux/local_bus.h"
#include "unity.h"

enum { FIRST = 2, SECOND = 3 };

static struct drives drives;
static struct node_options options;
static int bus; /* the hub's end */

static struct node_options_axis axis_of(uint8_t node, double position_mm)
{
    struct node_options_axis axis = {
        .config = drive_bench_config, .position_mm = position_mm, .node = node};
    equipment_init(&axis.equipment, &axis.config);
    return axis;
}

static int init(void)
{
    uint8_t node = 0;
    return drives_init(&drives, &options, &node);
}

void setUp(void)
{
    int pair[2];
    memset(&drives, 0, sizeof drives);
    TEST_ASSERT_EQUAL(0, socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK, 0, pair));
    drives.socket.fd = pair[0];
    drives.socket.local = true;
    bus = pair[1];
    options = (struct node_options){.axis_count = 2,
                                    .axes = {axis_of(FIRST, 0.0), axis_of(SECOND, -1.25)}};
    TEST_ASSERT_EQUAL(0, init());
}

void tearDown(void)
{
    can_socket_close(&drives.socket);
    (void)close(bus);
    clock_leave();
    hub_thread_end();
}

/* ---- the bus ---- */

static void give(uint32_t id, const uint8_t *data, uint8_t len)
{
    struct local_bus_frame message = {.frame = {.can_id = id, .can_dlc = len}};
    memcpy(message.frame.data, data, len);
    TEST_ASSERT_EQUAL(sizeof message, send(bus, &message, sizeof message, 0));
}

static void give_nmt(enum nmt_command command)
{
    struct can_msg frame;
    nmt_master_command(command, 0, &frame);
    give(frame.id, frame.data, frame.len);
}

static void give_sync(uint8_t counter)
{
    give(COB_SYNC, &counter, 1);
}

static void give_setpoint(uint32_t cob_id, uint16_t controlword, uint32_t target)
{
    uint8_t data[6];
    cob_put(data, controlword, 2);
    cob_put(data + 2, target, 4);
    give(cob_id, data, sizeof data);
}

static void give_write(uint8_t node, uint16_t index, uint8_t sub, uint32_t value)
{
    uint8_t data[8] = {0x23};
    cob_put(data + 1, index, 2);
    data[3] = sub;
    cob_put(data + 4, value, 4);
    give((uint32_t)COB_SDO_REQUEST + node, data, sizeof data);
}

/* The next frame of the drives with this identifier; others are passed over. False: there is none. */
static bool next_frame(uint32_t id, struct can_frame *frame)
{
    for (;;) {
        uint8_t packet[sizeof(struct local_bus_filters)];
        const ssize_t size = recv(bus, packet, sizeof packet, MSG_DONTWAIT);
        if (size <= 0) {
            return false;
        }
        memcpy(frame, packet, sizeof *frame);
        if (size == (ssize_t)sizeof *frame && frame->can_id == id) {
            return true;
        }
    }
}

static int frames_with(uint32_t id)
{
    struct can_frame frame;
    int count = 0;
    while (next_frame(id, &frame)) {
        count++;
    }
    return count;
}

/* The next message about filters, of a kind. */
static struct local_bus_filters next_filters(uint16_t kind)
{
    struct local_bus_filters reported = {.count = 0};
    do {
        TEST_ASSERT_GREATER_THAN(0, recv(bus, &reported, sizeof reported, MSG_DONTWAIT));
    } while (reported.mark != LOCAL_BUS_MARK || reported.kind != kind);
    return reported;
}

static void expect_match(const struct can_match *match, uint16_t id, uint16_t mask)
{
    TEST_ASSERT_EQUAL_HEX16(id, match->id);
    TEST_ASSERT_EQUAL_HEX16(mask, match->mask);
}

static void operational(void)
{
    drives_process(&drives, 0);
    give_nmt(NMT_START);
    TEST_ASSERT_TRUE(drives_receive(&drives));
    drives_process(&drives, 0);
}

/* ---- tests ---- */

static void test_each_drive_has_its_node_and_its_place(void)
{
    TEST_ASSERT_EQUAL_UINT(2, drives.count);
    TEST_ASSERT_EQUAL_UINT8(FIRST, drives.nodes[0].id);
    TEST_ASSERT_EQUAL_UINT8(SECOND, drives.nodes[1].id);
    TEST_ASSERT_EQUAL_INT32(0, drives.nodes[0].values.target_position);
    TEST_ASSERT_INT32_WITHIN(10, -1250000, drives.nodes[1].values.target_position);
    TEST_ASSERT_EQUAL_INT(0, drives.failed);
}

static void test_a_wrong_drive_is_named(void)
{
    uint8_t node = 0;
    options.axes[1].config.plant.gain_rad_s_v = 0.0;
    TEST_ASSERT_LESS_THAN(0, drives_init(&drives, &options, &node));
    TEST_ASSERT_NOT_EQUAL(DRIVES_ERR_EQUIPMENT, init());
    TEST_ASSERT_EQUAL_UINT8(SECOND, node);
    TEST_ASSERT_EQUAL_UINT(1, drives.count);
    options.axes[0].equipment.brake_volts = 0.0;
    TEST_ASSERT_EQUAL_INT(DRIVES_ERR_EQUIPMENT, drives_init(&drives, &options, &node));
    TEST_ASSERT_EQUAL_UINT8(FIRST, node);
    TEST_ASSERT_EQUAL_UINT(0, drives.count);
}

static void test_equipment_reaches_its_drive(void)
{
    options.axes[1].equipment.serial = 4711;
    TEST_ASSERT_EQUAL_INT(0, init());
    TEST_ASSERT_EQUAL_UINT32(4711, drives.nodes[1].values.identity_object.serial_number);
}

static void test_filters_are_what_the_drives_want(void)
{
    const struct can_match *filters = drives.socket.filters;
    TEST_ASSERT_EQUAL_INT(0, drives_filter(&drives));
    TEST_ASSERT_EQUAL_UINT(7, drives.socket.filter_count);
    expect_match(&filters[0], COB_NMT, CAN_ID_MAX);
    expect_match(&filters[1], COB_SYNC, CAN_ID_MAX);
    expect_match(&filters[2], COB_HEARTBEAT, 0x780);
    expect_match(&filters[3], COB_SDO_REQUEST + FIRST, CAN_ID_MAX);
    expect_match(&filters[4], COB_RPDO1 + FIRST, CAN_ID_MAX);
    expect_match(&filters[5], COB_SDO_REQUEST + SECOND, CAN_ID_MAX);
    expect_match(&filters[6], COB_RPDO1 + SECOND, CAN_ID_MAX);
    TEST_ASSERT_EQUAL_UINT16(7, next_filters(LOCAL_BUS_FILTER).count);
    TEST_ASSERT_FALSE(drives.nodes[0].pdos.moved || drives.nodes[1].pdos.moved);
}

static void put(struct drive_node *node, uint16_t index, uint8_t sub, uint32_t value)
{
    const struct od_entry *entry = od_find(&node->od, index, sub);
    uint8_t bytes[4];
    TEST_ASSERT_NOT_NULL(entry);
    cob_put(bytes, value, entry->size);
    TEST_ASSERT_EQUAL_HEX32(0, od_write(&node->od, entry, bytes, entry->size));
}

/* As many drives as there may be, each with all PDOs. */
static void most_drives(void)
{
    options.axis_count = NODE_OPTIONS_AXES;
    for (uint8_t i = 0; i < NODE_OPTIONS_AXES; i++) {
        options.axes[i] = axis_of((uint8_t)(FIRST + i), 0.0);
    }
    TEST_ASSERT_EQUAL_INT(0, init());
    for (uint8_t i = 0; i < NODE_OPTIONS_AXES; i++) {
        for (uint8_t k = 1; k < DRIVE_PDOS; k++) {
            put(&drives.nodes[i], (uint16_t)(0x1400 + k), 1, COB_RPDO1 + 0x100u * k + FIRST + i);
        }
    }
}

static void test_the_most_filters(void)
{
    most_drives();
    drives.rules.count = 1;
    TEST_ASSERT_EQUAL_INT(0, drives_filter(&drives));
    TEST_ASSERT_EQUAL_UINT(4 + 5 * NODE_OPTIONS_AXES, drives.socket.filter_count);
    expect_match(&drives.socket.filters[drives.socket.filter_count - 1u],
                 COB_RPDO1 + 0x300 + FIRST + NODE_OPTIONS_AXES - 1, CAN_ID_MAX);
}

static void test_filters_that_fail_are_a_failure_of_the_bus(void)
{
    TEST_ASSERT_EQUAL_INT(0, shutdown(drives.socket.fd, SHUT_WR));
    give_sync(1);
    (void)drives_receive(&drives);
    TEST_ASSERT_EQUAL_INT(-EPIPE, drives.failed);
}

/* A failure stays until the next drives_init, whatever succeeds after it. */
static void test_a_failure_stays(void)
{
    drives.failed = -ENODEV;
    drives_process(&drives, 0);
    TEST_ASSERT_EQUAL_INT(1, frames_with(COB_HEARTBEAT + SECOND));
    give_sync(1);
    (void)drives_receive(&drives);
    TEST_ASSERT_EQUAL_INT(-ENODEV, drives.failed);
    TEST_ASSERT_EQUAL_INT(0, init());
    TEST_ASSERT_EQUAL_INT(0, drives.failed);
}

/* Ticks are counted by the setpoints of all drives. */
static void test_fault_rules_want_all_setpoints(void)
{
    drives.rules = (struct fault_rules){
        .count = 1, .rules = {{.kind = FAULT_KIND_STOP, .node = SECOND, .at = 1, .for_ticks = 1}}};
    TEST_ASSERT_EQUAL_INT(0, drives_filter(&drives));
    TEST_ASSERT_EQUAL_UINT(8, drives.socket.filter_count);
    expect_match(&drives.socket.filters[3], COB_RPDO1, 0x780);
}

static void test_a_bus_that_takes_no_filters(void)
{
    can_socket_close(&drives.socket);
    TEST_ASSERT_EQUAL_INT(-EBADF, drives_filter(&drives));
}

/* In virtual time synchronous setpoints do not wake the process; but fault rules act on each frame. */
static void test_synchronous_setpoints_are_deferred(void)
{
    hub_thread_begin((struct hub_options){.is_virtual = true, .bitrate = 1000000});
    TEST_ASSERT_EQUAL(0, clock_join(hub_thread_paths[0], "drives"));
    TEST_ASSERT_TRUE(clock_is_virtual());
    TEST_ASSERT_EQUAL_INT(0, drives_filter(&drives));
    struct local_bus_filters deferred = next_filters(LOCAL_BUS_DEFER);
    TEST_ASSERT_EQUAL_UINT16(2, deferred.count);
    TEST_ASSERT_EQUAL_HEX32(COB_RPDO1 + FIRST, deferred.filters[0].can_id);
    put(&drives.nodes[0], 0x1400, 2, 255);
    TEST_ASSERT_EQUAL_INT(0, drives_filter(&drives));
    deferred = next_filters(LOCAL_BUS_DEFER);
    TEST_ASSERT_EQUAL_UINT16(1, deferred.count);
    TEST_ASSERT_EQUAL_HEX32(COB_RPDO1 + SECOND, deferred.filters[0].can_id);
    drives.rules.count = 1;
    TEST_ASSERT_EQUAL_INT(0, drives_filter(&drives));
    TEST_ASSERT_EQUAL_UINT16(0, next_filters(LOCAL_BUS_DEFER).count);
    drives.rules.count = 0;
    most_drives();
    TEST_ASSERT_EQUAL_INT(0, drives_filter(&drives));
    TEST_ASSERT_EQUAL_UINT16(4 * NODE_OPTIONS_AXES, next_filters(LOCAL_BUS_DEFER).count);
}

static void test_boot_up_and_answers(void)
{
    struct can_frame frame;
    drives_process(&drives, 0);
    TEST_ASSERT_TRUE(next_frame(COB_HEARTBEAT + FIRST, &frame));
    TEST_ASSERT_EQUAL_UINT8(1, frame.can_dlc);
    TEST_ASSERT_TRUE(next_frame(COB_HEARTBEAT + SECOND, &frame));
    give_write(SECOND, 0x1017, 0, 0);
    (void)drives_receive(&drives);
    TEST_ASSERT_TRUE(next_frame(COB_SDO_RESPONSE + SECOND, &frame));
}

static void test_only_acyclic_frames_want_process(void)
{
    operational();
    TEST_ASSERT_FALSE(drives_receive(&drives));
    give_setpoint(COB_RPDO1 + FIRST, 0, 0);
    give_setpoint(COB_RPDO1 + SECOND, 0, 0);
    give_sync(1);
    TEST_ASSERT_FALSE(drives_receive(&drives));
    TEST_ASSERT_EQUAL_UINT32(1, drives.nodes[0].values.simulation.periods);
    TEST_ASSERT_EQUAL_UINT32(1, drives.nodes[1].values.simulation.periods);
    TEST_ASSERT_EQUAL_INT(1, frames_with(COB_TPDO1 + SECOND));
    give_setpoint(COB_RPDO1 + 9, 0, 0);
    TEST_ASSERT_FALSE(drives_receive(&drives));
    give_write(FIRST, 0x6081, 0, 1);
    give_sync(2);
    TEST_ASSERT_TRUE(drives_receive(&drives));
}

/* In a flood the wall clock advances as well. */
static void test_so_many_frames_at_a_time(void)
{
    struct local_bus_frame rest;
    int left = 0;
    for (int i = 0; i < 4 * (int)CAN_SOCKET_BATCH + 3; i++) {
        give_sync((uint8_t)(1 + i % 240));
    }
    TEST_ASSERT_FALSE(drives_receive(&drives));
    while (recv(drives.socket.fd, &rest, sizeof rest, MSG_DONTWAIT) > 0) {
        left++;
    }
    TEST_ASSERT_EQUAL_INT(3, left);
}

static void test_a_moved_pdo_moves_the_filters(void)
{
    operational();
    TEST_ASSERT_EQUAL_INT(0, drives_filter(&drives));
    give_write(SECOND, 0x1400, 1, PDO_MAP_OFF | (COB_RPDO1 + SECOND));
    TEST_ASSERT_TRUE(drives_receive(&drives));
    TEST_ASSERT_EQUAL_UINT(6, drives.socket.filter_count);
    give_write(SECOND, 0x1400, 1, 0x345);
    TEST_ASSERT_TRUE(drives_receive(&drives));
    TEST_ASSERT_EQUAL_UINT(7, drives.socket.filter_count);
    expect_match(&drives.socket.filters[6], 0x345, CAN_ID_MAX);
    (void)frames_with(0); /* all that has been sent so far */
    give_setpoint(0x345, 0, 0);
    TEST_ASSERT_FALSE(drives_receive(&drives));
    TEST_ASSERT_EQUAL_INT(0, drives.failed);
    uint8_t packet;
    TEST_ASSERT_EQUAL_INT(-1, recv(bus, &packet, sizeof packet, MSG_DONTWAIT));
}

static void test_the_end_of_the_bus(void)
{
    (void)close(bus);
    bus = -1;
    TEST_ASSERT_TRUE(drives_receive(&drives));
    TEST_ASSERT_EQUAL_INT(-ENETDOWN, drives.failed);
    TEST_ASSERT_EQUAL_INT(0, init());
    drives_process(&drives, 0);
    TEST_ASSERT_EQUAL_INT(-EPIPE, drives.failed);
}

static void fill_queue(void)
{
    const int bytes = 1;
    const struct can_frame any = {.can_id = 1};
    int taken = 0;
    TEST_ASSERT_EQUAL(0, setsockopt(drives.socket.fd, SOL_SOCKET, SO_SNDBUF, &bytes, sizeof bytes));
    while (send(drives.socket.fd, &any, sizeof any, MSG_DONTWAIT) > 0) {
        taken++;
    }
    TEST_ASSERT_GREATER_THAN(0, taken);
}

/* A queue that stays full is a bus that is off: the frames are lost. */
static void test_a_full_queue_loses_frames_but_is_no_failure(void)
{
    fill_queue();
    drives_process(&drives, 0);
    TEST_ASSERT_EQUAL_INT(0, drives.failed);
    TEST_ASSERT_EQUAL_INT(0, frames_with(COB_HEARTBEAT + FIRST));
}

/* Makes room for the frames while the drives wait for it: after some of their tries. */
static void *empty_queue(void *unused)
{
    struct can_frame frame;
    (void)unused;
    (void)usleep(20000);
    (void)next_frame(COB_HEARTBEAT + FIRST, &frame);
    return NULL;
}

/* Several attempts, since a busy machine may let the thread wait for longer than the drives do. */
static void test_a_full_queue_is_waited_for(void)
{
    int sent = 0;
    drives_process(&drives, 0);
    for (int attempt = 0; attempt < 20 && sent == 0; attempt++) {
        pthread_t thread;
        fill_queue();
        TEST_ASSERT_EQUAL(0, pthread_create(&thread, NULL, empty_queue, NULL));
        drives_process(&drives, 100000);
        TEST_ASSERT_EQUAL(0, pthread_join(thread, NULL));
        sent = frames_with(COB_HEARTBEAT + SECOND);
    }
    TEST_ASSERT_EQUAL_INT(1, sent);
    TEST_ASSERT_EQUAL_INT(0, drives.failed);
}

/* A line for the beginning and one for the end, which the wall clock brings without a frame. */
static void test_fault_rules_act_and_are_printed(void)
{
    char text[512] = "";
    const int out = dup(STDOUT_FILENO);
    FILE *file = tmpfile();
    TEST_ASSERT_NOT_NULL(file);
    drives.rules = (struct fault_rules){
        .count = 1, .rules = {{.kind = FAULT_KIND_STOP, .line = 7, .node = SECOND, .for_ms = 1}}};
    TEST_ASSERT_EQUAL(0, init());
    (void)fflush(stdout);
    (void)dup2(fileno(file), STDOUT_FILENO);
    give_setpoint(COB_RPDO1 + 9, 0x0F, 1);
    give_setpoint(COB_RPDO1 + 9, 0x0F, 2);
    give_sync(1);
    (void)drives_receive(&drives);
    const bool stopped = drives.nodes[1].without_power && !drives.nodes[0].without_power;
    (void)usleep(1500);
    drives_process(&drives, 0);
    (void)dup2(out, STDOUT_FILENO);
    (void)close(out);
    (void)lseek(fileno(file), 0, SEEK_SET);
    (void)fread(text, 1, sizeof text - 1u, file);
    (void)fclose(file);
    TEST_ASSERT_TRUE(stopped);
    TEST_ASSERT_FALSE(drives.nodes[1].without_power);
    TEST_ASSERT_NOT_NULL_MESSAGE(
        strstr(text, "\"tick\":0,\"line\":7,\"kind\":\"stop\",\"node\":3,\"on\":true}\n"), text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, "\"node\":3,\"on\":false}\n"), text);
}

/* A socket whose kernel counts the bytes that wait in it, which a local bus does not. */
static int counting_socket(void)
{
    struct sockaddr_in address = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    socklen_t length = sizeof address;
    const int bytes = 1 << 20;
    const int receiver = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK, 0);
    const int sender = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK, 0);
    TEST_ASSERT_EQUAL(0, bind(receiver, (struct sockaddr *)&address, sizeof address));
    TEST_ASSERT_EQUAL(0, getsockname(receiver, (struct sockaddr *)&address, &length));
    TEST_ASSERT_EQUAL(0, connect(sender, (struct sockaddr *)&address, sizeof address));
    TEST_ASSERT_EQUAL(0, setsockopt(receiver, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes));
    drives.socket.fd = receiver;
    drives.socket.local = false;
    return sender;
}

/* Sends frames until the kernel counts more than so many bytes of them. */
static void pile_up(int sender, uint32_t most_bytes)
{
    const struct can_frame frame = {.can_id = COB_SYNC, .can_dlc = 1, .data = {1}};
    for (int i = 0; i < 4096 && can_socket_waiting_bytes(&drives.socket) <= most_bytes; i++) {
        TEST_ASSERT_EQUAL(sizeof frame, send(sender, &frame, sizeof frame, 0));
    }
    TEST_ASSERT_GREATER_THAN(most_bytes, can_socket_waiting_bytes(&drives.socket));
}

static void test_only_a_long_pile_is_forgotten(void)
{
    can_socket_close(&drives.socket);
    const int sender = counting_socket();
    pile_up(sender, 100000);
    drives_wake(&drives);
    TEST_ASSERT_GREATER_THAN(100000, can_socket_waiting_bytes(&drives.socket));
    pile_up(sender, 256 * 1024);
    drives_wake(&drives);
    TEST_ASSERT_EQUAL_UINT32(0, can_socket_waiting_bytes(&drives.socket));
    TEST_ASSERT_EQUAL_INT(0, drives.failed);
    TEST_ASSERT_EQUAL_UINT32(0, drives.nodes[0].values.simulation.periods);
    (void)close(sender);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_each_drive_has_its_node_and_its_place);
    RUN_TEST(test_a_wrong_drive_is_named);
    RUN_TEST(test_equipment_reaches_its_drive);
    RUN_TEST(test_filters_are_what_the_drives_want);
    RUN_TEST(test_the_most_filters);
    RUN_TEST(test_filters_that_fail_are_a_failure_of_the_bus);
    RUN_TEST(test_a_failure_stays);
    RUN_TEST(test_fault_rules_want_all_setpoints);
    RUN_TEST(test_a_bus_that_takes_no_filters);
    RUN_TEST(test_synchronous_setpoints_are_deferred);
    RUN_TEST(test_boot_up_and_answers);
    RUN_TEST(test_only_acyclic_frames_want_process);
    RUN_TEST(test_so_many_frames_at_a_time);
    RUN_TEST(test_a_moved_pdo_moves_the_filters);
    RUN_TEST(test_the_end_of_the_bus);
    RUN_TEST(test_a_full_queue_loses_frames_but_is_no_failure);
    RUN_TEST(test_a_full_queue_is_waited_for);
    RUN_TEST(test_fault_rules_act_and_are_printed);
    RUN_TEST(test_only_a_long_pile_is_forgotten);
    return UNITY_END();
}
