/* SPDX-License-Identifier: MIT */
/* Outputs of a job in chunks at an I/O module: each event of the job acts once, at its place, whenever the chunks
 * come. Run by `make unit`; no I/O. */
#include "app/commands.h"
#include "app/stream.h"
#include "app_bench.h"
#include "canopen/sdo_abort.h"
#include "chunk_image.h"
#include "unity.h"

#define X_MM        10
#define Y_MM        (-5)
#define JOB         7u
#define UNIT        1000000 /* counts for each mm */
#define Q40         INT64_C(1099511627776)
#define MODULE      16u
#define OFF_IN_HOLD 8u
#define LAMP        0x8000
#define TAIL_UM     24000 /* the end of the first chunk */
#define WHOLE       97u
#define WHOLE_UM    56000

static struct app_bench bench;
static uint8_t bytes[CHUNK_IMAGE_SIZE_MAX];

/* The second chunk begins with the first segment, so that it can be taken over before anything has moved. */
static const struct chunk_plan parts[] = {
    {.to = 33, .flags = CHUNK_FLAG_FIRST, .job = JOB},
    {.joint = 33, .to = 57, .job = JOB, .sequence = 1},
    {.from = 36, .joint = 57, .to = 81, .job = JOB, .sequence = 2},
    {.previous = 36,
     .from = 60,
     .joint = 81,
     .to = WHOLE,
     .flags = CHUNK_FLAG_LAST,
     .job = JOB,
     .sequence = 3},
};
#define PARTS (sizeof parts / sizeof parts[0])

/* Places of the job in um, rising. An event sets analogue output 0 to its number and the lamp on. */
static const int32_t places_um[] = {0,     0,     1,     4000,  8000,  8000,  12345, 19999,   20000,
                                    21000, 23999, 24000, 24001, 28000, 32000, 55999, WHOLE_UM};
#define EVENTS (sizeof places_um / sizeof places_um[0])

static void make_events(struct program_event events[2u * EVENTS], int32_t first_value)
{
    for (uint32_t i = 0; i < EVENTS; ++i) {
        const int64_t place_q40_mm = places_um[i] * Q40 / 1000;
        events[2u * i] = (struct program_event){place_q40_mm, PROGRAM_EVENT_ANALOGUE, 0, 0,
                                                first_value + (int32_t)i};
        events[2u * i + 1u] =
            (struct program_event){place_q40_mm, PROGRAM_EVENT_DIGITAL, 0, LAMP, LAMP};
    }
}

static void send(const struct chunk_plan *plan, int32_t x_mm, int32_t first_value)
{
    struct program_event events[2u * EVENTS];
    make_events(events, first_value);
    (void)chunk_image_make(bytes, plan, x_mm, Y_MM);
    const uint32_t size = chunk_image_switch(bytes, events, 2u * EVENTS);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_chunk(&bench, bytes, size));
}

static void command(unsigned number)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, number));
}

static void configure(uint8_t sub, uint32_t value)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2035, sub, value, 1));
}

static int32_t place_um(void)
{
    return (bench.drives[0].position_counts - X_MM * UNIT) / (UNIT / 1000);
}

static int16_t value(void)
{
    return bench.module.values.write_analogue_output_16_bit[0];
}

static int digital(void)
{
    const uint8_t *levels = bench.module.values.write_output_8_bit;
    return levels[0] | levels[1] << 8;
}

/* How many events are at or before a place. */
static int16_t events_at(int32_t um)
{
    int16_t count = 0;
    while ((uint32_t)count < EVENTS && places_um[count] <= um) {
        count++;
    }
    return count;
}

/* Near a rest the position is rounded to a place that the setpoint is still before. */
static void periods(uint32_t count)
{
    for (uint32_t i = 0; i < count; ++i) {
        app_bench_period(&bench);
        TEST_ASSERT_TRUE(value() == events_at(place_um()) || value() == events_at(place_um() - 1));
        TEST_ASSERT_EQUAL_HEX16(LAMP, digital());
    }
}

static void begin(uint32_t behaviour)
{
    app_bench_init(&bench, X_MM * UNIT, Y_MM * UNIT);
    app_bench_add_module(&bench, MODULE);
    configure(1, MODULE);
    configure(2, 16);
    configure(3, 3);
    configure(4, behaviour);
    app_bench_make_ready(&bench);
}

/* The first setpoint is reached two SYNCs after it is sent. */
static void start(void)
{
    command(COMMAND_START);
    app_bench_periods(&bench, 3);
}

static void run_to_the_end(void)
{
    for (uint32_t most = 20000; bench.controller.machine.state != MACHINE_READY && most > 0u;
         --most) {
        periods(1);
    }
    app_bench_periods(&bench, 3);
    TEST_ASSERT_EQUAL_INT32(WHOLE_UM, place_um());
    TEST_ASSERT_EQUAL_INT16((int16_t)EVENTS, value());
}

void setUp(void)
{
}

void tearDown(void)
{
}

/* All chunks there before the start, or each so many ticks after the one before. */
static void test_each_event_acts_at_its_place(void)
{
    static const uint32_t apart[] = {0, 1, 2, 150, 400, 640};
    for (uint32_t k = 0; k < sizeof apart / sizeof apart[0]; ++k) {
        begin(0);
        send(&parts[0], X_MM, 1);
        for (uint32_t i = 1; i < PARTS && apart[k] == 0u; ++i) {
            send(&parts[i], X_MM, 1);
        }
        start();
        TEST_ASSERT_EQUAL_INT16(events_at(0), value());
        for (uint32_t i = 1; i < PARTS && apart[k] != 0u; ++i) {
            periods(apart[k]);
            send(&parts[i], X_MM, 1);
        }
        run_to_the_end();
    }
}

static void until_underrun(void)
{
    while (app_bench_read(&bench, 0x2060, 2) != STREAM_UNDERRUN) {
        app_bench_period(&bench);
    }
    app_bench_periods(&bench, 3);
    TEST_ASSERT_EQUAL_INT32(TAIL_UM, place_um());
}

static void stays(int16_t level, int lamp, uint32_t count)
{
    for (uint32_t i = 0; i < count; ++i) {
        app_bench_period(&bench);
        TEST_ASSERT_EQUAL_INT16(level, value());
        TEST_ASSERT_EQUAL_HEX16(lamp, digital());
    }
}

static void send_the_others(void)
{
    for (uint32_t i = 1; i < PARTS; ++i) {
        send(&parts[i], X_MM, 1);
    }
}

/* What was passed on the tail has acted, the end of the tail included; it does not act again. */
static void test_outputs_stay_in_an_underrun(void)
{
    begin(0);
    send(&parts[0], X_MM, 1);
    start();
    until_underrun();
    stays(events_at(TAIL_UM), LAMP, 100);
    send_the_others();
    run_to_the_end();
}

static void test_outputs_go_off_in_an_underrun_as_in_a_hold(void)
{
    begin(OFF_IN_HOLD);
    send(&parts[0], X_MM, 1);
    start();
    until_underrun();
    stays(0, 0, 100);
    send_the_others();
    app_bench_periods(&bench, 4);
    run_to_the_end();
}

#define ROUND    41u
#define ROUND_UM 28000

/* Two paths of 28 mm, a dwell of 50 ms between them. Values of the second one begin with 101. */
static void send_rounds(void)
{
    const struct chunk_plan first = {
        .to = ROUND, .flags = CHUNK_FLAG_FIRST | CHUNK_FLAG_JOINED, .job = JOB};
    const struct chunk_plan second = {.to = ROUND,
                                      .flags = CHUNK_FLAG_REST | CHUNK_FLAG_LAST,
                                      .job = JOB,
                                      .sequence = 1,
                                      .rest_ms = 50,
                                      .job_mm = ROUND_UM / 1000};
    send(&first, X_MM, 1);
    send(&second, X_MM + ROUND_UM / 1000, 101);
}

/* Those at the end of a path act with its last setpoint, those at the start of the next one with its first: after the
 * dwell. They stay in the dwell, where nothing is missing. */
static void test_outputs_over_a_rest(void)
{
    for (uint32_t behaviour = 0; behaviour <= OFF_IN_HOLD; behaviour += OFF_IN_HOLD) {
        begin(behaviour);
        send_rounds();
        start();
        while (place_um() < ROUND_UM - 1) {
            periods(1);
        }
        while (value() < events_at(ROUND_UM)) {
            app_bench_period(&bench);
        }
        stays(events_at(ROUND_UM), LAMP, 49);
        while (value() == events_at(ROUND_UM)) {
            app_bench_period(&bench);
            TEST_ASSERT_EQUAL_HEX16(LAMP, digital());
        }
        TEST_ASSERT_EQUAL_INT32(ROUND_UM, place_um());
        TEST_ASSERT_EQUAL_INT16(100 + events_at(ROUND_UM), value());
        (void)app_bench_until(&bench, MACHINE_READY, 5000);
        app_bench_periods(&bench, 3);
        TEST_ASSERT_EQUAL_INT32(2 * ROUND_UM, place_um());
        TEST_ASSERT_EQUAL_INT16(100 + (int16_t)EVENTS, value());
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_each_event_acts_at_its_place);
    RUN_TEST(test_outputs_stay_in_an_underrun);
    RUN_TEST(test_outputs_go_off_in_an_underrun_as_in_a_hold);
    RUN_TEST(test_outputs_over_a_rest);
    return UNITY_END();
}
