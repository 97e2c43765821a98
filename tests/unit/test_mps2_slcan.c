/* SPDX-License-Identifier: MIT */
/* SLCAN on the UART of an emulated board: when the frames of a tick have left. The UART is a model; the core's
 * registers are stood in for here. Run by `make unit`; no I/O. */
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "unity.h"

#define PORT_CORTEX_M_CORE_H
#define PORT_MPS2_BOARD_H
#define BOARD_UART        uart_model()
#define BOARD_UART_NUMBER 0u

#define NOTHING_WRITTEN UINT32_MAX
#define SENT_MAX        65536u

static struct {
    struct {
        uint32_t data;
        uint32_t state;
        uint32_t control;
        uint32_t interrupts;
        uint32_t divider;
    } registers;
    uint32_t room; /* characters that its other end still takes */
    uint32_t sent;
    char text[SENT_MAX];
} model;

/* The port gets the registers at each access: the value written last is taken then. */
static void *uart_model(void)
{
    if (model.registers.data != NOTHING_WRITTEN) {
        TEST_ASSERT_GREATER_THAN_UINT32_MESSAGE(0, model.room, "written though it is full");
        TEST_ASSERT_LESS_THAN_UINT32(SENT_MAX, model.sent);
        model.text[model.sent++] = (char)model.registers.data;
        model.room--;
        model.registers.data = NOTHING_WRITTEN;
    }
    model.registers.state = model.room == 0u ? 1u : 0u;
    return &model.registers;
}

static uint32_t core_mask(void)
{
    return 0;
}

static void core_unmask(uint32_t before)
{
    (void)before;
}

static void core_enable(uint32_t number, uint8_t priority)
{
    (void)number;
    (void)priority;
}

static void core_pend(uint32_t number)
{
    (void)number;
}

#define self uart_self
#include "port/mps2/uart.c" /* NOLINT(bugprone-suspicious-include) */
#undef self
#define self link_self
#include "port/mps2/link_slcan.c" /* NOLINT(bugprone-suspicious-include) */
#undef self

static bool in_tick;

bool interrupts_in_tick(void)
{
    return in_tick;
}

void interrupts_receive(const struct can_msg *message)
{
    (void)message;
}

/* The other end takes so many characters, and the transmitter's interrupt requests more. */
static void let_out(uint32_t characters)
{
    model.room += characters;
    give_out();
    (void)uart_model();
}

static uint32_t waiting(void)
{
    return uart_self.head - uart_self.tail;
}

static int send_frame(uint16_t id, uint8_t len, bool from_tick)
{
    const struct can_msg message = {.id = id, .len = len};
    in_tick = from_tick;
    const int result = link_slcan.send(&message);
    in_tick = false;
    return result;
}

void setUp(void)
{
    const struct command_line line = {.fifo = false};
    memset(&uart_self, 0, sizeof uart_self);
    memset(&link_self, 0, sizeof link_self);
    memset(&model, 0, sizeof model);
    model.registers.data = NOTHING_WRITTEN;
    TEST_ASSERT_EQUAL_INT(0, link_slcan.begin(&line));
    let_out(100);
    model.room = 0;
    TEST_ASSERT_EQUAL_UINT32(0, waiting());
}

void tearDown(void)
{
}

static void test_before_the_first_tick_nothing_waits(void)
{
    TEST_ASSERT_TRUE(link_slcan.delivered());
}

static void test_frames_of_the_main_loop_are_not_waited_for(void)
{
    TEST_ASSERT_EQUAL_INT(0, send_frame(0x701, 1, false));
    TEST_ASSERT_GREATER_THAN_UINT32(0, waiting());
    TEST_ASSERT_TRUE(link_slcan.delivered());
}

/* SYNC and two setpoints, and after them one of the main loop. */
static void test_the_last_character_of_the_last_frame_of_a_tick_decides(void)
{
    TEST_ASSERT_EQUAL_INT(0, send_frame(0x601, 8, false));
    TEST_ASSERT_EQUAL_INT(0, send_frame(0x080, 1, true));
    TEST_ASSERT_EQUAL_INT(0, send_frame(0x202, 6, true));
    TEST_ASSERT_EQUAL_INT(0, send_frame(0x203, 6, true));
    const uint32_t of_tick = waiting();
    TEST_ASSERT_EQUAL_INT(0, send_frame(0x701, 1, false));
    for (uint32_t i = 0; i < of_tick; ++i) {
        TEST_ASSERT_FALSE(link_slcan.delivered());
        let_out(1);
    }
    TEST_ASSERT_TRUE(link_slcan.delivered());
    TEST_ASSERT_GREATER_THAN_UINT32(0, waiting());
    TEST_ASSERT_EQUAL_CHAR('\r', model.text[model.sent - 1u]);
}

static void test_the_next_tick_waits_anew(void)
{
    TEST_ASSERT_EQUAL_INT(0, send_frame(0x080, 1, true));
    let_out(waiting());
    TEST_ASSERT_TRUE(link_slcan.delivered());
    model.room = 0;
    TEST_ASSERT_EQUAL_INT(0, send_frame(0x080, 1, true));
    TEST_ASSERT_FALSE(link_slcan.delivered());
    let_out(waiting());
    TEST_ASSERT_TRUE(link_slcan.delivered());
}

/* A frame that was refused never leaves: only what was taken before it is waited for. */
static void test_a_refused_frame_is_not_waited_for(void)
{
    TEST_ASSERT_EQUAL_INT(0, send_frame(0x080, 1, true));
    const uint32_t of_tick = waiting();
    while (send_frame(0x601, 8, false) == 0) {
    }
    TEST_ASSERT_EQUAL_INT(PORT_ERR_FULL, send_frame(0x202, 8, true));
    let_out(of_tick - 1u);
    TEST_ASSERT_FALSE(link_slcan.delivered());
    let_out(1);
    TEST_ASSERT_TRUE(link_slcan.delivered());
}

/* The counts of characters wrap after some hours. */
static void test_counts_that_wrap(void)
{
    uart_self.head = UINT32_MAX - 3u;
    uart_self.tail = UINT32_MAX - 3u;
    link_self.mark = UINT32_MAX - 3u;
    TEST_ASSERT_TRUE(link_slcan.delivered());
    TEST_ASSERT_EQUAL_INT(0, send_frame(0x080, 1, true));
    const uint32_t of_tick = waiting();
    for (uint32_t i = 0; i < of_tick; ++i) {
        TEST_ASSERT_FALSE(link_slcan.delivered());
        let_out(1);
    }
    TEST_ASSERT_TRUE(link_slcan.delivered());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_before_the_first_tick_nothing_waits);
    RUN_TEST(test_frames_of_the_main_loop_are_not_waited_for);
    RUN_TEST(test_the_last_character_of_the_last_frame_of_a_tick_decides);
    RUN_TEST(test_the_next_tick_waits_anew);
    RUN_TEST(test_a_refused_frame_is_not_waited_for);
    RUN_TEST(test_counts_that_wrap);
    return UNITY_END();
}
