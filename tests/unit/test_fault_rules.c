/* SPDX-License-Identifier: MIT */
/* Tests of fault rules: their text, and when and how they act (sim/faults). Run by `make unit`; writes temporary
 * files. */
#define _POSIX_C_SOURCE 200809L /* mkstemp */

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "faults/fault_log.h"
#include "faults/fault_rules.h"
#include "faults/fault_trigger.h"
#include "unity.h"

static struct fault_rules rules;
static char reason[256];

void setUp(void)
{
    memset(&rules, 0, sizeof rules);
    reason[0] = '\0';
}

void tearDown(void)
{
}

static void parse(const char *text)
{
    TEST_ASSERT_EQUAL_INT_MESSAGE(
        0, fault_rules_parse(&rules, text, strlen(text), reason, sizeof reason), reason);
}

static void refused(const char *text, const char *part)
{
    TEST_ASSERT_EQUAL_INT(FAULT_RULES_WRONG,
                          fault_rules_parse(&rules, text, strlen(text), reason, sizeof reason));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(reason, part), reason);
    TEST_ASSERT_NULL(strchr(reason, '\n'));
}

static void test_every_kind_and_key(void)
{
    parse("# a comment\n"
          "\n"
          "drop at=5 id=0x182 for=3 count=2 p=0.25 seed=7   # the rest\r\n"
          "duplicate\tat=0 id=386\n"
          "delay at=1 id=0x203 us=1500\n"
          "reorder at=1 id=0x202\n"
          "corrupt at=2 id=0x7FF byte=7 xor=0xFF\n"
          "short at=2 id=0 len=0\n"
          "flood at=3 id=0x7A0 per_tick=4 for_ms=20\n"
          "bus-off at=3 side=drives for=9\n"
          "stop at=4 node=2\nrestart at=4 node=127\nheartbeat-stop at=4 node=3 for=1000\n"
          "encoder-freeze at=4 node=2\nencoder-jump at=4 node=2 counts=-250000\n"
          "encoder-fault at=4 node=2\nsaturate at=4 node=2 volts=.5\nload at=4 node=3 volts=-1.25\n"
          "limit-switch at=6 node=2 side=positive\nfault at=6 node=3 code=0x3210");
    TEST_ASSERT_EQUAL_UINT32(FAULT_KINDS, rules.count);
    for (uint32_t i = 0; i < FAULT_KINDS; i++) {
        TEST_ASSERT_EQUAL_INT((int)i, (int)rules.rules[i].kind);
    }
    const struct fault_rule *drop = &rules.rules[0], *flood = &rules.rules[6];
    TEST_ASSERT_EQUAL_UINT32(3, drop->line);
    TEST_ASSERT_EQUAL_UINT32(5, drop->at);
    TEST_ASSERT_EQUAL_UINT32(3, drop->for_ticks);
    TEST_ASSERT_EQUAL_UINT32(2, drop->count);
    TEST_ASSERT_EQUAL_UINT32(7, drop->seed);
    TEST_ASSERT_EQUAL_HEX16(0x182, drop->id);
    TEST_ASSERT_TRUE(drop->p == 0.25);
    TEST_ASSERT_EQUAL_HEX16(386, rules.rules[1].id);
    TEST_ASSERT_EQUAL_UINT32(1, rules.rules[1].for_ticks);
    TEST_ASSERT_EQUAL_UINT32(1500, rules.rules[2].delay_us);
    TEST_ASSERT_EQUAL_HEX8(0xFF, rules.rules[4].mask);
    TEST_ASSERT_EQUAL_UINT8(7, rules.rules[4].byte);
    TEST_ASSERT_EQUAL_UINT32(4, flood->per_tick);
    TEST_ASSERT_EQUAL_UINT32(20, flood->for_ms);
    TEST_ASSERT_EQUAL_UINT32(0, flood->for_ticks);
    TEST_ASSERT_EQUAL_INT(FAULT_SIDE_DRIVES, rules.rules[7].side);
    TEST_ASSERT_EQUAL_UINT8(127, rules.rules[9].node);
    TEST_ASSERT_EQUAL_INT32(-250000, rules.rules[12].counts);
    TEST_ASSERT_EQUAL_UINT32(FAULT_FOR_EVER, rules.rules[12].for_ticks);
    TEST_ASSERT_TRUE(rules.rules[14].volts == 0.5 && rules.rules[15].volts == -1.25);
    TEST_ASSERT_EQUAL_INT(FAULT_SIDE_POSITIVE, rules.rules[16].side);
    TEST_ASSERT_EQUAL_HEX16(0x3210, rules.rules[17].code);
}

static void test_what_is_wrong_is_said_with_its_line(void)
{
    refused("drop at=1 id=1\nbreak at=1", "line 2: there is no kind of fault 'break'");
    refused("drop id=1", "line 1: drop needs at=");
    refused("\n\nstop at=1", "line 3: stop needs node=");
    refused("drop at=1 id=1 for", "key=value is needed, not 'for'");
    refused("drop at=1 id=1 foo=1", "there is no key 'foo'");
    refused("drop at=1 id=1 node=2", "no key 'node'");
    refused("drop at=1 at=2 id=1", "given twice: 'at'");
    refused("drop at=1 id=0x800", "'id=0x800'");
    refused("drop at=-1 id=1", "'at=-1'");
    refused("drop at=1.5 id=1", "'at=1.5'");
    refused("drop at= id=1", "'at='");
    refused("drop at=1 id=0x", "'id=0x'");
    refused("drop at=1 id=1 p=nan", "'p=nan'");
    refused("drop at=1 id=1 p=1.01", "'p=1.01'");
    refused("drop at=1 id=1 for=0", "'for=0'");
    refused("drop at=1 id=1 for=1 for_ms=1", "not both");
    refused("bus-off at=1 side=left", "'side=left'");
    refused("bus-off at=1 side=positive", "'side=positive'");
    refused("limit-switch at=1 node=2 side=drives", "'side=drives'");
    refused("encoder-jump at=1 node=2 counts=2147483648", "counts=2147483648");
    refused("saturate at=1 node=2 volts=0", "'volts=0'");
    refused("encoder-jump at=1 node=2 counts=-2147483649", "counts=-2147483649");
    refused("fault at=1 node=2 code=0", "'code=0'");
    refused("stop at=1 node=0", "'node=0'");
    refused("restart at=1 node=2 for=2", "no key 'for'");
}

static void test_bounds_of_text(void)
{
    static char text[20 * (FAULT_RULES_MAX + 1u)];
    size_t used = 0;
    for (unsigned i = 0; i <= FAULT_RULES_MAX; i++) {
        used += (size_t)snprintf(text + used, sizeof text - used, "drop at=1 id=1\n");
    }
    refused(text, "line 65: too many rules");
    char line[FAULT_LINE_MAX + 3u];
    memset(line, '#', sizeof line);
    line[sizeof line - 1u] = '\0';
    refused(line, "line 1: longer");
    line[FAULT_LINE_MAX] = '\0';
    parse(line);
    static const char nul[] = "drop at=1 id=1\n\0drop";
    TEST_ASSERT_EQUAL_INT(FAULT_RULES_WRONG,
                          fault_rules_parse(&rules, nul, sizeof nul - 1u, reason, sizeof reason));
    TEST_ASSERT_NOT_NULL(strstr(reason, "line 2"));
}

static void test_a_file_that_is_not_there(void)
{
    TEST_ASSERT_EQUAL_INT(-1, fault_rules_read(&rules, "/no/such/rules", reason, sizeof reason));
    TEST_ASSERT_EQUAL_STRING("/no/such/rules: No such file or directory", reason);
}

static void write_file(const char *path, const char *text, size_t times)
{
    FILE *file = fopen(path, "wb");
    TEST_ASSERT_NOT_NULL(file);
    for (size_t i = 0; i < times; i++) {
        TEST_ASSERT_EQUAL_UINT(strlen(text), fwrite(text, 1, strlen(text), file));
    }
    TEST_ASSERT_EQUAL_INT(0, fclose(file));
}

static void test_a_file_of_rules(void)
{
    char path[] = "/tmp/hodograph-rules-XXXXXX";
    const int opened = mkstemp(path);
    TEST_ASSERT_GREATER_OR_EQUAL_INT(0, opened);
    TEST_ASSERT_EQUAL_INT(0, close(opened));
    write_file(path, "# two\ndrop at=5 id=0x182\nstop at=4 node=2\n", 1);
    TEST_ASSERT_EQUAL_INT(0, fault_rules_read(&rules, path, reason, sizeof reason));
    TEST_ASSERT_EQUAL_UINT32(2, rules.count);
    TEST_ASSERT_EQUAL_UINT32(3, rules.rules[1].line);
    write_file(path, "drop at=5\n", 1);
    TEST_ASSERT_EQUAL_INT(-1, fault_rules_read(&rules, path, reason, sizeof reason));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(reason, ": line 1: drop needs id="), reason);
    write_file(path, "# 16 characters\n", FAULT_FILE_MAX / 16u);
    TEST_ASSERT_EQUAL_INT(0, fault_rules_read(&rules, path, reason, sizeof reason));
    write_file(path, "# 17 characters!\n", FAULT_FILE_MAX / 16u);
    TEST_ASSERT_EQUAL_INT(-1, fault_rules_read(&rules, path, reason, sizeof reason));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(reason, "longer than 16384 bytes"), reason);
    TEST_ASSERT_EQUAL_INT(0, remove(path));
}

static void test_lines_of_the_log(void)
{
    static const char expected[] = "{\"t_ns\":12,\"tick\":5,\"line\":1,\"kind\":\"drop\","
                                   "\"from\":\"drives\",\"id\":386,\"data\":\"00af10\"}\n"
                                   "{\"t_ns\":13,\"tick\":-1,\"line\":2,\"kind\":\"stop\","
                                   "\"node\":3,\"on\":true}\n";
    char text[400] = "";
    const struct can_msg frame = {.id = 386, .len = 3, .data = {0, 0xAF, 0x10, 0xFF}};
    parse("drop at=5 id=386\nstop at=0 node=3\n");
    const struct fault_event drop = {&rules.rules[0], 12, 5}, stop = {&rules.rules[1], 13, -1};
    FILE *log = tmpfile();
    TEST_ASSERT_NOT_NULL(log);
    fault_log_frame(log, &drop, FAULT_SIDE_DRIVES, &frame);
    fault_log_state(log, &stop, true);
    rewind(log);
    TEST_ASSERT_EQUAL_UINT(strlen(expected), fread(text, 1, sizeof text - 1u, log));
    TEST_ASSERT_EQUAL_INT(0, fclose(log));
    TEST_ASSERT_EQUAL_STRING(expected, text);
}

static void test_ticks_and_frames_of_a_rule(void)
{
    struct fault_trigger trigger;
    const struct can_msg frame = {.id = 0x182}, other = {.id = 0x183};
    parse("drop at=5 id=0x182 for=10 count=2");
    fault_trigger_init(&trigger, &rules.rules[0]);
    TEST_ASSERT_FALSE(fault_trigger_acts(&trigger, -1, 1));
    TEST_ASSERT_FALSE(fault_trigger_acts(&trigger, 4, 1));
    TEST_ASSERT_TRUE(fault_trigger_acts(&trigger, 5, 1));
    TEST_ASSERT_TRUE(fault_trigger_acts(&trigger, 14, 1));
    TEST_ASSERT_FALSE(fault_trigger_acts(&trigger, 15, 1));
    TEST_ASSERT_FALSE(fault_trigger_takes(&trigger, &other));
    TEST_ASSERT_TRUE(fault_trigger_takes(&trigger, &frame));
    TEST_ASSERT_TRUE(fault_trigger_acts(&trigger, 6, 1));
    TEST_ASSERT_TRUE(fault_trigger_takes(&trigger, &frame));
    TEST_ASSERT_FALSE(fault_trigger_acts(&trigger, 6, 1));
}

static void test_wall_time_of_a_rule(void)
{
    struct fault_trigger trigger;
    parse("bus-off at=5 side=drives for_ms=20");
    fault_trigger_init(&trigger, &rules.rules[0]);
    TEST_ASSERT_FALSE(fault_trigger_acts(&trigger, 4, 1000000));
    TEST_ASSERT_TRUE(fault_trigger_acts(&trigger, 5, 2000000));
    TEST_ASSERT_TRUE(fault_trigger_acts(&trigger, 500, 21999999));
    TEST_ASSERT_FALSE(fault_trigger_acts(&trigger, 5, 22000000));
}

static void test_probability_is_met_and_repeats(void)
{
    struct fault_trigger trigger, again;
    const struct can_msg frame = {.id = 0x182};
    unsigned hits = 0;
    parse("drop at=0 id=0x182 for=1000000 p=0.3 seed=42");
    fault_trigger_init(&trigger, &rules.rules[0]);
    fault_trigger_init(&again, &rules.rules[0]);
    for (unsigned i = 0; i < 10000; i++) {
        const bool hit = fault_trigger_takes(&trigger, &frame);
        TEST_ASSERT_EQUAL(hit, fault_trigger_takes(&again, &frame));
        hits += hit ? 1u : 0u;
    }
    TEST_ASSERT_UINT_WITHIN(150, 3000, hits); /* more than three deviations of 46 */
}

/* SplitMix64 of the seed, computed elsewhere: a scenario is the same on every machine and for ever. */
static void test_which_frames_a_seed_takes(void)
{
    static const unsigned expected[] = {1, 5, 8, 10, 21, 26, 31, 36, 38, 39};
    struct fault_trigger trigger;
    const struct can_msg frame = {.id = 0x182};
    unsigned hits = 0;
    parse("drop at=0 id=0x182 for=100 p=0.25 seed=7");
    fault_trigger_init(&trigger, &rules.rules[0]);
    for (unsigned i = 0; i < 40u; i++) {
        if (fault_trigger_takes(&trigger, &frame)) {
            TEST_ASSERT_LESS_THAN_UINT(sizeof expected / sizeof expected[0], hits);
            TEST_ASSERT_EQUAL_UINT(expected[hits], i);
            hits++;
        }
    }
    TEST_ASSERT_EQUAL_UINT(sizeof expected / sizeof expected[0], hits);
}

static bool sync(struct fault_ticks *count, uint8_t counter)
{
    const struct can_msg in = {.id = 0x80, .len = 1, .data = {counter}};
    return fault_ticks_receive(count, &in);
}

static void setpoint(struct fault_ticks *count, uint8_t node, uint8_t control, uint8_t target)
{
    const struct can_msg in = {.id = 0x200u + node, .len = 6, .data = {control, 0, target}};
    TEST_ASSERT_FALSE(fault_ticks_receive(count, &in));
}

static void test_tick_0_is_the_sync_after_the_first_step(void)
{
    struct fault_ticks count;
    fault_ticks_init(&count);
    setpoint(&count, 2, 0x06, 1); /* not enabled: the target follows the axis */
    setpoint(&count, 2, 0x0F, 2);
    TEST_ASSERT_FALSE(sync(&count, 7));
    setpoint(&count, 3, 0x0F, 9); /* another drive */
    setpoint(&count, 2, 0x0F, 2);
    TEST_ASSERT_FALSE(sync(&count, 8));
    TEST_ASSERT_EQUAL_INT64(-1, count.tick);
    setpoint(&count, 3, 0x0F, 10);
    TEST_ASSERT_EQUAL_INT64(-1, count.tick);
    TEST_ASSERT_TRUE(sync(&count, 9));
    TEST_ASSERT_EQUAL_INT64(0, count.tick);
    TEST_ASSERT_TRUE(sync(&count, 10));
    TEST_ASSERT_EQUAL_INT64(1, count.tick);
}

/* A step of the target in any of its bytes, by any drive's RPDO1 and no other frame. */
static void test_every_byte_of_a_target_counts(void)
{
    for (unsigned at = 2; at < 6; at++) {
        struct fault_ticks count;
        struct can_msg in = {.id = 0x27F, .len = 6, .data = {0x0F, 0, 1, 1, 1, 1}};
        fault_ticks_init(&count);
        (void)fault_ticks_receive(&count, &in);
        (void)fault_ticks_receive(&count, &in);
        TEST_ASSERT_FALSE(sync(&count, 1));
        in.data[at] = 0x81;
        (void)fault_ticks_receive(&count, &in);
        TEST_ASSERT_TRUE(sync(&count, 2));
    }
}

static void test_frames_that_are_no_setpoints(void)
{
    static const uint32_t others[] = {0x200, 0x280, 0x182};
    struct fault_ticks count;
    fault_ticks_init(&count);
    for (unsigned i = 0; i < sizeof others / sizeof others[0]; i++) {
        struct can_msg in = {.id = others[i], .len = 6, .data = {0x0F, 0, 1}};
        (void)fault_ticks_receive(&count, &in);
        in.data[2] = 2;
        (void)fault_ticks_receive(&count, &in);
        TEST_ASSERT_FALSE(sync(&count, (uint8_t)(i + 1u)));
    }
}

static void test_ticks_go_by_the_counter(void)
{
    struct fault_ticks count;
    fault_ticks_init(&count);
    setpoint(&count, 2, 0x0F, 1);
    setpoint(&count, 2, 0x0F, 2);
    (void)sync(&count, 238);
    TEST_ASSERT_TRUE(sync(&count, 240));
    TEST_ASSERT_EQUAL_INT64(2, count.tick);
    TEST_ASSERT_FALSE(sync(&count, 240)); /* twice */
    TEST_ASSERT_TRUE(sync(&count, 1));
    TEST_ASSERT_EQUAL_INT64(3, count.tick);
    const struct can_msg plain = {.id = 0x80}; /* a SYNC without a counter */
    TEST_ASSERT_TRUE(fault_ticks_receive(&count, &plain));
    TEST_ASSERT_EQUAL_INT64(4, count.tick);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_kind_and_key);
    RUN_TEST(test_what_is_wrong_is_said_with_its_line);
    RUN_TEST(test_bounds_of_text);
    RUN_TEST(test_a_file_that_is_not_there);
    RUN_TEST(test_a_file_of_rules);
    RUN_TEST(test_lines_of_the_log);
    RUN_TEST(test_ticks_and_frames_of_a_rule);
    RUN_TEST(test_wall_time_of_a_rule);
    RUN_TEST(test_probability_is_met_and_repeats);
    RUN_TEST(test_which_frames_a_seed_takes);
    RUN_TEST(test_tick_0_is_the_sync_after_the_first_step);
    RUN_TEST(test_every_byte_of_a_target_counts);
    RUN_TEST(test_frames_that_are_no_setpoints);
    RUN_TEST(test_ticks_go_by_the_counter);
    return UNITY_END();
}
