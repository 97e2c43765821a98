/* SPDX-License-Identifier: MIT */
/* Ticks, interrupts, watchdog, clocks, pins and console of the NUCLEO-G474RE port on a model of the chip. Run by
 * `make unit`; no I/O. */
#include <string.h>

#include "fdcan_model.h"
#include "flash_model.h"
#include "port/stm32g4/clock.h"
#include "port/stm32g4/console.h"
#include "port/stm32g4/cpu.h"
#include "port/stm32g4/irq.h"
#include "port/stm32g4/pins.h"
#include "port/stm32g4/tick_timer.h"
#include "port/stm32g4/watchdog.h"
#include "stm32g4_chip.h"
#include "unity.h"

#define PERIOD 10000u /* counts of 100 ns */

enum {
    RCC = 0x40021000,
    PWR = 0x40007000,
    GPIOA = 0x48000000,
    IWDG = 0x40003000,
    LPUART1 = 0x40008000
};

static struct fdcan can;
static struct {
    uint32_t ticks;
    uint32_t frames;
    uint32_t now_us;
    uint32_t late_ns;
    uint32_t busy_100ns; /* what a tick takes */
    uint8_t held;        /* in receive */
} app;

static void on_tick(void *self, uint32_t now_us, uint32_t late_ns)
{
    TEST_ASSERT_EQUAL_PTR(&app, self);
    app.ticks++;
    app.now_us = now_us;
    app.late_ns = late_ns;
    chip_advance_100ns(app.busy_100ns);
}

static void on_receive(void *self, const struct can_msg *message, uint32_t now_us)
{
    TEST_ASSERT_EQUAL_PTR(&app, self);
    TEST_ASSERT_EQUAL_HEX32(0x181, message->id);
    app.frames++;
    app.now_us = now_us;
    app.held = chip_held();
}

static const struct port_handlers handlers = {.self = &app, .receive = on_receive, .tick = on_tick};

void setUp(void)
{
    flash_model_new();
    chip_power_on();
    memset(&app, 0, sizeof app);
}

void tearDown(void)
{
}

static void start(uint32_t period_us)
{
    static const struct can_match all = {.id = 0, .mask = 0};
    tick_timer_begin(170);
    TEST_ASSERT_TRUE(fdcan_begin(&can, 1000000));
    TEST_ASSERT_TRUE(fdcan_accept(&all, 1));
    irq_start(&can, &handlers, period_us);
}

/* Serves the tick as soon as it is pending; returns how many there were. */
static uint32_t pass(uint32_t counts)
{
    const uint32_t before = app.ticks;
    for (uint32_t i = 0; i < counts; i += 10u) {
        chip_advance_100ns(10);
        if (chip_tick_pending()) {
            irq_tick();
        }
    }
    return app.ticks - before;
}

static void test_clocks_of_the_port(void)
{
    tick_timer_begin(170);
    const uint32_t ns = tick_timer_ns();
    const uint32_t us = tick_timer_us();
    chip_advance_100ns(12345670);
    TEST_ASSERT_EQUAL_UINT32(1234567000u, tick_timer_ns() - ns);
    TEST_ASSERT_EQUAL_UINT32(1234567u, tick_timer_us() - us);
}

static void test_ticks_come_a_period_apart(void)
{
    start(1000);
    TEST_ASSERT_EQUAL_UINT32(0, pass(PERIOD - 10u));
    TEST_ASSERT_EQUAL_UINT32(1, pass(10));
    TEST_ASSERT_EQUAL_UINT32(0, app.late_ns);
    TEST_ASSERT_EQUAL_UINT32(1000, app.now_us);
    TEST_ASSERT_EQUAL_UINT32(50, pass(50u * PERIOD));
    TEST_ASSERT_EQUAL_UINT32(51, irq_ticks());
}

static void test_a_late_tick_is_reported_and_made_up_for(void)
{
    start(1000);
    chip_advance_100ns(PERIOD + 5000u);
    TEST_ASSERT_TRUE(chip_tick_pending());
    irq_tick();
    TEST_ASSERT_EQUAL_UINT32(500000, app.late_ns);
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(0, pass(7490), "closer than three quarters of a period");
    TEST_ASSERT_EQUAL_UINT32(1, pass(10));
    TEST_ASSERT_EQUAL_UINT32(250000, app.late_ns);
    TEST_ASSERT_EQUAL_UINT32(1, pass(7500));
    TEST_ASSERT_EQUAL_UINT32(0, app.late_ns);
    TEST_ASSERT_EQUAL_UINT32(10, pass(10u * PERIOD));
}

static void test_a_tick_that_outlasts_the_next_due_time_is_followed_at_once(void)
{
    start(1000);
    app.busy_100ns = 12000;
    TEST_ASSERT_EQUAL_UINT32(1, pass(PERIOD));
    TEST_ASSERT_TRUE_MESSAGE(chip_tick_pending(), "the compare was missed");
    app.busy_100ns = 0;
    irq_tick();
    TEST_ASSERT_EQUAL_UINT32(200000, app.late_ns);
}

static void test_after_more_than_a_period_the_clock_is_set_anew(void)
{
    start(1000);
    chip_advance_100ns(PERIOD + 35000u);
    irq_tick();
    TEST_ASSERT_EQUAL_UINT32(3500000, app.late_ns);
    TEST_ASSERT_EQUAL_UINT32(0, pass(PERIOD - 10u));
    TEST_ASSERT_EQUAL_UINT32(1, pass(10));
    TEST_ASSERT_EQUAL_UINT32(0, app.late_ns);
}

static void test_the_counter_may_wrap(void)
{
    tick_timer_begin(170);
    chip_advance_100ns(UINT32_MAX - 3u * PERIOD);
    TEST_ASSERT_TRUE(fdcan_begin(&can, 1000000));
    irq_start(&can, &handlers, 1000);
    TEST_ASSERT_EQUAL_UINT32(100, pass(100u * PERIOD));
    TEST_ASSERT_EQUAL_UINT32(0, app.late_ns);
}

static void test_a_new_period_counts_from_the_next_tick(void)
{
    start(1000);
    TEST_ASSERT_EQUAL_UINT32(1, pass(PERIOD));
    irq_period(8000);
    TEST_ASSERT_EQUAL_UINT8(0, chip_held());
    TEST_ASSERT_EQUAL_UINT32(1, pass(PERIOD));
    TEST_ASSERT_EQUAL_UINT32(0, pass(8u * PERIOD - 10u));
    TEST_ASSERT_EQUAL_UINT32(1, pass(10));
}

static void test_the_tick_is_above_the_receiver_and_kept_out_of_the_application(void)
{
    uint8_t tick = 0;
    uint8_t receive = 0;
    const struct fdcan_model_frame frame = {.id = 0x181, .dlc = 6};
    start(1000);
    TEST_ASSERT_TRUE(chip_interrupt_is_on(28, &tick));
    TEST_ASSERT_TRUE(chip_interrupt_is_on(21, &receive));
    TEST_ASSERT_TRUE(tick > 0u && tick < receive);
    TEST_ASSERT_TRUE(fdcan_model_receive(&frame) && fdcan_model_receive(&frame));
    TEST_ASSERT_TRUE(fdcan_model_interrupt());
    chip_advance_100ns(70);
    irq_can();
    TEST_ASSERT_EQUAL_UINT32(2, app.frames);
    TEST_ASSERT_EQUAL_UINT32(7, app.now_us);
    TEST_ASSERT_EQUAL_UINT8_MESSAGE(tick, app.held, "a tick could overlap receive");
    TEST_ASSERT_EQUAL_UINT8(0, chip_held());
    TEST_ASSERT_FALSE(fdcan_model_interrupt());
    irq_stop();
    TEST_ASSERT_FALSE(chip_interrupt_is_on(28, &tick));
    TEST_ASSERT_FALSE(chip_interrupt_is_on(21, &receive));
    chip_advance_100ns(3u * PERIOD);
    TEST_ASSERT_FALSE(chip_tick_pending());
}

static void expect_on_the_bus(uint32_t id)
{
    struct fdcan_model_frame frame;
    TEST_ASSERT_TRUE(fdcan_model_transmit(&frame));
    TEST_ASSERT_EQUAL_HEX32(id, frame.id);
    irq_can();
}

static void test_the_main_loop_stays_back_before_a_tick(void)
{
    const struct can_msg answer = {.id = 0x581, .len = 8};
    const struct can_msg sync = {.id = 0x080, .len = 1};
    start(1000);
    chip_advance_100ns(PERIOD - 1610u);
    TEST_ASSERT_TRUE(fdcan_send(&can, &answer, FDCAN_ORDINARY));
    expect_on_the_bus(0x581);
    chip_advance_100ns(20);
    TEST_ASSERT_TRUE(fdcan_send(&can, &answer, FDCAN_ORDINARY));
    TEST_ASSERT_EQUAL_UINT_MESSAGE(0, fdcan_model_waiting(), "SYNC would wait for it");
    chip_advance_100ns(1700); /* the tick is due, and held off */
    TEST_ASSERT_TRUE(fdcan_send(&can, &answer, FDCAN_ORDINARY));
    TEST_ASSERT_EQUAL_UINT(0, fdcan_model_waiting());
    irq_tick();
    TEST_ASSERT_TRUE(fdcan_send(&can, &sync, FDCAN_URGENT));
    expect_on_the_bus(0x080);
    expect_on_the_bus(0x581);
    expect_on_the_bus(0x581);
    irq_stop();
    chip_advance_100ns(PERIOD - 100u);
    TEST_ASSERT_TRUE(fdcan_send(&can, &answer, FDCAN_ORDINARY));
    expect_on_the_bus(0x581);
}

/* A frame takes longer than a period there. */
static void test_on_the_slowest_bus_the_main_loop_has_its_turn(void)
{
    const struct can_msg answer = {.id = 0x581, .len = 8};
    tick_timer_begin(170);
    TEST_ASSERT_TRUE(fdcan_begin(&can, 125000));
    irq_start(&can, &handlers, 1000);
    chip_advance_100ns(7000);
    TEST_ASSERT_TRUE(fdcan_send(&can, &answer, FDCAN_ORDINARY));
    expect_on_the_bus(0x581);
}

/* 32 kHz / 64 / 2000 = 4 s */
static void test_the_watchdog_is_fed_while_ticks_go_on(void)
{
    watchdog_start();
    TEST_ASSERT_EQUAL_HEX32(4, chip_peek(IWDG + 4u));
    TEST_ASSERT_EQUAL_UINT32(1999, chip_peek(IWDG + 8u));
    TEST_ASSERT_EQUAL_HEX32(0xAAAA, chip_peek(IWDG));
    const unsigned before = chip_writes(IWDG);
    for (uint32_t ticks = 1; ticks < 10u; ++ticks) {
        watchdog_feed(ticks);
        watchdog_feed(ticks);
        TEST_ASSERT_EQUAL_UINT(before + ticks, chip_writes(IWDG));
        TEST_ASSERT_EQUAL_HEX32(0xAAAA, chip_peek(IWDG));
    }
}

static void test_a_restart_by_the_watchdog_is_reported_once(void)
{
    TEST_ASSERT_FALSE(watchdog_has_reset());
    chip_poke(RCC + 0x94u, 1u << 29);
    TEST_ASSERT_TRUE(watchdog_has_reset());
    TEST_ASSERT_BITS_HIGH(1u << 23, chip_peek(RCC + 0x94u));
}

/* The ready bits of a chip whose crystal and PLL work. */
static void test_the_clock_tree(void)
{
    chip_poke(PWR + 0x80u, 1);
    chip_poke(RCC, 1u << 17 | 1u << 25);
    chip_poke(RCC + 8u, 3u << 2);
    TEST_ASSERT_TRUE(clock_begin());
    const uint32_t pll = chip_peek(RCC + 0xCu);
    const uint32_t divider = (pll >> 4 & 15u) + 1u;
    const uint32_t vco_mhz = 24u / divider * (pll >> 8 & 127u);
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(3, pll & 3u, "not from the crystal");
    TEST_ASSERT_TRUE_MESSAGE(vco_mhz >= 96u && vco_mhz <= 344u, "the oscillator's range");
    TEST_ASSERT_EQUAL_UINT32(CLOCK_MHZ, vco_mhz / (((pll >> 25 & 3u) + 1u) * 2u));
    TEST_ASSERT_BITS_HIGH(1u << 24, pll);
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(0, chip_peek(PWR + 0x80u), "no boost");
    TEST_ASSERT_EQUAL_HEX32_MESSAGE(0x704, flash_model_read(0x40022000u), "wait states, caches");
    TEST_ASSERT_EQUAL_HEX32_MESSAGE(3u << 2 | 3u, chip_peek(RCC + 8u), "the PLL, undivided");
    TEST_ASSERT_BITS_HIGH(1u << 28, chip_peek(RCC + 0x58u));
}

static void test_without_a_crystal_there_is_no_clock(void)
{
    TEST_ASSERT_FALSE(clock_begin());
    TEST_ASSERT_EQUAL_HEX32(0, chip_peek(RCC + 8u));
}

static void test_pins_are_given_to_their_peripherals(void)
{
    pins_begin();
    TEST_ASSERT_BITS_HIGH(1u, chip_peek(RCC + 0x4Cu));
    chip_poke(GPIOA, 0xABFFFFFFu); /* as after reset: SWD on 13 and 14 */
    pins_alternate(2, 12);
    pins_alternate(11, 9);
    pins_alternate(12, 9);
    TEST_ASSERT_EQUAL_HEX32(0xAABFFFEFu, chip_peek(GPIOA));
    TEST_ASSERT_EQUAL_HEX32(12u << 8, chip_peek(GPIOA + 0x20u));
    TEST_ASSERT_EQUAL_HEX32(9u << 12 | 9u << 16, chip_peek(GPIOA + 0x24u));
}

static void test_the_console_speaks(void)
{
    console_begin();
    TEST_ASSERT_EQUAL_UINT32(2u << 10, chip_peek(RCC + 0x88u));
    const double bits_s = 256.0 * 16e6 / chip_peek(LPUART1 + 0xCu);
    TEST_ASSERT_DOUBLE_WITHIN(10.0, 115200.0, bits_s);
    chip_poke(LPUART1 + 0x1Cu, 1u << 7);
    console_number("frames lost", -2147483647 - 1);
    TEST_ASSERT_EQUAL_UINT(strlen("hodograph: frames lost -2147483648\r\n"),
                           chip_writes(LPUART1 + 0x28u));
    console_hex("CFSR", 0x82);
    TEST_ASSERT_EQUAL_HEX32('\n', chip_peek(LPUART1 + 0x28u));
}

static void test_a_console_that_hangs_stops_nobody(void)
{
    console_number("x", 1);
    TEST_ASSERT_EQUAL_UINT(0, chip_writes(LPUART1 + 0x28u));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_clocks_of_the_port);
    RUN_TEST(test_ticks_come_a_period_apart);
    RUN_TEST(test_a_late_tick_is_reported_and_made_up_for);
    RUN_TEST(test_a_tick_that_outlasts_the_next_due_time_is_followed_at_once);
    RUN_TEST(test_after_more_than_a_period_the_clock_is_set_anew);
    RUN_TEST(test_the_counter_may_wrap);
    RUN_TEST(test_a_new_period_counts_from_the_next_tick);
    RUN_TEST(test_the_tick_is_above_the_receiver_and_kept_out_of_the_application);
    RUN_TEST(test_the_main_loop_stays_back_before_a_tick);
    RUN_TEST(test_on_the_slowest_bus_the_main_loop_has_its_turn);
    RUN_TEST(test_the_watchdog_is_fed_while_ticks_go_on);
    RUN_TEST(test_a_restart_by_the_watchdog_is_reported_once);
    RUN_TEST(test_the_clock_tree);
    RUN_TEST(test_without_a_crystal_there_is_no_clock);
    RUN_TEST(test_pins_are_given_to_their_peripherals);
    RUN_TEST(test_the_console_speaks);
    RUN_TEST(test_a_console_that_hangs_stops_nobody);
    return UNITY_END();
}
