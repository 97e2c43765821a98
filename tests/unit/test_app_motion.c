/* SPDX-License-Identifier: MIT */
/* Hold, resume, override and start from a position, through the dictionary, on a bus without delays. Run by
 * `make unit`; no I/O. */
#include "app/commands.h"
#include "app_bench.h"
#include "app_image.h"
#include "canopen/sdo_abort.h"
#include "unity.h"

#define X_COUNTS      10000000
#define Y_COUNTS      (-5000000)
#define LENGTH_COUNTS 4000000

static struct app_bench bench;
static uint8_t image[APP_IMAGE_SIZE];

static const struct machine *machine(void)
{
    return &bench.controller.machine;
}

static void command(unsigned number)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, number));
}

static void refused(unsigned number, enum machine_refusal refusal)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, app_bench_command(&bench, number));
    TEST_ASSERT_EQUAL_INT(refusal, app_bench_read(&bench, 0x2003, 4));
}

void setUp(void)
{
    app_bench_init(&bench, X_COUNTS, Y_COUNTS);
    app_image_make(image, 10, -5);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_upload(&bench, image, sizeof image));
    app_bench_make_ready(&bench);
}

void tearDown(void)
{
}

static void finish_at_the_end(void)
{
    (void)app_bench_until(&bench, MACHINE_READY, 5000);
    TEST_ASSERT_EQUAL_INT32(X_COUNTS + LENGTH_COUNTS, bench.drives[0].position_counts);
    TEST_ASSERT_EQUAL_INT32(Y_COUNTS, bench.drives[1].position_counts);
    TEST_ASSERT_TRUE(bench.drives[0].worst_step_counts <= 15001);
    TEST_ASSERT_EQUAL_UINT32(0, app_bench_read(&bench, 0x2003, 1));
}

static void test_hold_and_resume(void)
{
    command(COMMAND_START);
    app_bench_periods(&bench, 250);
    command(COMMAND_HOLD);
    TEST_ASSERT_EQUAL_INT(MACHINE_HOLDING, app_bench_read(&bench, 0x2002, 0));
    command(COMMAND_HOLD);
    (void)app_bench_until(&bench, MACHINE_HELD, 1000);
    TEST_ASSERT_EQUAL_INT(0, app_bench_read(&bench, 0x2009, 2));
    TEST_ASSERT_EQUAL_INT(0, app_bench_read(&bench, 0x2010, 2));
    const int32_t held_counts = machine()->axes[0].target_counts;
    TEST_ASSERT_TRUE(held_counts > X_COUNTS && held_counts < X_COUNTS + LENGTH_COUNTS);
    TEST_ASSERT_TRUE(machine_busy(machine())); /* not yet still */
    app_bench_periods(&bench, 500);
    TEST_ASSERT_FALSE(machine_busy(machine()));
    TEST_ASSERT_EQUAL_INT32(held_counts, bench.drives[0].position_counts);
    refused(COMMAND_START, MACHINE_MOVING);
    refused(COMMAND_DISABLE, MACHINE_MOVING);
    command(COMMAND_RESUME);
    TEST_ASSERT_EQUAL_INT(MACHINE_RUNNING, app_bench_read(&bench, 0x2002, 0));
    command(COMMAND_RESUME);
    finish_at_the_end();
}

static void test_stop_from_a_hold(void)
{
    command(COMMAND_START);
    app_bench_periods(&bench, 250);
    command(COMMAND_HOLD);
    (void)app_bench_until(&bench, MACHINE_HELD, 1000);
    command(COMMAND_STOP);
    TEST_ASSERT_EQUAL_INT(MACHINE_STOPPING, machine()->state);
    refused(COMMAND_RESUME, MACHINE_NOT_RUNNING);
    (void)app_bench_until(&bench, MACHINE_READY, 1000);
    TEST_ASSERT_TRUE(bench.drives[0].position_counts < X_COUNTS + LENGTH_COUNTS);
}

static void test_fault_while_held(void)
{
    command(COMMAND_START);
    app_bench_periods(&bench, 250);
    command(COMMAND_HOLD);
    (void)app_bench_until(&bench, MACHINE_HELD, 1000);
    bench.drives[1].dead = true;
    (void)app_bench_until(&bench, MACHINE_FAULT, 1000);
    refused(COMMAND_RESUME, MACHINE_FAULT_PRESENT);
    refused(COMMAND_HOLD, MACHINE_FAULT_PRESENT);
    app_bench_periods(&bench, 8);
    TEST_ASSERT_EQUAL_INT(MACHINE_FAULT_OFF, machine()->fault_phase);
}

static void test_nothing_to_hold(void)
{
    refused(COMMAND_HOLD, MACHINE_NOT_RUNNING);
    refused(COMMAND_RESUME, MACHINE_NOT_RUNNING);
}

/* A hold too late: the program ends by itself. */
static void test_hold_near_the_end(void)
{
    command(COMMAND_START);
    app_bench_periods(&bench, 490);
    command(COMMAND_HOLD);
    finish_at_the_end();
}

static void test_override(void)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2010, 1, 50, 2));
    TEST_ASSERT_EQUAL_INT(50, app_bench_read(&bench, 0x2010, 1));
    TEST_ASSERT_EQUAL_INT(0, app_bench_read(&bench, 0x2010, 2));
    command(COMMAND_START);
    app_bench_periods(&bench, 500);
    TEST_ASSERT_EQUAL_INT(1 << 29, app_bench_read(&bench, 0x2010, 2));
    TEST_ASSERT_EQUAL_INT(0, app_bench_read(&bench, 0x2010, 3));
    TEST_ASSERT_INT_WITHIN(20, 7500, app_bench_read(&bench, 0x2009, 2));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2010, 1, 200, 2));
    app_bench_periods(&bench, 150);
    TEST_ASSERT_EQUAL_INT(1 << 30,
                          app_bench_read(&bench, 0x2010, 2)); /* its pieces allow no more */
    TEST_ASSERT_EQUAL_INT(1, app_bench_read(&bench, 0x2010, 3));
    finish_at_the_end();
    TEST_ASSERT_EQUAL_INT(200, app_bench_read(&bench, 0x2010, 1));
    TEST_ASSERT_EQUAL_INT(0, app_bench_read(&bench, 0x2010, 3));
}

static void test_no_override_beyond_200(void)
{
    TEST_ASSERT_TRUE(SDO_OK != app_bench_write(&bench, 0x2010, 1, 201, 2));
    TEST_ASSERT_EQUAL_INT(100, app_bench_read(&bench, 0x2010, 1));
}

static void test_start_from_where_it_stopped(void)
{
    command(COMMAND_START);
    app_bench_periods(&bench, 200);
    command(COMMAND_STOP);
    (void)app_bench_until(&bench, MACHINE_READY, 2000);
    const int64_t arc_q40_mm = app_bench_read(&bench, 0x2009, 1);
    const int32_t stopped_counts = bench.drives[0].position_counts;
    app_bench_periods(&bench, AXIS_STANDSTILL_SYNCS);
    refused(COMMAND_START, MACHINE_AWAY_FROM_START);
    refused(COMMAND_START_FROM, MACHINE_AWAY_FROM_START);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2011, 0, (uint64_t)arc_q40_mm, 8));
    command(COMMAND_START_FROM);
    TEST_ASSERT_EQUAL_INT(MACHINE_RUNNING, machine()->state);
    app_bench_periods(&bench, 3);
    TEST_ASSERT_INT32_WITHIN(100, stopped_counts, bench.drives[0].position_counts);
    finish_at_the_end();
}

/* Such feeds pass the check of a program where no limit is configured. */
static void test_feed_saturates(void)
{
    static struct motion motion;
    command(COMMAND_START);
    app_bench_periods(&bench, 250);
    motion = bench.controller.machine.motion;
    TEST_ASSERT_INT_WITHIN(20, 15000, motion_feed_um_s(&motion));
    motion.feed.point.feed_q32_mm_s = INT64_C(2147483) << 32;
    TEST_ASSERT_EQUAL_INT32(2147483000, motion_feed_um_s(&motion));
    motion.feed.point.feed_q32_mm_s = INT64_C(2147484) << 32;
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, motion_feed_um_s(&motion));
    motion.feed.point.feed_q32_mm_s = INT64_MAX;
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, motion_feed_um_s(&motion));
    motion.feed.point.feed_q32_mm_s = INT64_MIN;
    TEST_ASSERT_EQUAL_INT32(-INT32_MAX, motion_feed_um_s(&motion));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_hold_and_resume);
    RUN_TEST(test_stop_from_a_hold);
    RUN_TEST(test_fault_while_held);
    RUN_TEST(test_nothing_to_hold);
    RUN_TEST(test_hold_near_the_end);
    RUN_TEST(test_override);
    RUN_TEST(test_no_override_beyond_200);
    RUN_TEST(test_feed_saturates);
    RUN_TEST(test_start_from_where_it_stopped);
    return UNITY_END();
}
