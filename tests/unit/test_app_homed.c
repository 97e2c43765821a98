/* SPDX-License-Identifier: MIT */
/* When a homed axis counts as homed, what ends it, and that nothing runs along a program without it. Run by
 * `make unit`; no I/O. */
#include "app/commands.h"
#include "canopen/cob.h"
#include "canopen/sdo_abort.h"

#include "app_bench.h"
#include "app_image.h"
#include "fake_port.h"
#include "unity.h"

#define X_COUNTS 10000000
#define Y_COUNTS (-5000000)
#define X_NODE   2u
#define NEAR     900000 /* counts: less than a mm */

static struct app_bench bench;
static uint8_t image[APP_IMAGE_SIZE];

static struct machine *machine(void)
{
    return &bench.controller.machine;
}

static void boot(void)
{
    (void)app_bench_until(&bench, MACHINE_OFF, 3000);
}

static bool homed(uint8_t axis)
{
    return app_bench_read(&bench, 0x2017, axis) == 1;
}

static void home(void)
{
    bench.drives[0].homing_syncs = 5;
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_HOME));
    boot();
    TEST_ASSERT_TRUE(homed(1));
}

/* Axis x is homed by its drive, y has no method; a program is loaded whose start is where both stand. */
void setUp(void)
{
    app_bench_init(&bench, X_COUNTS, Y_COUNTS);
    app_image_make(image, 10, -5);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2012, 1, 37, 1));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2013, 1, X_COUNTS, 4));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_upload(&bench, image, sizeof image));
    boot();
}

void tearDown(void)
{
}

static void switch_on(void)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_ENABLE));
    (void)app_bench_until(&bench, MACHINE_READY, 100);
    app_bench_periods(&bench, AXIS_STANDSTILL_SYNCS);
}

static void expect_not_homed(unsigned command)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, app_bench_command(&bench, command));
    TEST_ASSERT_EQUAL_INT64(MACHINE_NOT_HOMED, app_bench_read(&bench, 0x2003, 4));
    TEST_ASSERT_EQUAL_INT(MACHINE_READY, machine()->state);
}

static void reset(void)
{
    (void)app_bench_until(&bench, MACHINE_FAULT, 1000);
    for (unsigned k = 0; machine()->fault_phase != MACHINE_FAULT_OFF; ++k) {
        TEST_ASSERT_TRUE(k < 3000u);
        app_bench_period(&bench);
    }
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_RESET));
    (void)app_bench_until(&bench, MACHINE_BOOT, 1000);
}

static void emergency(uint16_t code)
{
    struct can_msg frame;
    cob_frame(&frame, COB_EMCY + X_NODE, 8);
    cob_put16(frame.data, code);
    fake_port_receive(&frame);
    app_bench_settle(&bench);
}

/* Anything that makes a fault at this drive, which keeps its power. */
static void fail(void)
{
    bench.drives[0].state.state = CIA402_FAULT;
}

/* --- the start --- */

static void test_a_start_needs_homed_axes(void)
{
    switch_on();
    expect_not_homed(COMMAND_START);
    expect_not_homed(COMMAND_START_FROM);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_DISABLE));
    home();
    TEST_ASSERT_FALSE(homed(2));
    switch_on();
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_START));
    TEST_ASSERT_EQUAL_INT64(0, app_bench_read(&bench, 0x2055, 2));
}

static void test_unhomed_is_for_one_command(void)
{
    switch_on();
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2055, 1, 1, 1));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_START));
    TEST_ASSERT_EQUAL_INT64(0, app_bench_read(&bench, 0x2055, 1));
    TEST_ASSERT_EQUAL_INT64(1, app_bench_read(&bench, 0x2055, 2));
    (void)app_bench_until(&bench, MACHINE_READY, 3000);
    TEST_ASSERT_EQUAL_INT64(1, app_bench_read(&bench, 0x2055, 2));
    expect_not_homed(COMMAND_START);
}

/* A start that is refused for something else takes it away as well: the next one may be somebody else's. */
static void test_a_refused_start_ends_the_permission(void)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2055, 1, 1, 1));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, app_bench_command(&bench, COMMAND_START));
    TEST_ASSERT_EQUAL_INT64(MACHINE_DRIVES_OFF, app_bench_read(&bench, 0x2003, 4));
    TEST_ASSERT_EQUAL_INT64(0, app_bench_read(&bench, 0x2055, 1));
    switch_on();
    expect_not_homed(COMMAND_START);
}

static void test_a_start_while_the_controller_ends_takes_the_permission_too(void)
{
    switch_on();
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2055, 1, 1, 1));
    bench.controller.ending = true;
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, app_bench_command(&bench, COMMAND_START));
    TEST_ASSERT_EQUAL_INT64(MACHINE_ENDING, app_bench_read(&bench, 0x2003, 4));
    TEST_ASSERT_EQUAL_INT64(0, app_bench_read(&bench, 0x2055, 1));
}

/* --- what keeps it --- */

static void test_a_fault_reset_keeps_it(void)
{
    home();
    switch_on();
    fail();
    reset();
    TEST_ASSERT_TRUE(homed(1));
    boot();
    TEST_ASSERT_TRUE(homed(1));
    switch_on();
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_START));
}

static void test_an_axis_that_is_pushed_in_boot_keeps_its_reference(void)
{
    home();
    bench.drives[0].position_counts += 50000000;
    app_bench_periods(&bench, 2);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2006, 1, (uint32_t)-190000000, 4));
    bench.drives[0].position_counts += NEAR; /* while it is looked for */
    boot();
    TEST_ASSERT_TRUE(homed(1));
}

static void test_an_interrupted_homing_affects_only_the_axis_under_way(void)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2012, 2, 37, 1));
    boot();
    bench.drives[0].homing_syncs = 5;
    bench.drives[1].homing_syncs = 100000;
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_HOME));
    app_bench_periods(&bench, 200);
    TEST_ASSERT_EQUAL_INT(HOMING_MOVE, bench.controller.homing.phase);
    TEST_ASSERT_EQUAL_UINT8(1, bench.controller.homing.axis);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_STOP));
    (void)app_bench_until(&bench, MACHINE_BOOT, 1000);
    boot();
    TEST_ASSERT_TRUE(homed(1));
    TEST_ASSERT_FALSE(homed(2));
}

/* --- what ends it --- */

/* Also from the homing before: the drive may have moved its zero already. */
static void test_a_homing_that_is_broken_off_loses_the_elder_zero(void)
{
    home();
    bench.drives[0].homing_syncs = 100000;
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_HOME));
    app_bench_periods(&bench, 200);
    TEST_ASSERT_EQUAL_INT(HOMING_MOVE, bench.controller.homing.phase);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_STOP));
    (void)app_bench_until(&bench, MACHINE_BOOT, 1000);
    boot();
    TEST_ASSERT_FALSE(homed(1));
}

static void test_a_drive_that_restarts_loses_it(void)
{
    home();
    fake_drive_init(&bench.drives[0], X_NODE, X_COUNTS);
    app_bench_period(&bench);
    TEST_ASSERT_FALSE(homed(1));
    boot();
    TEST_ASSERT_FALSE(homed(1));
}

/* Its boot-up message is received between the round of the main loop that takes frames and the end of its homing. */
static void test_a_drive_that_restarts_as_its_homing_ends_loses_it(void)
{
    struct can_msg frame;
    struct can_msg out;
    bench.drives[0].homing_syncs = 5;
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_HOME));
    while (!(bench.controller.homing.phase == HOMING_MOVE &&
             (machine()->axes[0].statusword & CIA402_STATUS_HOMING_ATTAINED) != 0u)) {
        app_bench_period_without_main_loop(&bench);
        if (bench.controller.homing.phase != HOMING_MOVE || bench.drives[0].homing_left > 0u) {
            app_bench_settle(&bench);
        }
    }
    for (uint32_t k = 0; k < HOMING_SYNCS_BEFORE_ANSWER; ++k) {
        app_bench_period_without_main_loop(&bench);
    }
    cob_frame(&frame, COB_HEARTBEAT + X_NODE, 1);
    frame.data[0] = (uint8_t)NMT_INITIALISING;
    fake_port_receive(&frame);
    TEST_ASSERT_FALSE(machine()->axes[0].homed);
    (void)homing_process(&bench.controller.homing, machine(), 0, &out);
    TEST_ASSERT_EQUAL_INT(HOMING_DISABLE, bench.controller.homing.phase);
    app_bench_period(&bench);
    TEST_ASSERT_FALSE(homed(1));
}

/* In every state of the boot that a fault reset leads to. */
static void test_a_drive_that_restarts_while_it_is_configured_loses_it(void)
{
    for (uint32_t periods = 0; periods < 120u; periods += 7u) {
        setUp();
        home();
        switch_on();
        fail();
        reset();
        app_bench_periods(&bench, periods);
        fake_drive_init(&bench.drives[0], X_NODE, X_COUNTS);
        app_bench_periods(&bench, 50);
        boot();
        TEST_ASSERT_FALSE(homed(1));
    }
}

/* The cable is out, the drive restarts meanwhile, and stands where it stood: nobody received its boot-up message. */
static void away(uint32_t periods)
{
    bench.drives[0].dead = true;
    app_bench_periods(&bench, periods);
    bench.drives[0].dead = false;
}

static void test_a_drive_that_was_away_loses_it(void)
{
    home();
    away(DRIVE_MONITOR_ZERO_MS + 150u);
    boot();
    TEST_ASSERT_FALSE(homed(1));
}

/* Away in boot, where its heartbeats are not supervised: the other drive is missing too. */
static void test_a_drive_that_was_away_in_boot_loses_it(void)
{
    home();
    bench.drives[1].dead = true;
    (void)app_bench_until(&bench, MACHINE_BOOT, 3000);
    app_bench_periods(&bench, 3000);
    TEST_ASSERT_TRUE_MESSAGE(homed(1), "its frames came all the time");
    away(DRIVE_MONITOR_ZERO_MS + 150u);
    bench.drives[1].dead = false;
    boot();
    TEST_ASSERT_FALSE(homed(1));
}

static void test_a_short_silence_is_none(void)
{
    home();
    away(300);
    app_bench_periods(&bench, 10);
    boot();
    TEST_ASSERT_TRUE(homed(1));
}

/* The time is the one that 0x1016 has for the drive. */
static void test_the_silence_that_counts_is_configured(void)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x1016, 1, 0x000200C8, 4));
    home();
    away(350);
    boot();
    TEST_ASSERT_FALSE(homed(1));
}

/* Its supply dipped for less than that, and it counts from somewhere else now. */
static void test_a_drive_that_is_found_somewhere_else_loses_it(void)
{
    static const int32_t jumps[] = {-X_COUNTS, 1000001, -1000001};
    for (unsigned i = 0; i < sizeof jumps / sizeof jumps[0]; ++i) {
        setUp();
        home();
        switch_on();
        fail();
        reset();
        bench.drives[0].position_counts += jumps[i];
        boot();
        TEST_ASSERT_FALSE(homed(1));
    }
}

static void test_a_drive_without_a_position_loses_its_reference(void)
{
    home();
    bench.drives[0].lacks[0] = 0x6064;
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2006, 1, (uint32_t)-190000000, 4));
    boot();
    TEST_ASSERT_FALSE(homed(1));
}

static void test_an_encoder_that_fails_loses_it(void)
{
    home();
    emergency(EMCY_FOLLOWING_ERROR);
    TEST_ASSERT_TRUE(homed(1));
    emergency(EMCY_POSITION_SENSOR_1);
    TEST_ASSERT_FALSE(homed(1));
}

static void test_other_coordinates_lose_it(void)
{
    static const struct {
        uint16_t index;
        uint8_t sub;
        uint8_t size;
        uint32_t value;
        bool kept;
    } objects[] = {
        {0x2007, 1, 4, 190000000, true}, {0x201F, 1, 4, 1000000, true},
        {0x2051, 1, 4, 0, true},         {0x2013, 1, 4, X_COUNTS + 1, false},
        {0x2012, 1, 1, 35, false},       {0x2020, 1, 4, 65536, false},
        {0x2021, 1, 4, 7000000, false},  {0x2022, 1, 4, 2, false},
        {0x2023, 1, 4, 2, false},        {0x2004, 7, 4, 1000, false},
        {0x2005, 1, 1, 9, false},        {0x2013, 2, 4, 5, true},
    };
    for (unsigned i = 0; i < sizeof objects / sizeof objects[0]; ++i) {
        setUp();
        home();
        TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, objects[i].index, objects[i].sub,
                                                        objects[i].value, objects[i].size));
        app_bench_periods(&bench, 50);
        TEST_ASSERT_EQUAL_INT(objects[i].kept, homed(1));
    }
}

static void test_an_axis_that_was_left_out_for_a_while_loses_it(void)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2012, 2, 37, 1));
    boot();
    bench.drives[1].homing_syncs = 5;
    home();
    TEST_ASSERT_TRUE(homed(2));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2004, 1, 1, 1));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2004, 1, 2, 1));
    boot();
    TEST_ASSERT_TRUE(homed(1));
    TEST_ASSERT_FALSE(homed(2));
}

/* Drives stay up: a new controller cannot know. */
static void test_a_controller_that_restarts_loses_it(void)
{
    home();
    app_bench_power_cycle(&bench);
    app_bench_settle(&bench);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2012, 1, 37, 1));
    boot();
    TEST_ASSERT_FALSE(homed(1));
    switch_on();
    expect_not_homed(COMMAND_START);
}

/* The main loop is busy, its queue full: the boot-up message finds no room. */
static void test_a_boot_up_message_that_finds_no_room_counts(void)
{
    struct can_msg boot_up;
    home();
    cob_frame(&boot_up, COB_HEARTBEAT + 99u, 1);
    boot_up.data[0] = (uint8_t)NMT_OPERATIONAL;
    for (unsigned i = 0; i < 2000u; ++i) {
        fake_port_receive(&boot_up);
    }
    cob_frame(&boot_up, COB_HEARTBEAT + X_NODE, 1);
    boot_up.data[0] = 0;
    fake_port_receive(&boot_up);
    TEST_ASSERT_FALSE(machine()->axes[0].homed);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_start_needs_homed_axes);
    RUN_TEST(test_unhomed_is_for_one_command);
    RUN_TEST(test_a_refused_start_ends_the_permission);
    RUN_TEST(test_a_start_while_the_controller_ends_takes_the_permission_too);
    RUN_TEST(test_a_fault_reset_keeps_it);
    RUN_TEST(test_an_axis_that_is_pushed_in_boot_keeps_its_reference);
    RUN_TEST(test_an_interrupted_homing_affects_only_the_axis_under_way);
    RUN_TEST(test_a_homing_that_is_broken_off_loses_the_elder_zero);
    RUN_TEST(test_a_drive_that_restarts_loses_it);
    RUN_TEST(test_a_drive_that_restarts_as_its_homing_ends_loses_it);
    RUN_TEST(test_a_drive_that_restarts_while_it_is_configured_loses_it);
    RUN_TEST(test_a_drive_that_was_away_loses_it);
    RUN_TEST(test_a_drive_that_was_away_in_boot_loses_it);
    RUN_TEST(test_a_short_silence_is_none);
    RUN_TEST(test_the_silence_that_counts_is_configured);
    RUN_TEST(test_a_drive_that_is_found_somewhere_else_loses_it);
    RUN_TEST(test_a_drive_without_a_position_loses_its_reference);
    RUN_TEST(test_an_encoder_that_fails_loses_it);
    RUN_TEST(test_other_coordinates_lose_it);
    RUN_TEST(test_an_axis_that_was_left_out_for_a_while_loses_it);
    RUN_TEST(test_a_controller_that_restarts_loses_it);
    RUN_TEST(test_a_boot_up_message_that_finds_no_room_counts);
    return UNITY_END();
}
