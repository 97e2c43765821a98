/* SPDX-License-Identifier: MIT */
/* A job that comes in chunks, through the dictionary, on a bus without delays. */
#include "app/stream.h"

#include <string.h>

#include "app/commands.h"
#include "app_bench.h"
#include "app_image.h"
#include "canopen/sdo_abort.h"
#include "chunk_image.h"
#include "fake_port.h"
#include "unity.h"

#define X_MM  10
#define Y_MM  (-5)
#define JOB   7u
#define UNIT  1000000 /* counts a mm */
#define WHOLE 97u     /* pieces of the job, behind which it ends: 0.5 s + 96 / 32 s + 0.5 s */

static struct app_bench bench;
static uint8_t bytes[CHUNK_IMAGE_SIZE_MAX];

/* The job in four parts. */
static const struct chunk_plan parts[] = {
    {.from = 0, .joint = 0, .to = 33, .flags = CHUNK_FLAG_FIRST, .job = JOB, .sequence = 0, .whole_to = WHOLE},
    {.previous = 0, .from = 9, .joint = 33, .to = 57, .job = JOB, .sequence = 1, .whole_to = WHOLE},
    {.previous = 9, .from = 36, .joint = 57, .to = 81, .job = JOB, .sequence = 2, .whole_to = WHOLE},
    {.previous = 36, .from = 60, .joint = 81, .to = WHOLE, .flags = CHUNK_FLAG_LAST, .job = JOB, .sequence = 3, .whole_to = WHOLE},
};
#define PARTS (sizeof parts / sizeof parts[0])

static const struct chunk_plan alone = {.to = WHOLE,
                                        .flags = CHUNK_FLAG_FIRST | CHUNK_FLAG_LAST,
                                        .job = JOB,
                                        .whole_to = WHOLE};

static void command(unsigned number)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, number));
}

static int64_t read(uint8_t sub)
{
    return app_bench_read(&bench, 0x2060, sub);
}

static uint32_t send(const struct chunk_plan *plan)
{
    return app_bench_chunk(&bench, bytes, chunk_image_make(bytes, plan, X_MM, Y_MM));
}

static void expect_sent(const struct chunk_plan *plan)
{
    const uint32_t code = send(plan);
    TEST_ASSERT_EQUAL_INT(0, read(5));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, code);
    TEST_ASSERT_EQUAL_INT(plan->sequence + 1u, read(4));
}

static void expect_refused(const struct chunk_plan *plan, int code)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_VALUE, send(plan));
    TEST_ASSERT_EQUAL_INT(code, read(5));
}

/* On the bus with the ring as it is now; drives on. */
static void power_on(void)
{
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    app_bench_periods(&bench, 3);
    command(COMMAND_ENABLE);
    (void)app_bench_until(&bench, MACHINE_READY, 100);
    app_bench_periods(&bench, AXIS_STANDSTILL_SYNCS);
}

void setUp(void)
{
    app_bench_init(&bench, X_MM * UNIT, Y_MM * UNIT);
    power_on();
}

void tearDown(void)
{
}

static void expect_state(enum stream_state state)
{
    TEST_ASSERT_EQUAL_INT(state, read(2));
}

static void expect_end(void)
{
    (void)app_bench_until(&bench, MACHINE_READY, 20000);
    app_bench_period(&bench);
    expect_state(STREAM_ENDED);
    TEST_ASSERT_EQUAL_INT32((X_MM + 8 + 48) * UNIT, bench.drives[0].position_counts);
    TEST_ASSERT_EQUAL_INT32(Y_MM * UNIT, bench.drives[1].position_counts);
    TEST_ASSERT_TRUE(bench.drives[0].worst_step_counts <= 16001);
    TEST_ASSERT_EQUAL_INT(0, app_bench_read(&bench, 0x2003, 1));
}

static void test_a_job_of_one_chunk(void)
{
    expect_state(STREAM_NONE);
    TEST_ASSERT_EQUAL_INT(FAKE_PORT_RING_BYTES, read(14));
    const int64_t free_bytes = read(7);
    expect_sent(&alone);
    expect_state(STREAM_OPEN);
    TEST_ASSERT_EQUAL_INT(JOB, read(3));
    TEST_ASSERT_TRUE(read(7) < free_bytes);
    TEST_ASSERT_EQUAL_INT(4000, read(8));
    TEST_ASSERT_EQUAL_INT(4000, read(12));
    TEST_ASSERT_EQUAL_INT(100, read(10));
    command(COMMAND_START);
    app_bench_periods(&bench, 1001);
    TEST_ASSERT_EQUAL_INT(3000, read(8));
    TEST_ASSERT_EQUAL_INT(3000, read(12));
    TEST_ASSERT_EQUAL_INT(INT64_C(12) << 40, read(11));
    expect_end();
    TEST_ASSERT_EQUAL_INT(0, read(8));
    TEST_ASSERT_EQUAL_INT(0, read(12));
    TEST_ASSERT_EQUAL_INT(0, read(13));
    TEST_ASSERT_EQUAL_INT(free_bytes, read(7));
    TEST_ASSERT_EQUAL_INT(INT64_C(56) << 40, read(11));
}

int main(void)
{
    UNITY_BEGIN();
    (void)parts; (void)expect_refused;
    RUN_TEST(test_a_job_of_one_chunk);
    return UNITY_END();
}
