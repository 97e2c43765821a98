/* SPDX-License-Identifier: MIT */
/* The functions of port.h as the board has them, on a model of the chip: every test is linked with fake_port, so
 * they are compiled here under other names. Run by `make unit`; no I/O. */
#define port_begin          board_begin
#define port_end            board_end
#define port_stop_requested board_stop_requested
#define port_stop_insisted  board_stop_insisted
#define port_node_id        board_node_id
#define port_can_accept     board_can_accept
#define port_can_send       board_can_send
#define port_can_delivered  board_can_delivered
#define port_time_ns        board_time_ns
#define port_time_us        board_time_us
#define port_start          board_start
#define port_tick_period    board_tick_period
#define port_tick_await     board_tick_await
#define port_tick_ready     board_tick_ready
#define port_tick_urgent    board_tick_urgent
#define port_timing         board_timing
#define port_lock           board_lock
#define port_unlock         board_unlock
#define port_wait           board_wait
#define port_wake           board_wake
#define port_progress       board_progress
#define port_store_size     board_store_size
#define port_store_erase    board_store_erase
#define port_store_write    board_store_write
#define port_store_data     board_store_data
#define port_stream_memory  board_stream_memory
#define port_cache_memory   board_cache_memory
#define port_log            board_log
#include "port/stm32g4/port_stm32g4.c" /* NOLINT(bugprone-suspicious-include) */
#include "port/stm32g4/port_store.c"   /* NOLINT(bugprone-suspicious-include) */

#include <string.h>

#include "fdcan_model.h"
#include "flash_model.h"
#include "port/cortex_m/startup.h"
#include "stm32g4_chip.h"
#include "unity.h"

enum { RCC = 0x40021000, LPUART1 = 0x40008000, IWDG = 0x40003000 };

static uint32_t ticks;
static uint32_t frames;
static uint32_t slept;

static void on_tick(void *self, uint32_t now_us, uint32_t late_ns)
{
    const struct can_msg sync = {.id = 0x080, .len = 0};
    (void)self;
    (void)now_us;
    (void)late_ns;
    ticks++;
    (void)port_can_send(&sync); /* refused in bus-off */
}

static void on_receive(void *self, const struct can_msg *message, uint32_t now_us)
{
    (void)self;
    (void)message;
    (void)now_us;
    frames++;
    port_wake();
}

static const struct port_handlers handlers = {.receive = on_receive, .tick = on_tick};

/* Half a millisecond; the tick when it is due, and the frames that wait. */
static void sleep_a_little(void)
{
    struct fdcan_model_frame frame;
    slept++;
    chip_advance_100ns(5000);
    chip_in_handler(true);
    if (chip_tick_pending()) {
        irq_tick();
    }
    while (fdcan_model_transmit(&frame)) {
    }
    if (fdcan_model_interrupt()) {
        irq_can();
    }
    chip_in_handler(false);
}

void setUp(void)
{
    flash_model_new();
    chip_power_on();
    memset(&self, 0, sizeof self);
    ticks = 0;
    frames = 0;
    slept = 0;
    chip_poke(RCC, 1u << 17 | 1u << 25); /* crystal and PLL are ready */
    chip_poke(RCC + 8u, 3u << 2);
    chip_poke(LPUART1 + 0x1Cu, 1u << 7);
    chip_on_sleep(sleep_a_little);
}

void tearDown(void)
{
}

static void start(void)
{
    static const struct can_match filters[] = {{0x180, 0x780}, {0x601, 0x7FF}};
    TEST_ASSERT_EQUAL_INT(0, port_begin(0, NULL));
    TEST_ASSERT_EQUAL_INT(0, port_can_accept(filters, 2));
    TEST_ASSERT_EQUAL_INT(0, port_start(&handlers, 1000));
}

static unsigned said(void)
{
    return chip_writes(LPUART1 + 0x28u);
}

static void test_a_board_that_is_well_begins_in_silence(void)
{
    start();
    TEST_ASSERT_EQUAL_UINT(0, said());
    TEST_ASSERT_EQUAL_UINT32(1000000, fdcan_model_bits_s(24000000));
    TEST_ASSERT_TRUE(fdcan_model_active());
    TEST_ASSERT_EQUAL_UINT8(1, port_node_id());
    TEST_ASSERT_FALSE(port_stop_requested());
    TEST_ASSERT_BITS_HIGH(1u << 25 | 1u | 1u << 3, chip_peek(RCC + 0x58u));
    TEST_ASSERT_BITS_LOW(3u << 24, chip_peek(RCC + 0x88u)); /* FDCAN from the crystal */
    TEST_ASSERT_EQUAL_INT(0, port_end());
    TEST_ASSERT_FALSE(fdcan_model_active());
}

static void test_what_is_wrong_is_said_and_returned(void)
{
    chip_poke(RCC, 0);
    TEST_ASSERT_EQUAL_INT(PORT_ERR_SYSTEM, port_begin(0, NULL));
    TEST_ASSERT_GREATER_THAN_UINT(20, said());
    setUp();
    flash_model_single_bank();
    TEST_ASSERT_EQUAL_INT(PORT_ERR_SYSTEM, port_begin(0, NULL));
    TEST_ASSERT_GREATER_THAN_UINT(20, said());
    setUp();
    chip_poke(RCC + 0x94u, 1u << 29);
    TEST_ASSERT_EQUAL_INT(0, port_begin(0, NULL));
    TEST_ASSERT_EQUAL_UINT(strlen("hodograph: restarted by the watchdog 0\r\n"), said());
}

static void test_waiting_ends_with_its_time_or_a_wake(void)
{
    const struct fdcan_model_frame answer = {.id = 0x601, .dlc = 8};
    start();
    const uint32_t began_us = port_time_us();
    port_wait(5000);
    TEST_ASSERT_EQUAL_UINT32(5000, port_time_us() - began_us);
    TEST_ASSERT_EQUAL_UINT32(5, ticks);
    TEST_ASSERT_TRUE(fdcan_model_receive(&answer));
    slept = 0;
    port_wait(5000);
    TEST_ASSERT_EQUAL_UINT32(1, frames);
    TEST_ASSERT_EQUAL_UINT32(1, slept);
    port_wait(1000);
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(3, slept, "woken once, not twice");
}

static void test_the_context_decides_whose_turn_it_is(void)
{
    const struct can_msg message = {.id = 0x581, .len = 8};
    struct fdcan_model_frame frame;
    start();
    for (unsigned i = 0; i < 3u; ++i) {
        TEST_ASSERT_EQUAL_INT(0, port_can_send(&message));
    }
    TEST_ASSERT_EQUAL_UINT_MESSAGE(1, fdcan_model_waiting(), "the main loop's go one at a time");
    TEST_ASSERT_TRUE(port_can_delivered());
    chip_in_handler(true);
    for (unsigned i = 0; i < 2u; ++i) {
        TEST_ASSERT_EQUAL_INT(0, port_can_send(&message));
    }
    chip_in_handler(false);
    TEST_ASSERT_EQUAL_UINT_MESSAGE(3, fdcan_model_waiting(), "the tick's all at once");
    TEST_ASSERT_FALSE(port_can_delivered());
    while (fdcan_model_transmit(&frame)) {
        irq_can();
    }
    TEST_ASSERT_TRUE(port_can_delivered());
}

static void test_the_lock_holds_off_both(void)
{
    uint8_t priority = 0;
    start();
    port_lock();
    TEST_ASSERT_TRUE(chip_interrupt_is_on(28, &priority));
    TEST_ASSERT_EQUAL_UINT8(priority, chip_held());
    port_tick_period(2000);
    const struct can_msg message = {.id = 0x581, .len = 8};
    TEST_ASSERT_EQUAL_INT(0, port_can_send(&message));
    TEST_ASSERT_EQUAL_UINT8_MESSAGE(priority, chip_held(), "the lock was lost on the way");
    port_unlock();
    TEST_ASSERT_EQUAL_UINT8(0, chip_held());
    port_wait(10000);
    TEST_ASSERT_EQUAL_UINT32(5, ticks);
}

static void test_the_watchdog_lives_on_ticks_and_main_loop(void)
{
    start();
    port_wait(2000);
    const unsigned fed = chip_writes(IWDG);
    port_wait(2000);
    TEST_ASSERT_EQUAL_UINT(fed + 1u, chip_writes(IWDG));
    irq_stop();
    port_wait(2000);
    port_wait(2000);
    port_wait(2000);
    TEST_ASSERT_EQUAL_UINT_MESSAGE(fed + 2u, chip_writes(IWDG), "fed though ticks stand still");
}

/* As in the check of a program: seconds without a wait. */
static void test_the_watchdog_lives_through_long_work(void)
{
    start();
    port_wait(2000);
    const unsigned fed = chip_writes(IWDG);
    sleep_a_little();
    sleep_a_little();
    TEST_ASSERT_EQUAL_UINT_MESSAGE(fed, chip_writes(IWDG), "fed by a tick alone");
    port_progress();
    TEST_ASSERT_EQUAL_UINT(fed + 1u, chip_writes(IWDG));
    port_progress();
    TEST_ASSERT_EQUAL_UINT_MESSAGE(fed + 1u, chip_writes(IWDG), "fed though ticks stand still");
}

static void test_spoiled_words_are_taken_before_the_start_only(void)
{
    TEST_ASSERT_EQUAL_INT(0, port_begin(0, NULL));
    flash_model_fail_word(2);
    startup_nmi();
    TEST_ASSERT_EQUAL_UINT(0, chip_resets());
    TEST_ASSERT_EQUAL_INT(0, port_start(&handlers, 1000));
    TEST_ASSERT_EQUAL_UINT(strlen("hodograph: spoiled words in the program store 1\r\n"), said());
    flash_model_fail_word(2);
    startup_nmi();
    TEST_ASSERT_EQUAL_UINT(1, chip_resets());
}

static void test_a_spoiled_word_of_the_code_is_the_end_at_any_time(void)
{
    TEST_ASSERT_EQUAL_INT(0, port_begin(0, NULL));
    flash_model_fail_word(1);
    startup_nmi();
    TEST_ASSERT_EQUAL_UINT(1, chip_resets());
    startup_hard_fault();
    TEST_ASSERT_EQUAL_UINT(2, chip_resets());
}

static void test_the_store_is_the_flash(void)
{
    static const uint8_t data[8] = {1, 2, 3, 4, 5, 6, 7, 8};
    TEST_ASSERT_EQUAL_UINT32(126u * 1024u, port_store_size(0));
    TEST_ASSERT_EQUAL_UINT32(PORT_STORE_PARAMETER_BYTES, port_store_size(PORT_STORE_PARAMETERS));
    TEST_ASSERT_EQUAL_INT(0, port_store_erase(1));
    TEST_ASSERT_EQUAL_INT(0, port_store_write(1, 0, data, 8));
    TEST_ASSERT_EQUAL_PTR(flash_model_memory(0x0805F800u), port_store_data(1));
    TEST_ASSERT_EQUAL_HEX8_ARRAY(data, port_store_data(1), 8);
    TEST_ASSERT_EQUAL_INT(PORT_ERR_STORE, port_store_write(0, 0, data, 8));
    TEST_ASSERT_EQUAL_INT(PORT_ERR_STORE, port_store_erase(PORT_STORE_BANKS_ALL));
}

static void test_trouble_on_the_bus_is_reported_once_a_second(void)
{
    start();
    for (unsigned i = 0; i < 300u; ++i) {
        fdcan_model_fail(32);
        sleep_a_little();
        fdcan_model_recessive(129u * 11u);
        sleep_a_little();
    }
    TEST_ASSERT_EQUAL_UINT(0, said());
    port_wait(1000000);
    port_wait(1000);
    const unsigned once = said();
    TEST_ASSERT_GREATER_THAN_UINT(40, once);
    fdcan_model_fail(32);
    sleep_a_little();
    port_wait(1000);
    TEST_ASSERT_EQUAL_UINT(once, said());
}

static void test_error_counters_are_reported_when_the_chip_becomes_error_passive(void)
{
    start();
    port_wait(1000000);
    fdcan_model_fail(15);
    irq_can();
    port_wait(1000000);
    TEST_ASSERT_EQUAL_STRING("", chip_said());
    fdcan_model_fail(17); /* what was sent meanwhile has brought the counter back to 0 */
    irq_can();
    port_wait(1000);
    TEST_ASSERT_EQUAL_STRING("hodograph: error passive on the CAN bus began or ended, times 1\r\n"
                             "hodograph: CAN error counter now, sending 136\r\n"
                             "hodograph: CAN error counter now, receiving 0\r\n",
                             chip_said());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_board_that_is_well_begins_in_silence);
    RUN_TEST(test_what_is_wrong_is_said_and_returned);
    RUN_TEST(test_waiting_ends_with_its_time_or_a_wake);
    RUN_TEST(test_the_context_decides_whose_turn_it_is);
    RUN_TEST(test_the_lock_holds_off_both);
    RUN_TEST(test_the_watchdog_lives_on_ticks_and_main_loop);
    RUN_TEST(test_the_watchdog_lives_through_long_work);
    RUN_TEST(test_spoiled_words_are_taken_before_the_start_only);
    RUN_TEST(test_a_spoiled_word_of_the_code_is_the_end_at_any_time);
    RUN_TEST(test_the_store_is_the_flash);
    RUN_TEST(test_trouble_on_the_bus_is_reported_once_a_second);
    RUN_TEST(test_error_counters_are_reported_when_the_chip_becomes_error_passive);
    return UNITY_END();
}
