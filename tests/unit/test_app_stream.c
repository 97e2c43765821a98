/* SPDX-License-Identifier: MIT */
/* A job that comes in chunks, through the dictionary, on a bus without delays. Run by `make unit`; no I/O. */
#include "app/stream.h"

#include <string.h>

#include "app/commands.h"
#include "app_bench.h"
#include "app_image.h"
#include "canopen/cob.h"
#include "canopen/sdo_abort.h"
#include "chunk_image.h"
#include "fake_port.h"
#include "unity.h"

#define X_MM       10
#define Y_MM       (-5)
#define JOB        7u
#define UNIT       1000000 /* counts a mm */
#define SMALL_RING (20u * 1024u)
#define WHOLE      97u /* pieces of the job, after which it ends: 0.5 s + 96 / 32 s + 0.5 s */

static struct app_bench bench;
static uint8_t bytes[CHUNK_IMAGE_SIZE_MAX];

/* The job in four parts. */
static const struct chunk_plan parts[] = {
    {.from = 0,
     .joint = 0,
     .to = 33,
     .flags = CHUNK_FLAG_FIRST,
     .job = JOB,
     .sequence = 0,
     .whole_to = WHOLE},
    {.previous = 0, .from = 9, .joint = 33, .to = 57, .job = JOB, .sequence = 1, .whole_to = WHOLE},
    {.previous = 9,
     .from = 36,
     .joint = 57,
     .to = 81,
     .job = JOB,
     .sequence = 2,
     .whole_to = WHOLE},
    {.previous = 36,
     .from = 60,
     .joint = 81,
     .to = WHOLE,
     .flags = CHUNK_FLAG_LAST,
     .job = JOB,
     .sequence = 3,
     .whole_to = WHOLE},
};
#define PARTS (sizeof parts / sizeof parts[0])

static const struct chunk_plan alone = {
    .to = WHOLE, .flags = CHUNK_FLAG_FIRST | CHUNK_FLAG_LAST, .job = JOB, .whole_to = WHOLE};

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
    app_bench_make_ready(&bench);
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

/* Setpoints of the job in one piece, at 100 %. */
static int32_t whole[BENCH_TARGETS];
static uint32_t whole_count;

static void make_whole(void)
{
    expect_sent(&alone);
    command(COMMAND_START);
    expect_end();
    memcpy(whole, bench.targets[0], sizeof whole);
    whole_count = bench.recorded;
    app_bench_init(&bench, X_MM * UNIT, Y_MM * UNIT);
    power_on();
}

/* The setpoints since the start are those of the whole job, each in its tick. */
static void expect_same_as_whole(void)
{
    TEST_ASSERT_EQUAL_UINT32(whole_count, bench.recorded);
    TEST_ASSERT_EQUAL_INT32_ARRAY(whole, bench.targets[0], whole_count);
}

/* Sends part by part, each `ahead` ms before the tail of its predecessor would begin. */
static void stream_rest(uint32_t first, int64_t ahead_ms)
{
    for (uint32_t i = first; i < PARTS; ++i) {
        while (read(8) > 500 + ahead_ms) {
            app_bench_period(&bench);
        }
        expect_sent(&parts[i]);
    }
}

static void expect_executed(uint32_t sequence)
{
    TEST_ASSERT_EQUAL_INT(sequence, read(9));
    TEST_ASSERT_EQUAL_INT(100u + sequence, read(10));
}

static void test_chunks_in_order_give_the_setpoints_of_the_whole_job(void)
{
    make_whole();
    expect_sent(&parts[0]);
    TEST_ASSERT_EQUAL_INT(2000, read(8));
    TEST_ASSERT_EQUAL_INT(4000, read(12));
    command(COMMAND_START);
    stream_rest(1, 150);
    TEST_ASSERT_INT_WITHIN(2, 1150, read(12));
    expect_end();
    expect_executed(3);
    expect_same_as_whole();
    TEST_ASSERT_EQUAL_INT(0, read(13));
}

/* However early or late they come: all before the start, or each with its predecessor's tail just ahead. */
static void test_the_time_of_a_takeover_changes_no_setpoint(void)
{
    make_whole();
    for (uint32_t sent = 1; sent <= PARTS; ++sent) {
        for (int64_t ahead_ms = 10; ahead_ms < 800; ahead_ms += 123) {
            app_bench_init(&bench, X_MM * UNIT, Y_MM * UNIT);
            power_on();
            for (uint32_t i = 0; i < sent; ++i) {
                expect_sent(&parts[i]);
            }
            command(COMMAND_START);
            stream_rest(sent, ahead_ms);
            expect_end();
            expect_same_as_whole();
        }
    }
}

/* Job arc length and times go on over a takeover. */
static void test_the_place_in_the_job_goes_on(void)
{
    expect_sent(&parts[0]);
    command(COMMAND_START);
    int64_t arc_q40_mm = read(11);
    int64_t remaining_ms = read(12);
    for (uint32_t i = 1; i < PARTS; ++i) {
        while (read(8) > 700) {
            app_bench_period(&bench);
            const int64_t next_q40_mm = read(11);
            TEST_ASSERT_TRUE(next_q40_mm >= arc_q40_mm &&
                             next_q40_mm - arc_q40_mm <= (INT64_C(17) << 40) / 1000);
            TEST_ASSERT_INT_WITHIN(2, remaining_ms - 1, read(12)); /* sums of rounded parts */
            arc_q40_mm = next_q40_mm;
            remaining_ms = read(12);
        }
        expect_sent(&parts[i]);
    }
    expect_end();
}

static void test_a_chunk_out_of_turn_changes_nothing(void)
{
    struct chunk_plan other = parts[1];
    expect_refused(&parts[1], PROGRAM_ERR_CHUNK_JOB); /* no job */
    expect_state(STREAM_NONE);
    expect_sent(&parts[0]);
    expect_refused(&parts[0], PROGRAM_ERR_CHUNK_SEQUENCE);
    expect_refused(&parts[2], PROGRAM_ERR_CHUNK_SEQUENCE);
    other.job = JOB + 1u;
    expect_refused(&other, PROGRAM_ERR_CHUNK_JOB);
    const int64_t free_bytes = read(7);
    command(COMMAND_START);
    expect_sent(&parts[1]);
    expect_refused(&parts[1], PROGRAM_ERR_CHUNK_SEQUENCE);
    expect_refused(&parts[3], PROGRAM_ERR_CHUNK_SEQUENCE);
    TEST_ASSERT_TRUE(read(7) < free_bytes);
    other = parts[0];
    other.job = JOB + 1u;
    expect_refused(&other, PROGRAM_ERR_CHUNK_JOB); /* while this one moves */
    TEST_ASSERT_EQUAL_INT(JOB, read(3));
    stream_rest(2, 200);
    expect_end();
}

static uint32_t make(const struct chunk_plan *plan)
{
    return chunk_image_make(bytes, plan, X_MM, Y_MM);
}

static void expect_bytes_refused(uint32_t size, int code, uint32_t index)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_VALUE, app_bench_chunk(&bench, bytes, size));
    TEST_ASSERT_EQUAL_INT(code, read(5));
    TEST_ASSERT_EQUAL_UINT32(index, read(6));
}

static void test_a_corrupt_chunk_is_refused_and_may_come_again(void)
{
    expect_sent(&parts[0]);
    command(COMMAND_START);
    const int64_t free_bytes = read(7);
    const uint32_t size = make(&parts[1]);
    bytes[size / 2u] ^= 1u;
    expect_bytes_refused(size, PROGRAM_ERR_CHUNK_CRC, 0);
    bytes[size / 2u] ^= 1u;
    bytes[0] = 'X';
    expect_bytes_refused(size, PROGRAM_ERR_CHUNK_FORMAT, 0);
    bytes[0] = 'H';
    expect_bytes_refused(size - 8u, PROGRAM_ERR_CHUNK_FORMAT, 0);
    /* piece 5 of the shared part is another one */
    uint8_t *pieces = bytes + CHUNK_HEADER_SIZE + PROGRAM_HEADER_SIZE +
                      (size_t)cob_get(bytes + CHUNK_HEADER_SIZE + 20, 4) * PROGRAM_SEGMENT_SIZE;
    pieces[5u * PROGRAM_PIECE_SIZE + 74u]--;
    chunk_image_seal(bytes);
    expect_bytes_refused(size, PROGRAM_ERR_CHUNK_PIECE, 5);
    TEST_ASSERT_EQUAL_INT(1, read(4));
    TEST_ASSERT_EQUAL_INT(free_bytes, read(7));
    stream_rest(1, 150);
    expect_end();
    TEST_ASSERT_EQUAL_INT(0, read(13));
}

/* A program that begins in motion is a chunk's, and nothing for 0x2000. */
static void test_a_moving_image_is_no_program(void)
{
    const uint32_t size = make(&parts[1]);
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_VALUE, app_bench_upload(&bench, bytes + CHUNK_HEADER_SIZE,
                                                              size - CHUNK_HEADER_SIZE));
}

static void frame(uint8_t first, const uint8_t *data, uint32_t size)
{
    struct can_msg out = {.id = 0x601, .len = 8, .data = {first}};
    memcpy(out.data + 1, data, size);
    fake_port_receive(&out);
    app_bench_settle(&bench);
}

/* Begins a segmented download of a chunk, and sends so many segments of it. */
static void begin_download(uint32_t size, uint32_t segments)
{
    uint8_t begin[7] = {0x60, 0x20, 1};
    cob_put(begin + 3, size, 4);
    frame(0x21, begin, sizeof begin);
    for (uint32_t i = 0; i < segments; ++i) {
        frame((uint8_t)((i & 1u) << 4), bytes + (size_t)i * 7u, 7);
    }
}

static void test_a_download_may_break_off_anywhere(void)
{
    expect_sent(&parts[0]);
    const int64_t free_bytes = read(7);
    const uint32_t size = make(&parts[1]);
    const uint8_t gone[7] = {0x60, 0x20, 1};
    command(COMMAND_START);
    for (uint32_t segments = 0; segments < 200; segments += 13) {
        begin_download(size, segments);
        frame(0x80, gone, sizeof gone);
        TEST_ASSERT_EQUAL_INT(free_bytes, read(7));
        TEST_ASSERT_EQUAL_INT(1, read(4));
    }
    stream_rest(1, 150);
    expect_end();
    TEST_ASSERT_EQUAL_INT(0, read(13));
}

/* The second client is refused, and the download goes on. */
static void test_a_second_client_is_refused(void)
{
    const uint8_t begin[7] = {0x60, 0x20, 1, 100};
    const uint8_t ask[7] = {0x60, 0x20, 4};
    struct can_msg answer;
    expect_sent(&parts[0]);
    begin_download(make(&parts[1]), 20);
    for (uint32_t i = 0; i < 2u; ++i) {
        struct can_msg in = {.id = 0x601, .len = 8, .data = {i == 0u ? 0xC6 : 0x40}};
        memcpy(in.data + 1, i == 0u ? begin : ask, 7);
        if (i == 0u) {
            in.data[3] = 2; /* not the object of the transfer, which may be begun again */
        }
        fake_port_receive(&in);
        controller_poll(&bench.controller);
        TEST_ASSERT_TRUE(fake_port_take(&answer));
        TEST_ASSERT_EQUAL_HEX8(0x80, answer.data[0]);
        TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_LOCAL, cob_get(answer.data + 4, 4));
    }
    frame(0, bytes + 140, 7);
    TEST_ASSERT_EQUAL_UINT32(147, bench.controller.server.object.moved);
}

/* ---- Late ---- */

static void test_underrun_and_on(void)
{
    make_whole();
    expect_sent(&parts[0]);
    command(COMMAND_START);
    app_bench_periods(&bench, 2300);
    expect_state(STREAM_UNDERRUN);
    TEST_ASSERT_EQUAL_INT(MACHINE_RUNNING, app_bench_read(&bench, 0x2002, 0));
    TEST_ASSERT_FALSE(machine_busy(&bench.controller.machine));
    TEST_ASSERT_EQUAL_INT(0, read(8));
    TEST_ASSERT_EQUAL_INT(1, read(13));
    TEST_ASSERT_EQUAL_INT(INT64_C(24) << 40, read(11));
    TEST_ASSERT_EQUAL_INT32((X_MM + 24) * UNIT, bench.drives[0].position_counts);
    expect_sent(&parts[1]);
    app_bench_periods(&bench, 2);
    expect_state(STREAM_OPEN);
    TEST_ASSERT_EQUAL_INT(INT64_C(24) << 40, read(11));
    stream_rest(2, 150);
    expect_end();
    TEST_ASSERT_EQUAL_INT(1, read(13));
    TEST_ASSERT_EQUAL_INT32(whole[whole_count - 1u], bench.targets[0][bench.recorded - 1u]);
}

/* Each chunk comes only when the motion rests. */
static void test_underrun_after_each_chunk(void)
{
    for (uint32_t i = 0; i < PARTS; ++i) {
        expect_sent(&parts[i]);
        if (i == 0u) {
            command(COMMAND_START);
        }
        for (uint32_t k = 0; i + 1u < PARTS && read(2) != STREAM_UNDERRUN; ++k) {
            TEST_ASSERT_TRUE(k < 10000u);
            app_bench_periods(&bench, 10);
        }
    }
    expect_end();
    TEST_ASSERT_EQUAL_INT(3, read(13));
}

/* In every tick of the tail: the path goes on to its end. */
static void test_a_chunk_in_the_tail(void)
{
    for (uint32_t late = 0; late < 560; late += 37) {
        app_bench_init(&bench, X_MM * UNIT, Y_MM * UNIT);
        power_on();
        expect_sent(&parts[0]);
        command(COMMAND_START);
        app_bench_periods(&bench, 1480 + late);
        expect_sent(&parts[1]);
        stream_rest(2, 150);
        expect_end();
    }
}

/* ---- Commands while chunks come ---- */

static void test_hold_in_the_shared_part(void)
{
    for (uint32_t tick = 700; tick < 2100; tick += 97) {
        app_bench_init(&bench, X_MM * UNIT, Y_MM * UNIT);
        power_on();
        expect_sent(&parts[0]);
        command(COMMAND_START);
        app_bench_periods(&bench, tick);
        command(COMMAND_HOLD);
        expect_sent(&parts[1]); /* pending in the brake */
        (void)app_bench_until(&bench, MACHINE_HELD, 1000);
        app_bench_periods(&bench, 300);
        const int32_t held_counts = bench.drives[0].position_counts;
        TEST_ASSERT_EQUAL_INT(MACHINE_HELD, app_bench_read(&bench, 0x2002, 0));
        if (tick > 900) {
            expect_executed(1); /* at rest by arc length */
        }
        expect_sent(&parts[2]);
        app_bench_periods(&bench, 300);
        TEST_ASSERT_EQUAL_INT32(held_counts, bench.drives[0].position_counts);
        command(COMMAND_RESUME);
        stream_rest(3, 150);
        expect_end();
    }
}

static void test_hold_and_resume_in_an_underrun(void)
{
    expect_sent(&parts[0]);
    command(COMMAND_START);
    app_bench_periods(&bench, 2300);
    command(COMMAND_HOLD);
    app_bench_periods(&bench, 2);
    TEST_ASSERT_EQUAL_INT(MACHINE_HELD, app_bench_read(&bench, 0x2002, 0));
    expect_state(STREAM_UNDERRUN);
    command(COMMAND_RESUME);
    app_bench_periods(&bench, 2);
    TEST_ASSERT_EQUAL_INT(MACHINE_RUNNING, app_bench_read(&bench, 0x2002, 0));
    command(COMMAND_HOLD);
    expect_sent(&parts[1]);
    app_bench_periods(&bench, 500);
    TEST_ASSERT_EQUAL_INT(MACHINE_HELD, app_bench_read(&bench, 0x2002, 0));
    expect_state(STREAM_OPEN);
    TEST_ASSERT_EQUAL_INT32((X_MM + 24) * UNIT, bench.drives[0].position_counts);
    command(COMMAND_RESUME);
    stream_rest(2, 150);
    expect_end();
}

/* The job is over; it can be read where it rests, and nothing more is taken for it. */
static void expect_stopped(uint32_t wanted)
{
    app_bench_period(&bench);
    expect_state(STREAM_STOPPED);
    TEST_ASSERT_EQUAL_INT(JOB, read(3));
    TEST_ASSERT_EQUAL_INT32(bench.controller.machine.axes[0].target_counts,
                            X_MM * UNIT + counts_from_q40_mm(read(11), UNIT));
    expect_refused(&parts[wanted], PROGRAM_ERR_CHUNK_OVER);
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, app_bench_command(&bench, COMMAND_START));
}

/* Object 0x2056 sub 3: another client may have replaced the job since the host looked. */
static void test_a_named_start_starts_that_job_only(void)
{
    expect_sent(&alone);
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, app_bench_write(&bench, 0x2056, 3, JOB + 1u, 4));
    TEST_ASSERT_EQUAL_INT(MACHINE_OTHER_PROGRAM, app_bench_read(&bench, 0x2003, 4));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, app_bench_write(&bench, 0x2056, 1, 0, 4));
    TEST_ASSERT_EQUAL_INT(MACHINE_OTHER_PROGRAM, app_bench_read(&bench, 0x2003, 4));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2056, 3, JOB, 4));
    expect_end();
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, app_bench_write(&bench, 0x2056, 3, JOB, 4));
    TEST_ASSERT_EQUAL_INT(MACHINE_JOB_STARTED, app_bench_read(&bench, 0x2003, 4));
}

static void test_stop_while_a_takeover_is_pending(void)
{
    for (uint32_t tick = 100; tick < 2200; tick += 131) {
        app_bench_init(&bench, X_MM * UNIT, Y_MM * UNIT);
        power_on();
        expect_sent(&parts[0]);
        command(COMMAND_START);
        app_bench_periods(&bench, tick);
        command(COMMAND_STOP);
        if (bench.controller.machine.state == MACHINE_STOPPING) {
            expect_sent(&parts[1]);
        }
        (void)app_bench_until(&bench, MACHINE_READY, 3000);
        expect_stopped(2);
        TEST_ASSERT_EQUAL_INT(MACHINE_JOB_STARTED, app_bench_read(&bench, 0x2003, 4));
        TEST_ASSERT_TRUE(bench.drives[0].worst_step_counts <= 16001);
    }
}

/* ---- Commands to stop while a chunk is checked ---- */

static struct {
    unsigned calls;
    uint8_t command;
    enum machine_state state; /* a piece later */
} during_check;

/* Ticks go on meanwhile, and in one of them a command comes. */
static void interrupt_check(void *context)
{
    (void)context;
    during_check.calls++;
    fake_port_advance_us(1000);
    if (during_check.calls == 10u) {
        const struct can_msg in = {
            .id = 0x601, .len = 8, .data = {0x2F, 0x01, 0x20, 0x00, during_check.command}};
        fake_port_receive(&in);
    } else if (during_check.calls == 11u) {
        during_check.state = bench.controller.machine.state;
    }
}

static void test_stops_do_not_wait_for_a_check(void)
{
    static const struct {
        uint8_t command;
        enum machine_state state;
    } rows[] = {{COMMAND_HOLD, MACHINE_HOLDING},
                {COMMAND_STOP, MACHINE_STOPPING},
                {COMMAND_QUICK_STOP, MACHINE_QUICK_STOP}};
    for (uint32_t i = 0; i < sizeof rows / sizeof rows[0]; ++i) {
        app_bench_init(&bench, X_MM * UNIT, Y_MM * UNIT);
        power_on();
        expect_sent(&parts[0]);
        command(COMMAND_START);
        app_bench_periods(&bench, 700);
        during_check.calls = 0;
        during_check.command = rows[i].command;
        fake_port_on_progress(interrupt_check, NULL);
        expect_sent(&parts[1]);
        fake_port_on_progress(NULL, NULL);
        TEST_ASSERT_GREATER_THAN_UINT(20, during_check.calls);
        TEST_ASSERT_EQUAL_INT(rows[i].state, during_check.state);
        app_bench_periods(&bench, 1000);
        TEST_ASSERT_EQUAL_INT(0, bench.controller.urgent);
    }
}

static void test_stop_in_an_underrun(void)
{
    expect_sent(&parts[0]);
    command(COMMAND_START);
    app_bench_periods(&bench, 2300);
    expect_state(STREAM_UNDERRUN);
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, app_bench_write(&bench, 0x2060, 15, 1, 1));
    command(COMMAND_STOP);
    (void)app_bench_until(&bench, MACHINE_READY, 3000);
    expect_stopped(1);
}

static void test_a_fault_ends_the_job_on_its_path(void)
{
    for (uint32_t tick = 100; tick < 2500; tick += 267) {
        app_bench_init(&bench, X_MM * UNIT, Y_MM * UNIT);
        power_on();
        expect_sent(&parts[0]);
        expect_sent(&parts[1]);
        command(COMMAND_START);
        app_bench_periods(&bench, tick);
        port_lock();
        machine_raise(&bench.controller.machine, FAULT_MAIN_LOOP_STALL, 0, 0);
        port_unlock();
        app_bench_periods(&bench, 1200);
        TEST_ASSERT_EQUAL_INT(MACHINE_FAULT_OFF, bench.controller.machine.fault_phase);
        expect_state(STREAM_STOPPED);
        TEST_ASSERT_EQUAL_INT32(Y_MM * UNIT, bench.drives[1].position_counts);
        TEST_ASSERT_TRUE(bench.drives[0].worst_step_counts <= 16001);
    }
}

static void test_override_in_a_job(void)
{
    expect_sent(&parts[0]);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2010, 1, 150, 2));
    command(COMMAND_START);
    app_bench_periods(&bench, 800);
    TEST_ASSERT_EQUAL_INT(1 << 30, app_bench_read(&bench, 0x2010, 2));
    TEST_ASSERT_EQUAL_INT(1, app_bench_read(&bench, 0x2010, 3));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2010, 1, 50, 2));
    expect_sent(&parts[1]);
    app_bench_periods(&bench, 800);
    TEST_ASSERT_EQUAL_INT(1 << 29, app_bench_read(&bench, 0x2010, 2));
    TEST_ASSERT_EQUAL_INT(0, app_bench_read(&bench, 0x2010, 3));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2010, 1, 150, 2));
    stream_rest(2, 300);
    (void)app_bench_until(&bench, MACHINE_READY, 20000);
    TEST_ASSERT_TRUE(bench.drives[0].worst_step_counts <= 24001);
    TEST_ASSERT_TRUE(bench.drives[0].worst_step_counts > 20000); /* in the last chunk */
    TEST_ASSERT_EQUAL_INT32((X_MM + 56) * UNIT, bench.drives[0].position_counts);
}

/* ---- Anything ---- */

static uint32_t random_state;

static uint32_t random_below(uint32_t most)
{
    random_state = random_state * 1664525u + 1013904223u;
    return (random_state >> 8) % most;
}

/* The next chunk, perhaps damaged. Gives how many have been accepted. */
static uint32_t send_perhaps(uint32_t next)
{
    if (next == PARTS) {
        return next;
    }
    const uint32_t size = make(&parts[next]);
    if (random_below(3) == 0u) {
        bytes[16u + random_below(size - 16u)] ^= (uint8_t)(1u << random_below(8));
    }
    return next + (app_bench_chunk(&bench, bytes, size) == SDO_OK ? 1u : 0u);
}

static uint32_t act_at_random(uint32_t next)
{
    switch (random_below(6)) {
    case 0:
        (void)app_bench_command(&bench, COMMAND_HOLD);
        return next;
    case 1:
        (void)app_bench_write(&bench, 0x2010, 1, random_below(201), 2);
        return next;
    case 2:
        return send_perhaps(next);
    default:
        (void)app_bench_command(&bench, COMMAND_RESUME);
        return next;
    }
}

/* Every setpoint is on the path, and no further from the one before than the feed allows; the path is not left
 * backwards. */
static void expect_path(void)
{
    for (uint32_t k = 1; k < bench.recorded; ++k) {
        const int32_t step_counts = bench.targets[0][k] - bench.targets[0][k - 1u];
        TEST_ASSERT_TRUE(step_counts >= -1 && step_counts <= 24001);
        TEST_ASSERT_EQUAL_INT32(Y_MM * UNIT, bench.targets[1][k]);
    }
}

static void test_any_sequence_of_commands_and_chunks(void)
{
    for (uint32_t seed = 1; seed <= 30u; ++seed) {
        random_state = seed;
        app_bench_init(&bench, X_MM * UNIT, Y_MM * UNIT);
        power_on();
        expect_sent(&parts[0]);
        command(COMMAND_START);
        uint32_t next = 1;
        for (uint32_t k = 0; k < 25u; ++k) {
            app_bench_periods(&bench, 1u + random_below(200));
            if (bench.controller.machine.state != MACHINE_READY) {
                next = act_at_random(next);
            }
        }
        (void)app_bench_command(&bench, COMMAND_RESUME);
        (void)app_bench_write(&bench, 0x2010, 1, 100, 2);
        while (next < PARTS) {
            next = send_perhaps(next);
        }
        (void)app_bench_until(&bench, MACHINE_READY, 20000);
        app_bench_period(&bench);
        expect_state(STREAM_ENDED);
        expect_executed(3);
        TEST_ASSERT_EQUAL_INT32((X_MM + 8 + 48) * UNIT, bench.drives[0].position_counts);
        expect_path();
    }
}

/* ---- Begin and end of a job ---- */

static void test_a_job_starts_at_its_beginning_once(void)
{
    app_bench_init(&bench, (X_MM + 1) * UNIT, Y_MM * UNIT);
    power_on();
    expect_sent(&parts[0]);
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, app_bench_command(&bench, COMMAND_START_FROM));
    TEST_ASSERT_EQUAL_INT(MACHINE_JOB_STARTED, app_bench_read(&bench, 0x2003, 4));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, app_bench_command(&bench, COMMAND_START));
    TEST_ASSERT_EQUAL_INT(MACHINE_AWAY_FROM_START, app_bench_read(&bench, 0x2003, 4));
    expect_state(STREAM_OPEN);
}

static void test_a_program_closes_the_job_when_it_is_accepted(void)
{
    static uint8_t image[APP_IMAGE_SIZE];
    expect_sent(&parts[0]);
    app_image_make(image, X_MM, Y_MM);
    image[200] ^= 1u;
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_VALUE, app_bench_upload(&bench, image, sizeof image));
    expect_state(STREAM_OPEN);
    image[200] ^= 1u;
    app_image_seal(image);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_upload(&bench, image, sizeof image));
    expect_state(STREAM_NONE);
    TEST_ASSERT_EQUAL_INT(0, read(3));
    expect_refused(&parts[1], PROGRAM_ERR_CHUNK_JOB);
    command(COMMAND_START);
    app_bench_periods(&bench, 100);
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, send(&parts[0])); /* the program moves */
    (void)app_bench_until(&bench, MACHINE_READY, 2000);
    TEST_ASSERT_EQUAL_INT32((X_MM + 4) * UNIT, bench.drives[0].position_counts);
}

static void test_no_program_while_the_job_moves(void)
{
    static uint8_t image[APP_IMAGE_SIZE];
    app_image_make(image, X_MM, Y_MM);
    expect_sent(&parts[0]);
    command(COMMAND_START);
    app_bench_periods(&bench, 300);
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, app_bench_upload(&bench, image, sizeof image));
    stream_rest(1, 150);
    expect_end();
}

static void test_close_and_the_next_job(void)
{
    struct chunk_plan next = alone;
    const int64_t free_bytes = read(7);
    expect_sent(&parts[0]);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2060, 15, 1, 1));
    expect_state(STREAM_NONE);
    TEST_ASSERT_EQUAL_INT(free_bytes, read(7));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, app_bench_command(&bench, COMMAND_START));
    TEST_ASSERT_EQUAL_INT(MACHINE_NO_PROGRAM, app_bench_read(&bench, 0x2003, 4));
    expect_sent(&parts[0]);
    next.job = JOB + 1u;
    expect_sent(&next); /* takes the place of the one that was not started */
    TEST_ASSERT_EQUAL_INT(JOB + 1u, read(3));
    command(COMMAND_START);
    expect_end();
    expect_refused(&next, PROGRAM_ERR_CHUNK_SEQUENCE);
    next.job = JOB;
    expect_sent(&next);
    TEST_ASSERT_EQUAL_INT(0, read(13));
}

static void test_the_power_takes_the_job_away(void)
{
    expect_sent(&parts[0]);
    command(COMMAND_START);
    app_bench_periods(&bench, 700);
    app_bench_power_cycle(&bench);
    app_bench_settle(&bench);
    expect_state(STREAM_NONE);
    TEST_ASSERT_EQUAL_INT(0, read(4));
    expect_refused(&parts[1], PROGRAM_ERR_CHUNK_JOB);
}

static void test_another_configuration_refuses_start_and_chunks(void)
{
    expect_sent(&parts[0]);
    command(COMMAND_DISABLE);
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2004, 4, 90000, 4));
    expect_refused(&parts[1], PROGRAM_ERR_CHUNK_OVER);
    power_on();
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, app_bench_command(&bench, COMMAND_START));
    TEST_ASSERT_EQUAL_INT(MACHINE_OUTSIDE_LIMITS, app_bench_read(&bench, 0x2003, 4));
    command(COMMAND_DISABLE);
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2004, 4, 100000, 4));
    power_on();
    expect_sent(&parts[1]); /* as it was */
    command(COMMAND_START);
}

/* The tick comes to the end of the records: no point, so the drives stop by themselves; a reset, and the next job
 * runs. */
static void test_a_main_loop_that_makes_no_records(void)
{
    expect_sent(&parts[0]);
    command(COMMAND_START);
    uint32_t ticks = 0;
    while (bench.controller.machine.state == MACHINE_RUNNING) {
        TEST_ASSERT_TRUE(ticks++ < MACHINE_MAIN_LOOP_STALL_US / 1000u);
        app_bench_period_without_main_loop(&bench);
    }
    TEST_ASSERT_TRUE(ticks > 600u);
    TEST_ASSERT_EQUAL_INT(MACHINE_FAULT, bench.controller.machine.state);
    TEST_ASSERT_EQUAL_HEX32(EMCY_SOFTWARE, bench.controller.machine.fault.code);
    app_bench_periods(&bench, 400);
    expect_state(STREAM_STOPPED);
    TEST_ASSERT_TRUE(bench.drives[0].worst_step_counts <= 16001);
}

/* The motion is followed with the records that there are in the cache of a small controller. */
static void test_the_motion_requests_records(void)
{
    expect_sent(&parts[0]);
    command(COMMAND_START);
    uint32_t asked = 0;
    for (uint32_t k = 0; k < 1000u; ++k) {
        app_bench_period_without_main_loop(&bench);
        if (motion_wants_records(&bench.controller.machine.motion)) {
            asked++;
            app_bench_settle(&bench);
        }
    }
    TEST_ASSERT_GREATER_THAN_UINT32(2, asked);
    TEST_ASSERT_LESS_THAN_UINT32(100, asked);
    TEST_ASSERT_EQUAL_INT(0, app_bench_read(&bench, 0x2003, 1));
}

/* ---- Rests between chunks ---- */

/* Two paths of 40 pieces, the second from the end of the first, with a rest before it. */
#define ROUND     41u
#define ROUND_MM  28                          /* 4 + 40 / 2 + 4 */
#define ROUND_END (1000u + 40u * 1000u / 32u) /* its last tick */

static const struct chunk_plan path_1 = {
    .to = ROUND, .flags = CHUNK_FLAG_FIRST | CHUNK_FLAG_JOINED, .job = JOB, .whole_to = ROUND};

static struct chunk_plan behind_rest(uint32_t rest_ms, uint32_t rest_flags)
{
    const struct chunk_plan plan = {.to = ROUND,
                                    .flags = CHUNK_FLAG_REST | CHUNK_FLAG_LAST,
                                    .job = JOB,
                                    .sequence = 1,
                                    .whole_to = ROUND,
                                    .rest_ms = rest_ms,
                                    .rest_flags = rest_flags,
                                    .job_mm = ROUND_MM};
    return plan;
}

static uint32_t send_at(const struct chunk_plan *plan, int32_t x_mm)
{
    return app_bench_chunk(&bench, bytes, chunk_image_make(bytes, plan, x_mm, Y_MM));
}

static void send_rounds(uint32_t rest_ms, uint32_t rest_flags)
{
    const struct chunk_plan second = behind_rest(rest_ms, rest_flags);
    expect_sent(&path_1);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, send_at(&second, X_MM + ROUND_MM));
}

static void expect_both_paths(void)
{
    (void)app_bench_until(&bench, MACHINE_READY, 20000);
    app_bench_period(&bench);
    expect_state(STREAM_ENDED);
    TEST_ASSERT_EQUAL_INT32((X_MM + 2 * ROUND_MM) * UNIT, bench.drives[0].position_counts);
    TEST_ASSERT_EQUAL_INT(INT64_C(2) * ROUND_MM << 40, read(11));
    TEST_ASSERT_EQUAL_INT(0, app_bench_read(&bench, 0x2003, 1));
}

/* Ticks between the first setpoint at the end of the first path and the last one there. */
static uint32_t ticks_at_rest(void)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < bench.recorded; ++i) {
        count += bench.targets[0][i] == (X_MM + ROUND_MM) * UNIT ? 1u : 0u;
    }
    return count;
}

/* The second path is the first one, so many ticks after its end. */
static void expect_rest(uint32_t ticks)
{
    const uint32_t begin = ROUND_END + 1u + ticks;
    for (uint32_t k = 0; k <= ROUND_END; k += 50) {
        TEST_ASSERT_EQUAL_INT32(bench.targets[0][k] + ROUND_MM * UNIT, bench.targets[0][begin + k]);
    }
}

/* The end of the first path, the ticks of the rest, and the first setpoint of the second one. */
static void test_a_dwell_takes_its_ticks(void)
{
    static const uint32_t rests_ms[] = {0, 3, CHUNK_REST_TICKS, 50, 333};
    for (uint32_t k = 0; k < sizeof rests_ms / sizeof rests_ms[0]; ++k) {
        const uint32_t rest_ms = rests_ms[k];
        app_bench_init(&bench, X_MM * UNIT, Y_MM * UNIT);
        power_on();
        send_rounds(rest_ms, 0);
        const uint32_t rest = rest_ms > CHUNK_REST_TICKS ? rest_ms : CHUNK_REST_TICKS;
        TEST_ASSERT_INT_WITHIN(1, 2 * ROUND_END + rest, read(8));
        command(COMMAND_START);
        expect_both_paths();
        TEST_ASSERT_EQUAL_INT(0, read(13));
        expect_rest(rest);
    }
}

/* Comes in the dwell, or long after it: an underrun, and no second dwell. */
static void test_a_chunk_after_a_rest_may_be_late(void)
{
    const struct chunk_plan second = behind_rest(200, 0);
    for (uint32_t late = 0; late < 500; late += 111) {
        app_bench_init(&bench, X_MM * UNIT, Y_MM * UNIT);
        power_on();
        expect_sent(&path_1);
        command(COMMAND_START);
        app_bench_periods(&bench, ROUND_END + 1u + late);
        expect_state(STREAM_UNDERRUN);
        TEST_ASSERT_EQUAL_HEX32(SDO_OK, send_at(&second, X_MM + ROUND_MM));
        expect_both_paths();
        TEST_ASSERT_TRUE(ticks_at_rest() >= 202u && ticks_at_rest() >= late);
        TEST_ASSERT_TRUE(ticks_at_rest() <= (late > 200 ? late : 200u) + 60u);
    }
}

static void until_program_stop(void)
{
    while (read(2) != STREAM_PROGRAM_STOP) {
        app_bench_period(&bench);
    }
    app_bench_periods(&bench, 100);
    expect_state(STREAM_PROGRAM_STOP);
    TEST_ASSERT_EQUAL_INT(MACHINE_HELD, bench.controller.machine.state);
    TEST_ASSERT_EQUAL_INT32((X_MM + ROUND_MM) * UNIT, bench.targets[0][bench.recorded - 1u]);
}

/* The dwell is that after the resume. Chunks are taken meanwhile. */
static void test_a_program_stop_waits_for_resume(void)
{
    const struct chunk_plan second = behind_rest(100, CHUNK_REST_STOP);
    expect_sent(&path_1);
    command(COMMAND_START);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, send_at(&second, X_MM + ROUND_MM));
    until_program_stop();
    const uint32_t before = bench.recorded;
    command(COMMAND_RESUME);
    app_bench_periods(&bench, 50);
    expect_state(STREAM_OPEN);
    TEST_ASSERT_EQUAL_INT(MACHINE_RUNNING, bench.controller.machine.state);
    expect_both_paths();
    TEST_ASSERT_TRUE(ticks_at_rest() >= before - ROUND_END + 90u);
}

static void test_an_optional_stop_has_a_switch(void)
{
    TEST_ASSERT_EQUAL_INT(1, read(16));
    send_rounds(0, CHUNK_REST_OPTIONAL);
    command(COMMAND_START);
    until_program_stop();
    command(COMMAND_RESUME);
    expect_both_paths();
    app_bench_init(&bench, X_MM * UNIT, Y_MM * UNIT);
    power_on();
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2060, 16, 0, 1));
    send_rounds(0, CHUNK_REST_OPTIONAL);
    command(COMMAND_START);
    expect_both_paths();
    expect_rest(CHUNK_REST_TICKS);
}

static void test_commands_in_a_dwell(void)
{
    send_rounds(400, 0);
    command(COMMAND_START);
    app_bench_periods(&bench, ROUND_END + 100u);
    command(COMMAND_HOLD);
    app_bench_periods(&bench, 500);
    TEST_ASSERT_EQUAL_INT(MACHINE_HELD, bench.controller.machine.state);
    TEST_ASSERT_EQUAL_INT(INT64_C(1) * ROUND_MM << 40, read(11));
    command(COMMAND_RESUME);
    app_bench_periods(&bench, 100);
    TEST_ASSERT_EQUAL_INT32((X_MM + ROUND_MM) * UNIT, bench.targets[0][bench.recorded - 1u]);
    expect_both_paths();
    TEST_ASSERT_TRUE(ticks_at_rest() >= 902u);
}

static void test_a_stop_in_a_dwell_ends_the_job(void)
{
    for (uint32_t held = 0; held < 2u; ++held) {
        app_bench_init(&bench, X_MM * UNIT, Y_MM * UNIT);
        power_on();
        send_rounds(400, held != 0u ? CHUNK_REST_STOP : 0u);
        command(COMMAND_START);
        app_bench_periods(&bench, ROUND_END + 100u);
        command(COMMAND_STOP);
        (void)app_bench_until(&bench, MACHINE_READY, 1000);
        app_bench_period(&bench);
        expect_state(STREAM_STOPPED);
        TEST_ASSERT_EQUAL_INT32((X_MM + ROUND_MM) * UNIT, bench.drives[0].position_counts);
        TEST_ASSERT_EQUAL_INT(INT64_C(1) * ROUND_MM << 40, read(11));
    }
}

static void test_what_follows_a_rest_has_to_fit(void)
{
    struct chunk_plan second = behind_rest(0, 0);
    const struct chunk_plan moving = {
        .previous = 0, .from = 9, .joint = 33, .to = 57, .job = JOB, .sequence = 1};
    expect_sent(&path_1);
    expect_refused(&moving, PROGRAM_ERR_CHUNK_REST);
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_VALUE, send_at(&second, X_MM + ROUND_MM + 1));
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_CHUNK_REST, read(5));
    second.job_mm++;
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_VALUE, send_at(&second, X_MM + ROUND_MM));
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_CHUNK_REST, read(5));
    second = behind_rest(5, 4);
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_VALUE, send_at(&second, X_MM + ROUND_MM));
    TEST_ASSERT_EQUAL_INT(PROGRAM_ERR_CHUNK_FORMAT, read(5));
    second = behind_rest(0, 0);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, send_at(&second, X_MM + ROUND_MM));
}

/* The end of a tail is an end too. */
static void test_a_rest_after_a_tail(void)
{
    struct chunk_plan first = path_1;
    const struct chunk_plan second = behind_rest(20, 0);
    first.flags = CHUNK_FLAG_FIRST;
    expect_sent(&first);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, send_at(&second, X_MM + ROUND_MM));
    command(COMMAND_START);
    expect_both_paths();
    expect_rest(20);
}

/* The override holds over the rest. */
static void test_override_over_a_rest(void)
{
    send_rounds(30, 0);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2010, 1, 80, 2));
    command(COMMAND_START);
    expect_both_paths();
    TEST_ASSERT_EQUAL_INT(80, app_bench_read(&bench, 0x2010, 1));
    TEST_ASSERT_UINT32_WITHIN(4, 2u * ROUND_END * 5u / 4u + 30u, bench.recorded - 200u);
}

/* Room for two chunks, and no more: flow control. */
static void test_a_small_ring(void)
{
    app_bench_init(&bench, X_MM * UNIT, Y_MM * UNIT);
    fake_port_shrink_ring(SMALL_RING);
    bench.controller.stream = (struct stream){.job = 0};
    stream_init(&bench.controller.stream);
    power_on();
    TEST_ASSERT_EQUAL_INT(SMALL_RING, read(14));
    expect_sent(&parts[0]);
    command(COMMAND_START);
    for (uint32_t i = 1; i < PARTS; ++i) {
        const uint32_t size = make(&parts[i]);
        for (uint32_t k = 0; read(7) < size; ++k) {
            TEST_ASSERT_TRUE(k < 2000u);
            app_bench_period(&bench);
        }
        expect_sent(&parts[i]);
    }
    expect_end();
    TEST_ASSERT_EQUAL_INT(0, read(13));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_MEMORY, app_bench_chunk(&bench, bytes, SMALL_RING));
}

/* 0x2060 sub 7 reports the larger of two rooms: a chunk without a stated size must not get the other one. */
static void test_a_chunk_of_unknown_size_gets_the_larger_room(void)
{
    struct stream *stream = &bench.controller.stream;
    uint32_t size;
    chunk_ring_clear(&stream->ring);
    TEST_ASSERT_NOT_NULL(chunk_ring_take(&stream->ring, 1, &size));
    chunk_ring_trim(&stream->ring, size / 2u);
    const uint8_t *second = chunk_ring_take(&stream->ring, 1, &size);
    TEST_ASSERT_NOT_NULL(second);
    chunk_ring_trim(&stream->ring, size - 256u);
    chunk_ring_free_oldest(&stream->ring, second);
    const uint32_t free_bytes = stream_free_bytes(stream);
    TEST_ASSERT_GREATER_THAN_UINT32(256, free_bytes);
    TEST_ASSERT_EQUAL_INT(0, stream_begin(stream, 0));
    TEST_ASSERT_EQUAL_UINT32(free_bytes, stream->receiving_bytes);
    stream_abandon(stream);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_job_of_one_chunk);
    RUN_TEST(test_chunks_in_order_give_the_setpoints_of_the_whole_job);
    RUN_TEST(test_the_time_of_a_takeover_changes_no_setpoint);
    RUN_TEST(test_the_place_in_the_job_goes_on);
    RUN_TEST(test_a_chunk_out_of_turn_changes_nothing);
    RUN_TEST(test_a_corrupt_chunk_is_refused_and_may_come_again);
    RUN_TEST(test_a_moving_image_is_no_program);
    RUN_TEST(test_a_download_may_break_off_anywhere);
    RUN_TEST(test_a_second_client_is_refused);
    RUN_TEST(test_underrun_and_on);
    RUN_TEST(test_underrun_after_each_chunk);
    RUN_TEST(test_a_chunk_in_the_tail);
    RUN_TEST(test_hold_in_the_shared_part);
    RUN_TEST(test_hold_and_resume_in_an_underrun);
    RUN_TEST(test_a_named_start_starts_that_job_only);
    RUN_TEST(test_stop_while_a_takeover_is_pending);
    RUN_TEST(test_stops_do_not_wait_for_a_check);
    RUN_TEST(test_stop_in_an_underrun);
    RUN_TEST(test_a_fault_ends_the_job_on_its_path);
    RUN_TEST(test_override_in_a_job);
    RUN_TEST(test_any_sequence_of_commands_and_chunks);
    RUN_TEST(test_a_job_starts_at_its_beginning_once);
    RUN_TEST(test_a_program_closes_the_job_when_it_is_accepted);
    RUN_TEST(test_no_program_while_the_job_moves);
    RUN_TEST(test_close_and_the_next_job);
    RUN_TEST(test_the_power_takes_the_job_away);
    RUN_TEST(test_another_configuration_refuses_start_and_chunks);
    RUN_TEST(test_a_main_loop_that_makes_no_records);
    RUN_TEST(test_the_motion_requests_records);
    RUN_TEST(test_a_dwell_takes_its_ticks);
    RUN_TEST(test_a_chunk_after_a_rest_may_be_late);
    RUN_TEST(test_a_program_stop_waits_for_resume);
    RUN_TEST(test_an_optional_stop_has_a_switch);
    RUN_TEST(test_commands_in_a_dwell);
    RUN_TEST(test_a_stop_in_a_dwell_ends_the_job);
    RUN_TEST(test_what_follows_a_rest_has_to_fit);
    RUN_TEST(test_a_rest_after_a_tail);
    RUN_TEST(test_override_over_a_rest);
    RUN_TEST(test_a_small_ring);
    RUN_TEST(test_a_chunk_of_unknown_size_gets_the_larger_room);
    return UNITY_END();
}
