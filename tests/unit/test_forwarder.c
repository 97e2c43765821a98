/* SPDX-License-Identifier: MIT */
/* Tests of injector/forwarder.h: passes every frame between the controller's bus and the drives', and injects the
 * faults of the fault rules. Run by `make unit`; no I/O. */
#include "injector/forwarder.h"

#include <string.h>

#include "faults/fault_rules.h"
#include "injector/injector_options.h"
#include "unity.h"

enum { MOST = 64 };

static const enum fault_side CONTROLLER = FAULT_SIDE_CONTROLLER, DRIVES = FAULT_SIDE_DRIVES;

static struct fault_rules rules;
static struct forwarder forwarder;
static struct can_msg sent[MOST]; /* everything, oldest first */
static enum fault_side sent_to[MOST];
static unsigned sent_count, note_count, on_count;
static uint64_t now_ns;

static void take(void *context, enum fault_side to, const struct can_msg *frame)
{
    (void)context;
    TEST_ASSERT_TRUE(sent_count < MOST);
    sent_to[sent_count] = to;
    sent[sent_count++] = *frame;
}

static void note(void *context, const struct fault_trigger *trigger, enum fault_side from,
                 const struct can_msg *frame, bool on)
{
    (void)context;
    (void)trigger;
    (void)from;
    (void)frame;
    note_count++;
    on_count += on ? 1u : 0u;
}

void setUp(void)
{
    now_ns = 1000;
}

void tearDown(void)
{
}

static void frame_from(enum fault_side from, uint16_t id, uint8_t first)
{
    const struct can_msg frame = {.id = id, .len = 6, .data = {first, 1, 2, 3, 4, 5}};
    now_ns += 1000;
    forwarder_receive(&forwarder, from, &frame, now_ns);
}

static void sync(uint8_t counter)
{
    const struct can_msg frame = {.id = 0x80, .len = 1, .data = {counter}};
    now_ns += 1000;
    forwarder_receive(&forwarder, FAULT_SIDE_CONTROLLER, &frame, now_ns);
}

/* A forwarder with these rules, in motion: the next SYNC is tick 1 with counter 11. */
static void begin(const char *text)
{
    char reason[200] = "";
    const struct forwarder_port port = {take, note, NULL};
    TEST_ASSERT_EQUAL_INT_MESSAGE(
        0, fault_rules_parse(&rules, text, strlen(text), reason, sizeof reason), reason);
    forwarder_init(&forwarder, &rules, port);
    struct can_msg setpoint = {.id = 0x202, .len = 6, .data = {0x0F, 0, 1}};
    forwarder_receive(&forwarder, FAULT_SIDE_CONTROLLER, &setpoint, now_ns);
    setpoint.data[2] = 2;
    forwarder_receive(&forwarder, FAULT_SIDE_CONTROLLER, &setpoint, now_ns);
    sync(10);
    sent_count = note_count = on_count = 0;
}

static void expect(unsigned at, enum fault_side to, uint16_t id, uint8_t first)
{
    TEST_ASSERT_TRUE(at < sent_count);
    TEST_ASSERT_EQUAL_INT(to, sent_to[at]);
    TEST_ASSERT_EQUAL_HEX16(id, sent[at].id);
    TEST_ASSERT_EQUAL_UINT8(first, sent[at].data[0]);
}

static void test_without_rules_everything_passes(void)
{
    begin("stop at=0 node=2\n"); /* the drives' affair */
    frame_from(DRIVES, 0x182, 1);
    frame_from(CONTROLLER, 0x202, 2);
    sync(11);
    TEST_ASSERT_EQUAL_UINT(3, sent_count);
    expect(0, CONTROLLER, 0x182, 1);
    expect(1, DRIVES, 0x202, 2);
    expect(2, DRIVES, 0x80, 11);
    TEST_ASSERT_EQUAL_UINT(0, note_count);
    TEST_ASSERT_TRUE(forwarder_due_ns(&forwarder) == UINT64_MAX);
}

/* Those of the drives are passed over wherever they stand in the file. */
static void test_rules_of_both_kinds(void)
{
    begin("drop at=0 for=9 id=0x182\nstop at=0 node=2\nduplicate at=0 for=9 id=0x183\n");
    frame_from(DRIVES, 0x182, 1);
    frame_from(DRIVES, 0x183, 2);
    TEST_ASSERT_EQUAL_UINT(2, sent_count);
    expect(0, CONTROLLER, 0x183, 2);
    TEST_ASSERT_EQUAL_UINT(2, note_count);
    TEST_ASSERT_EQUAL_UINT(2, on_count);
}

static void test_as_many_rules_as_there_may_be(void)
{
    static const char line[] = "drop at=0 id=0x182\n";
    static char text[FAULT_RULES_MAX * sizeof line];
    for (unsigned i = 0; i < FAULT_RULES_MAX; i++) {
        memcpy(text + i * (sizeof line - 1u), line, sizeof line);
    }
    begin(text);
    TEST_ASSERT_EQUAL_UINT(FAULT_RULES_MAX, forwarder.count);
    TEST_ASSERT_TRUE(forwarder_due_ns(&forwarder) == UINT64_MAX);
    frame_from(DRIVES, 0x182, 1);
    TEST_ASSERT_EQUAL_UINT(FAULT_RULES_MAX, note_count);
    TEST_ASSERT_EQUAL_UINT(0, sent_count);
}

static void test_nothing_acts_before_motion(void)
{
    const struct forwarder_port port = {take, note, NULL};
    begin("drop at=0 id=0x182");
    forwarder_init(&forwarder, &rules, port);
    frame_from(DRIVES, 0x182, 1);
    sync(20);
    frame_from(DRIVES, 0x182, 2);
    TEST_ASSERT_EQUAL_UINT(3, sent_count);
    TEST_ASSERT_EQUAL_UINT(0, note_count);
}

static void test_drop_in_its_ticks(void)
{
    begin("drop at=1 for=2 id=0x182");
    for (uint8_t k = 0; k < 4; k++) {
        frame_from(DRIVES, 0x182, k);
        frame_from(DRIVES, 0x183, k);
        sync((uint8_t)(11 + k));
    }
    TEST_ASSERT_EQUAL_UINT(2, note_count);
    TEST_ASSERT_EQUAL_UINT(10, sent_count);
    expect(0, CONTROLLER, 0x182, 0);
    expect(3, CONTROLLER, 0x183, 1);
    expect(5, CONTROLLER, 0x183, 2);
    expect(7, CONTROLLER, 0x182, 3);
}

static void test_a_dropped_sync_begins_its_tick(void)
{
    begin("drop at=1 id=0x80\ncorrupt at=1 id=0x182 byte=0 xor=0x80");
    sync(11);
    TEST_ASSERT_EQUAL_UINT(0, sent_count);
    frame_from(DRIVES, 0x182, 1);
    sync(12);
    frame_from(DRIVES, 0x182, 1);
    TEST_ASSERT_EQUAL_UINT(3, sent_count);
    expect(0, CONTROLLER, 0x182, 0x81);
    expect(1, DRIVES, 0x80, 12);
    expect(2, CONTROLLER, 0x182, 1);
}

static void test_duplicate_and_short(void)
{
    begin("duplicate at=0 id=0x203\nshort at=0 id=0x203 len=2\nshort at=0 id=0x202 len=7");
    frame_from(CONTROLLER, 0x203, 9);
    frame_from(CONTROLLER, 0x202, 8);
    TEST_ASSERT_EQUAL_UINT(3, sent_count);
    expect(0, DRIVES, 0x203, 9);
    expect(1, DRIVES, 0x203, 9);
    TEST_ASSERT_EQUAL_UINT8(2, sent[0].len);
    TEST_ASSERT_EQUAL_UINT8(2, sent[1].len);
    TEST_ASSERT_EQUAL_UINT8(6, sent[2].len);
}

static void test_a_corrupt_byte_beyond_the_end_stays(void)
{
    begin("corrupt at=0 id=0x203 byte=6 xor=1");
    frame_from(CONTROLLER, 0x203, 9);
    TEST_ASSERT_EQUAL_UINT8(0, sent[0].data[6]);
}

static void test_delayed_frames_come_when_due(void)
{
    begin("delay at=0 for=9 id=0x182 us=50 count=2");
    frame_from(DRIVES, 0x182, 1);
    const uint64_t due_ns = now_ns + 50000;
    frame_from(DRIVES, 0x182, 2);
    frame_from(DRIVES, 0x182, 3);
    TEST_ASSERT_EQUAL_UINT(1, sent_count);
    expect(0, CONTROLLER, 0x182, 3);
    TEST_ASSERT_TRUE(forwarder_due_ns(&forwarder) == due_ns);
    forwarder_process(&forwarder, due_ns - 1);
    TEST_ASSERT_EQUAL_UINT(1, sent_count);
    forwarder_process(&forwarder, due_ns);
    expect(1, CONTROLLER, 0x182, 1);
    TEST_ASSERT_EQUAL_UINT(2, sent_count);
    forwarder_process(&forwarder, due_ns + 1000);
    expect(2, CONTROLLER, 0x182, 2);
    TEST_ASSERT_TRUE(forwarder_due_ns(&forwarder) == UINT64_MAX);
}

static void test_a_full_queue_delays_no_more_but_loses_nothing(void)
{
    begin("delay at=0 id=0x182 us=1000");
    for (unsigned i = 0; i <= DELAY_QUEUE_FRAMES; i++) {
        frame_from(DRIVES, 0x182, (uint8_t)i);
    }
    TEST_ASSERT_EQUAL_UINT(1, sent_count);
    expect(0, CONTROLLER, 0x182, (uint8_t)DELAY_QUEUE_FRAMES);
}

static void test_reorder_changes_places_with_the_next_of_its_direction(void)
{
    begin("reorder at=0 id=0x182");
    frame_from(DRIVES, 0x182, 1);
    frame_from(CONTROLLER, 0x202, 2);
    frame_from(DRIVES, 0x282, 3);
    TEST_ASSERT_EQUAL_UINT(3, sent_count);
    expect(0, DRIVES, 0x202, 2);
    expect(1, CONTROLLER, 0x282, 3);
    expect(2, CONTROLLER, 0x182, 1);
    TEST_ASSERT_TRUE(forwarder_due_ns(&forwarder) == UINT64_MAX);
    frame_from(DRIVES, 0x282, 4);
    TEST_ASSERT_EQUAL_UINT(4, sent_count);
}

static void test_reorder_does_not_wait_for_ever(void)
{
    begin("reorder at=0 id=0x182");
    frame_from(DRIVES, 0x182, 1);
    TEST_ASSERT_TRUE(forwarder_due_ns(&forwarder) == now_ns + 20000000u);
    forwarder_process(&forwarder, now_ns + 19999999u);
    TEST_ASSERT_EQUAL_UINT(0, sent_count);
    forwarder_process(&forwarder, now_ns + 20000000u);
    TEST_ASSERT_EQUAL_UINT(1, sent_count);
    TEST_ASSERT_TRUE(forwarder_due_ns(&forwarder) == UINT64_MAX);
}

static void test_reorder_of_the_controllers_frames(void)
{
    begin("reorder at=0 id=0x202");
    frame_from(CONTROLLER, 0x202, 1);
    TEST_ASSERT_TRUE(forwarder_due_ns(&forwarder) == now_ns + 20000000u);
    forwarder_process(&forwarder, now_ns + 20000000u);
    TEST_ASSERT_EQUAL_UINT(1, sent_count);
    expect(0, DRIVES, 0x202, 1);
}

static void test_flood_on_both_sides_in_its_ticks(void)
{
    begin("flood at=1 for=2 id=0x7A0 per_tick=3");
    sync(11);
    sync(12);
    sync(13);
    TEST_ASSERT_EQUAL_UINT(3 + 2 * 2 * 3, sent_count);
    expect(0, DRIVES, 0x80, 11);
    expect(1, CONTROLLER, 0x7A0, 0);
    expect(2, DRIVES, 0x7A0, 0);
    expect(6, DRIVES, 0x7A0, 2);
    expect(8, CONTROLLER, 0x7A0, 3);
    TEST_ASSERT_EQUAL_UINT8(8, sent[8].len);
    TEST_ASSERT_EQUAL_UINT(2, note_count); /* on, off */
    TEST_ASSERT_EQUAL_UINT(1, on_count);
}

static void test_time_alone_brings_no_flood(void)
{
    begin("flood at=1 for=2 id=0x7A0 per_tick=3");
    sync(11);
    forwarder_process(&forwarder, now_ns + 500000u);
    TEST_ASSERT_EQUAL_UINT(1 + 2 * 3, sent_count);
}

static void test_what_is_due_after_a_bus_off_is_sent(void)
{
    begin("delay at=0 id=0x182 us=9000\nbus-off at=1 side=controller for_ms=5");
    frame_from(DRIVES, 0x182, 1);
    sync(11);
    TEST_ASSERT_EQUAL_UINT(0, sent_count);
    forwarder_process(&forwarder, now_ns + 9000000u);
    TEST_ASSERT_EQUAL_UINT(1, sent_count);
    expect(0, CONTROLLER, 0x182, 1);
}

static void test_bus_off_for_a_time(void)
{
    begin("bus-off at=1 side=drives for_ms=5");
    sync(11);
    frame_from(DRIVES, 0x182, 1);
    frame_from(CONTROLLER, 0x202, 2);
    TEST_ASSERT_EQUAL_UINT(0, sent_count);
    TEST_ASSERT_EQUAL_UINT(1, on_count);
    TEST_ASSERT_TRUE(forwarder_due_ns(&forwarder) == now_ns - 2000 + 5000000);
    now_ns += 5000000;
    forwarder_process(&forwarder, now_ns);
    TEST_ASSERT_EQUAL_UINT(2, note_count);
    TEST_ASSERT_TRUE(forwarder_due_ns(&forwarder) == UINT64_MAX);
    frame_from(DRIVES, 0x182, 3);
    TEST_ASSERT_EQUAL_UINT(1, sent_count);
    expect(0, CONTROLLER, 0x182, 3);
}

static void test_bus_off_takes_what_was_held_or_delayed(void)
{
    begin("delay at=0 id=0x182 us=1000\nreorder at=0 id=0x183\nbus-off at=1 side=controller "
          "for_ms=100");
    frame_from(DRIVES, 0x182, 1);
    frame_from(DRIVES, 0x183, 2);
    sync(11);
    forwarder_process(&forwarder, now_ns + 50000000u);
    TEST_ASSERT_EQUAL_UINT(0, sent_count);
    now_ns += 200000000u;
    forwarder_process(&forwarder, now_ns);
    TEST_ASSERT_TRUE(forwarder_due_ns(&forwarder) == UINT64_MAX);
    frame_from(DRIVES, 0x283, 3);
    TEST_ASSERT_EQUAL_UINT(1, sent_count);
}

static void test_a_flood_reaches_the_side_that_is_on(void)
{
    begin("flood at=1 id=0x7A0 per_tick=2\nbus-off at=1 side=drives");
    sync(11);
    TEST_ASSERT_EQUAL_UINT(2, sent_count);
    expect(0, CONTROLLER, 0x7A0, 0);
    begin("flood at=1 id=0x7A0 per_tick=2\nbus-off at=1 side=controller");
    sync(11);
    TEST_ASSERT_EQUAL_UINT(2, sent_count);
    expect(0, DRIVES, 0x7A0, 0);
}

static enum injector_options_result options(int argc, char **argv, const char *part)
{
    char reason[200] = "";
    struct injector_options read;
    const enum injector_options_result result =
        injector_options_parse(&read, argc, argv, reason, sizeof reason);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(reason, part), reason);
    return result;
}

static void test_options(void)
{
    char *good[] = {"i", "--bus", "vcan0", "--verbose", "--bus", "vcan1", "--rules", "file"};
    char *same[] = {"i", "--bus", "vcan0", "--bus", "vcan0"};
    char *help[] = {"i", "--help"};
    char *unknown[] = {"i", "--bos", "vcan0"};
    TEST_ASSERT_EQUAL_INT(INJECTOR_OPTIONS_OK, options(8, good, ""));
    TEST_ASSERT_EQUAL_INT(INJECTOR_OPTIONS_HELP, options(2, help, ""));
    TEST_ASSERT_EQUAL_INT(INJECTOR_OPTIONS_WRONG, options(3, good, "two buses are needed"));
    TEST_ASSERT_EQUAL_INT(INJECTOR_OPTIONS_WRONG, options(7, good, "a value must follow"));
    TEST_ASSERT_EQUAL_INT(INJECTOR_OPTIONS_WRONG, options(5, same, "not twice vcan0"));
    TEST_ASSERT_EQUAL_INT(INJECTOR_OPTIONS_WRONG, options(3, unknown, "--bos"));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_without_rules_everything_passes);
    RUN_TEST(test_rules_of_both_kinds);
    RUN_TEST(test_as_many_rules_as_there_may_be);
    RUN_TEST(test_nothing_acts_before_motion);
    RUN_TEST(test_drop_in_its_ticks);
    RUN_TEST(test_a_dropped_sync_begins_its_tick);
    RUN_TEST(test_duplicate_and_short);
    RUN_TEST(test_a_corrupt_byte_beyond_the_end_stays);
    RUN_TEST(test_delayed_frames_come_when_due);
    RUN_TEST(test_a_full_queue_delays_no_more_but_loses_nothing);
    RUN_TEST(test_reorder_changes_places_with_the_next_of_its_direction);
    RUN_TEST(test_reorder_does_not_wait_for_ever);
    RUN_TEST(test_reorder_of_the_controllers_frames);
    RUN_TEST(test_flood_on_both_sides_in_its_ticks);
    RUN_TEST(test_time_alone_brings_no_flood);
    RUN_TEST(test_what_is_due_after_a_bus_off_is_sent);
    RUN_TEST(test_bus_off_for_a_time);
    RUN_TEST(test_bus_off_takes_what_was_held_or_delayed);
    RUN_TEST(test_a_flood_reaches_the_side_that_is_on);
    RUN_TEST(test_options);
    return UNITY_END();
}
