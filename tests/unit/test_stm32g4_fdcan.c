/* SPDX-License-Identifier: MIT */
/* The driver of FDCAN1 on a model of its registers: timing, filters, both directions, bus-off. Run by `make unit`;
 * no I/O. */
#include "port/stm32g4/fdcan.h"

#include <string.h>

#include "fdcan_model.h"
#include "stm32g4_chip.h"
#include "unity.h"

#define CRYSTAL_HZ 24000000u
#define MBIT       1000000u
#define GOT_MAX    64u

static struct fdcan can;
static struct can_msg got[GOT_MAX];
static unsigned got_count;

static const struct can_match everything = {.id = 0, .mask = 0};

void setUp(void)
{
    chip_power_on();
    got_count = 0;
}

void tearDown(void)
{
    TEST_ASSERT_EQUAL_UINT8_MESSAGE(0, chip_held(), "interrupts are still held off");
}

static void start(void)
{
    TEST_ASSERT_TRUE(fdcan_begin(&can, MBIT));
    TEST_ASSERT_TRUE(fdcan_accept(&everything, 1));
    TEST_ASSERT_FALSE(fdcan_model_active());
    fdcan_start(&can);
    TEST_ASSERT_TRUE(fdcan_model_active());
}

/* The receive interrupt, as long as its line is active. */
static void serve(void)
{
    for (unsigned i = 0; fdcan_model_interrupt(); ++i) {
        TEST_ASSERT_TRUE_MESSAGE(i < 10u, "the interrupt does not go away");
        const uint32_t acknowledged = fdcan_acknowledge();
        struct can_msg message;
        while (fdcan_fetch(&message)) {
            TEST_ASSERT_TRUE(got_count < GOT_MAX);
            got[got_count++] = message;
        }
        fdcan_attend(&can, acknowledged);
    }
}

static struct can_msg numbered(uint32_t number)
{
    struct can_msg message = {.id = number & CAN_ID_MAX, .len = (uint8_t)(number % 9u)};
    for (uint8_t i = 0; i < message.len; ++i) {
        message.data[i] = (uint8_t)(number * 7u + i + 1u);
    }
    return message;
}

static bool send(uint32_t number, enum fdcan_sender sender)
{
    const struct can_msg message = numbered(number);
    return fdcan_send(&can, &message, sender);
}

static void expect_sent(uint32_t number)
{
    const struct can_msg expected = numbered(number);
    struct fdcan_model_frame frame;
    TEST_ASSERT_TRUE(fdcan_model_transmit(&frame));
    TEST_ASSERT_FALSE(frame.extended || frame.remote);
    TEST_ASSERT_EQUAL_HEX32(expected.id, frame.id);
    TEST_ASSERT_EQUAL_UINT8(expected.len, frame.dlc);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected.data, frame.data, CAN_DATA_MAX);
    serve();
}

static bool deliver(uint32_t number)
{
    const struct can_msg message = numbered(number);
    struct fdcan_model_frame frame = {.id = message.id, .dlc = message.len};
    memset(frame.data, 0xEE, sizeof frame.data);
    memcpy(frame.data, message.data, message.len);
    return fdcan_model_receive(&frame);
}

static void expect_got(unsigned place, uint32_t number)
{
    const struct can_msg expected = numbered(number);
    TEST_ASSERT_TRUE(place < got_count);
    TEST_ASSERT_EQUAL_HEX32(expected.id, got[place].id);
    TEST_ASSERT_EQUAL_UINT8(expected.len, got[place].len);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected.data, got[place].data, CAN_DATA_MAX);
}

static void test_each_rate_is_exact_with_its_sample_at_seven_eighths(void)
{
    for (uint32_t divisor = 1; divisor <= 8u; divisor *= 2u) {
        chip_power_on();
        TEST_ASSERT_TRUE(fdcan_begin(&can, MBIT / divisor));
        TEST_ASSERT_EQUAL_UINT32(MBIT / divisor, fdcan_model_bits_s(CRYSTAL_HZ));
        TEST_ASSERT_EQUAL_DOUBLE(0.875, fdcan_model_sample_point());
        TEST_ASSERT_EQUAL_UINT32(3, fdcan_model_jump_quanta());
    }
}

static void test_what_cannot_be_configured(void)
{
    static const uint32_t wrong[] = {0, 1, 100000, 333333, 800000, 2 * MBIT, 62500, UINT32_MAX};
    for (unsigned i = 0; i < sizeof wrong / sizeof wrong[0]; ++i) {
        TEST_ASSERT_FALSE(fdcan_begin(&can, wrong[i]));
    }
    fdcan_model_stop_clock();
    TEST_ASSERT_FALSE(fdcan_begin(&can, MBIT));
}

static void test_a_second_begin_reaches_a_chip_that_runs(void)
{
    start();
    TEST_ASSERT_TRUE(fdcan_begin(&can, MBIT / 2u));
    TEST_ASSERT_FALSE(fdcan_model_active());
    TEST_ASSERT_EQUAL_UINT32(MBIT / 2u, fdcan_model_bits_s(CRYSTAL_HZ));
}

static void test_filters_let_through_what_they_say(void)
{
    static const struct can_match filters[] = {
        {0x000, 0x7FF}, {0x080, 0x780}, {0x180, 0x780}, {0x601, 0x7FF}, {0x701, 0x70F}};
    TEST_ASSERT_TRUE(fdcan_begin(&can, MBIT));
    TEST_ASSERT_TRUE(fdcan_accept(filters, 5));
    fdcan_start(&can);
    for (uint32_t id = 0; id <= CAN_ID_MAX; ++id) {
        bool expected = false;
        for (unsigned i = 0; i < 5u; ++i) {
            expected = expected || ((id ^ filters[i].id) & filters[i].mask) == 0u;
        }
        TEST_ASSERT_EQUAL_MESSAGE(expected, deliver(id), "identifier");
        serve();
        got_count = 0;
    }
}

static void test_only_data_frames_with_short_identifiers(void)
{
    start();
    struct fdcan_model_frame frame = {.id = 0x181, .dlc = 8, .remote = true};
    TEST_ASSERT_FALSE(fdcan_model_receive(&frame));
    frame.remote = false;
    frame.extended = true;
    TEST_ASSERT_FALSE(fdcan_model_receive(&frame));
    frame.remote = true;
    TEST_ASSERT_FALSE(fdcan_model_receive(&frame));
    frame.remote = false;
    frame.extended = false;
    TEST_ASSERT_TRUE(fdcan_model_receive(&frame));
}

static void test_no_filter_and_too_many(void)
{
    static const struct can_match many[29];
    TEST_ASSERT_TRUE(fdcan_begin(&can, MBIT));
    TEST_ASSERT_FALSE(fdcan_accept(many, 29));
    fdcan_start(&can);
    TEST_ASSERT_FALSE(deliver(0));
    fdcan_stop(&can);
    TEST_ASSERT_TRUE(fdcan_begin(&can, MBIT));
    TEST_ASSERT_TRUE(fdcan_accept(many, 28));
    fdcan_start(&can);
    TEST_ASSERT_TRUE(deliver(0));
}

static void test_frames_come_in_order_in_bursts_of_any_length(void)
{
    start();
    uint32_t sent = 0;
    uint32_t checked = 0;
    for (unsigned round = 0; round < 300u; ++round) {
        for (unsigned i = 0; i <= round % 3u; ++i) {
            TEST_ASSERT_TRUE(deliver(sent));
            sent++;
        }
        serve();
        for (unsigned i = 0; checked < sent; ++i) {
            expect_got(i, checked++);
        }
        got_count = 0;
    }
    TEST_ASSERT_EQUAL_UINT32(0, fdcan_take_events(&can).lost);
}

static void test_a_fourth_frame_is_lost_and_counted(void)
{
    start();
    for (uint32_t i = 0; i < 3u; ++i) {
        TEST_ASSERT_TRUE(deliver(i));
    }
    TEST_ASSERT_FALSE(deliver(3));
    serve();
    TEST_ASSERT_EQUAL_UINT(3, got_count);
    expect_got(0, 0);
    expect_got(2, 2);
    TEST_ASSERT_EQUAL_UINT32(1, fdcan_take_events(&can).lost);
    TEST_ASSERT_EQUAL_UINT32(0, fdcan_take_events(&can).lost);
    TEST_ASSERT_TRUE(deliver(4));
    serve();
    expect_got(3, 4);
}

static void test_a_length_above_eight_means_eight(void)
{
    start();
    struct fdcan_model_frame frame = {.id = 1, .dlc = 15, .data = {1, 2, 3, 4, 5, 6, 7, 8}};
    TEST_ASSERT_TRUE(fdcan_model_receive(&frame));
    serve();
    TEST_ASSERT_EQUAL_UINT8(8, got[0].len);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(frame.data, got[0].data, 8);
}

static void test_frames_go_in_order(void)
{
    start();
    for (uint32_t i = 0; i < 300u; ++i) {
        TEST_ASSERT_TRUE(send(2u * i, FDCAN_URGENT));
        TEST_ASSERT_TRUE(send(2u * i + 1u, FDCAN_URGENT));
        expect_sent(2u * i);
        expect_sent(2u * i + 1u);
    }
}

static void test_a_full_queue_refuses_and_keeps_its_order(void)
{
    start();
    uint32_t taken = 0;
    while (send(taken, FDCAN_URGENT)) {
        taken++;
    }
    TEST_ASSERT_EQUAL_UINT32(3u + FDCAN_QUEUE_SIZE, taken);
    expect_sent(0);
    TEST_ASSERT_TRUE(send(taken, FDCAN_URGENT));
    TEST_ASSERT_FALSE(send(taken + 1u, FDCAN_URGENT));
    for (uint32_t i = 1; i <= taken; ++i) {
        expect_sent(i);
    }
    struct fdcan_model_frame frame;
    TEST_ASSERT_FALSE(fdcan_model_transmit(&frame));
}

/* However much the main loop wants to send, a tick's frames come after one of them at most. */
static void test_the_main_loop_holds_up_the_tick_by_one_frame(void)
{
    start();
    for (uint32_t i = 0; i < FDCAN_QUEUE_SIZE; ++i) {
        TEST_ASSERT_TRUE(send(1000u + i, FDCAN_ORDINARY));
        TEST_ASSERT_EQUAL_UINT(1, fdcan_model_waiting());
    }
    for (uint32_t i = 0; i < 5u; ++i) {
        TEST_ASSERT_TRUE(send(i, FDCAN_URGENT));
    }
    TEST_ASSERT_EQUAL_UINT(3, fdcan_model_waiting());
    expect_sent(1000);
    for (uint32_t i = 0; i < 5u; ++i) {
        expect_sent(i);
    }
    for (uint32_t i = 1; i < FDCAN_QUEUE_SIZE; ++i) {
        expect_sent(1000u + i);
    }
}

static void test_nothing_is_taken_off_the_bus(void)
{
    TEST_ASSERT_TRUE(fdcan_begin(&can, MBIT));
    TEST_ASSERT_FALSE(send(1, FDCAN_URGENT));
    fdcan_start(&can);
    TEST_ASSERT_TRUE(send(2, FDCAN_URGENT));
    expect_sent(2);
    fdcan_stop(&can);
    TEST_ASSERT_FALSE(fdcan_model_active());
    TEST_ASSERT_FALSE(send(3, FDCAN_ORDINARY));
}

static void fall_off_the_bus(void)
{
    fdcan_model_fail(31);
    serve();
    TEST_ASSERT_TRUE(fdcan_model_active());
    fdcan_model_fail(1);
    TEST_ASSERT_FALSE(fdcan_model_active());
    serve();
}

static void test_frames_of_the_interrupts_are_delivered_when_they_are_on_the_bus(void)
{
    start();
    TEST_ASSERT_TRUE(fdcan_delivered(&can));
    for (uint32_t i = 1; i <= 5u; ++i) {
        TEST_ASSERT_TRUE(send(i, FDCAN_URGENT));
    }
    for (uint32_t i = 1; i <= 5u; ++i) {
        TEST_ASSERT_FALSE(fdcan_delivered(&can));
        expect_sent(i);
    }
    TEST_ASSERT_TRUE(fdcan_delivered(&can));
}

static void test_frames_of_the_main_loop_are_not_waited_for(void)
{
    start();
    TEST_ASSERT_TRUE(send(10, FDCAN_ORDINARY));
    TEST_ASSERT_TRUE(fdcan_delivered(&can));
    TEST_ASSERT_TRUE(send(1, FDCAN_URGENT));
    TEST_ASSERT_TRUE(send(11, FDCAN_ORDINARY));
    TEST_ASSERT_FALSE(fdcan_delivered(&can));
    expect_sent(10);
    TEST_ASSERT_FALSE(fdcan_delivered(&can));
    expect_sent(1);
    TEST_ASSERT_TRUE(fdcan_delivered(&can));
    expect_sent(11);
}

static void test_after_bus_off_it_comes_back_with_nothing_old(void)
{
    start();
    for (unsigned times = 1; times <= 3u; ++times) {
        for (uint32_t i = 0; i < 8u; ++i) {
            TEST_ASSERT_TRUE(send(i, i % 2u == 0u ? FDCAN_URGENT : FDCAN_ORDINARY));
        }
        fall_off_the_bus();
        TEST_ASSERT_FALSE(send(90, FDCAN_URGENT));
        TEST_ASSERT_FALSE(send(91, FDCAN_ORDINARY));
        fdcan_model_recessive(128u * 11u);
        serve();
        TEST_ASSERT_FALSE(fdcan_model_active());
        TEST_ASSERT_FALSE(send(92, FDCAN_URGENT));
        fdcan_model_recessive(11);
        serve();
        TEST_ASSERT_TRUE(fdcan_model_active());
        TEST_ASSERT_EQUAL_UINT32(1, fdcan_take_events(&can).bus_offs);
        TEST_ASSERT_EQUAL_UINT(0, fdcan_model_waiting());
        TEST_ASSERT_TRUE(send(100, FDCAN_URGENT));
        expect_sent(100);
        TEST_ASSERT_TRUE(deliver(7));
        serve();
        expect_got(times - 1u, 7);
    }
}

static void test_errors_are_reported(void)
{
    uint8_t transmit = 0;
    uint8_t receive = 0;
    start();
    fdcan_model_fail(15);
    serve();
    TEST_ASSERT_EQUAL_UINT32(0, fdcan_take_events(&can).error_passives);
    fdcan_model_fail(1);
    serve();
    TEST_ASSERT_EQUAL_UINT32(1, fdcan_take_events(&can).error_passives);
    fdcan_errors(&transmit, &receive);
    TEST_ASSERT_EQUAL_UINT8(128, transmit);
    TEST_ASSERT_EQUAL_UINT8(0, receive);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_each_rate_is_exact_with_its_sample_at_seven_eighths);
    RUN_TEST(test_what_cannot_be_configured);
    RUN_TEST(test_a_second_begin_reaches_a_chip_that_runs);
    RUN_TEST(test_filters_let_through_what_they_say);
    RUN_TEST(test_only_data_frames_with_short_identifiers);
    RUN_TEST(test_no_filter_and_too_many);
    RUN_TEST(test_frames_come_in_order_in_bursts_of_any_length);
    RUN_TEST(test_a_fourth_frame_is_lost_and_counted);
    RUN_TEST(test_a_length_above_eight_means_eight);
    RUN_TEST(test_frames_go_in_order);
    RUN_TEST(test_a_full_queue_refuses_and_keeps_its_order);
    RUN_TEST(test_the_main_loop_holds_up_the_tick_by_one_frame);
    RUN_TEST(test_nothing_is_taken_off_the_bus);
    RUN_TEST(test_frames_of_the_interrupts_are_delivered_when_they_are_on_the_bus);
    RUN_TEST(test_frames_of_the_main_loop_are_not_waited_for);
    RUN_TEST(test_after_bus_off_it_comes_back_with_nothing_old);
    RUN_TEST(test_errors_are_reported);
    return UNITY_END();
}
