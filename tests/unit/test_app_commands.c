/* SPDX-License-Identifier: MIT */
/* The table "Commands by state" of docs/reference/architecture.md, every cell of it. Run by `make unit`; no I/O. */
#include "app/commands.h"
#include "canopen/cob.h"
#include "canopen/sdo_abort.h"

#include <stdio.h>

#include "app_bench.h"
#include "app_image.h"
#include "fake_port.h"
#include "unity.h"

#define X_COUNTS   10000000
#define Y_COUNTS   (-5000000)
#define COMMANDS   10u
#define STAYS      (-1) /* accepted without effect */
#define TO(state)  (100 + (int)(state))
#define NOT_TESTED (-2)

static struct app_bench bench;
static uint8_t image[APP_IMAGE_SIZE];

static struct machine *machine(void)
{
    return &bench.controller.machine;
}

static void run(unsigned command)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, command));
}

static void boot(void)
{
    app_bench_init(&bench, X_COUNTS, Y_COUNTS);
    app_image_make(image, 10, -5);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_upload(&bench, image, sizeof image));
}

static void off(void)
{
    boot();
    (void)app_bench_until(&bench, MACHINE_OFF, 2000);
}

static void enabling(void)
{
    off();
    bench.drives[0].state.flags &= (uint16_t)~CIA402_STATUS_FOLLOWS;
    run(COMMAND_ENABLE);
}

static void ready(void)
{
    off();
    run(COMMAND_ENABLE);
    (void)app_bench_until(&bench, MACHINE_READY, 100);
    app_bench_periods(&bench, AXIS_STANDSTILL_SYNCS);
}

static void running(void)
{
    ready();
    run(COMMAND_START);
    app_bench_periods(&bench, 250);
}

static void stopping(void)
{
    running();
    run(COMMAND_STOP);
}

static void holding(void)
{
    running();
    run(COMMAND_HOLD);
}

static void held(void)
{
    holding();
    (void)app_bench_until(&bench, MACHINE_HELD, 1000);
}

static void homing(void)
{
    off();
    port_lock();
    (void)machine_begin_homing(machine());
    port_unlock();
}

static void quick_stop(void)
{
    running();
    bench.drives[0].quick_stop_syncs = 1000;
    run(COMMAND_QUICK_STOP);
}

static void fault_braking(void)
{
    running();
    port_lock();
    machine_raise(machine(), EMCY_HEARTBEAT, 2, 0);
    port_unlock();
}

static void fault_quick(void)
{
    fault_braking();
    bench.drives[0].quick_stop_syncs = 1000;
    run(COMMAND_QUICK_STOP);
}

static void fault_off(void)
{
    fault_braking();
    run(COMMAND_QUICK_STOP);
    app_bench_periods(&bench, 10);
    TEST_ASSERT_EQUAL_INT(MACHINE_FAULT_OFF, machine()->fault_phase);
}

static void fault_resetting(void)
{
    running();
    bench.drives[1].stuck = true;
    app_bench_periods(&bench, 10);
    run(COMMAND_RESET);
}

/* Columns: commands 1 ... 10, configuration, upload (0 refused, 1 done). TO: the state after it. */
static const struct row {
    const char *name;
    void (*reach)(void);
    enum machine_state state;
    int cells[COMMANDS + 2u];
} rows[] = {
    /* enable, start, stop, disable, reset, hold, resume, start from, quick stop, home */
    {"boot", boot, MACHINE_BOOT, {6, 6, STAYS, 6, STAYS, 8, 8, 6, STAYS, 6, 1, 1}},
    {"off",
     off,
     MACHINE_OFF,
     {TO(MACHINE_ENABLING), 4, STAYS, STAYS, TO(MACHINE_BOOT), 8, 8, 4, STAYS, NOT_TESTED, 1, 1}},
    {"enabling",
     enabling,
     MACHINE_ENABLING,
     {STAYS, 4, TO(MACHINE_OFF), TO(MACHINE_OFF), STAYS, 8, 8, 4, TO(MACHINE_QUICK_STOP), 9, 0, 1}},
    {"ready",
     ready,
     MACHINE_READY,
     {STAYS, TO(MACHINE_RUNNING), STAYS, TO(MACHINE_OFF), STAYS, 8, 8, TO(MACHINE_RUNNING),
      TO(MACHINE_QUICK_STOP), 9, 0, 1}},
    {"running",
     running,
     MACHINE_RUNNING,
     {3, 3, TO(MACHINE_STOPPING), 3, STAYS, TO(MACHINE_HOLDING), STAYS, 3, TO(MACHINE_QUICK_STOP),
      3, 0, 0}},
    {"stopping",
     stopping,
     MACHINE_STOPPING,
     {3, 3, STAYS, 3, STAYS, 8, 8, 3, TO(MACHINE_QUICK_STOP), 3, 0, 0}},
    {"holding",
     holding,
     MACHINE_HOLDING,
     {3, 3, TO(MACHINE_STOPPING), 3, STAYS, STAYS, TO(MACHINE_RUNNING), 3, TO(MACHINE_QUICK_STOP),
      3, 0, 0}},
    {"held",
     held,
     MACHINE_HELD,
     {3, 3, TO(MACHINE_STOPPING), 3, STAYS, STAYS, TO(MACHINE_RUNNING), 3, TO(MACHINE_QUICK_STOP),
      3, 0, 0}},
    {"homing",
     homing,
     MACHINE_HOMING,
     {3, 3, TO(MACHINE_QUICK_STOP), TO(MACHINE_QUICK_STOP), STAYS, 8, 8, 3, TO(MACHINE_QUICK_STOP),
      3, 0, 0}},
    {"quick stop",
     quick_stop,
     MACHINE_QUICK_STOP,
     {3, 3, STAYS, 3, STAYS, 8, 8, 3, STAYS, 3, 0, 0}},
    {"fault, braking", fault_braking, MACHINE_FAULT, {5, 5, STAYS, 5, 3, 5, 5, 5, STAYS, 5, 0, 0}},
    {"fault, quick stop", fault_quick, MACHINE_FAULT, {5, 5, STAYS, 5, 3, 5, 5, 5, STAYS, 5, 0, 0}},
    {"fault, off", fault_off, MACHINE_FAULT, {5, 5, STAYS, 5, STAYS, 5, 5, 5, STAYS, 5, 1, 1}},
    {"fault, resetting",
     fault_resetting,
     MACHINE_FAULT,
     {5, 5, STAYS, 5, STAYS, 5, 5, 5, STAYS, 5, 0, 1}},
};

void setUp(void)
{
}

void tearDown(void)
{
}

/* Without a period in between, so that what is seen is what the command did. */
static void check_command(const struct row *row, unsigned command, int expected)
{
    static char where[64];
    row->reach();
    (void)snprintf(where, sizeof where, "%s, command %u", row->name, command);
    TEST_ASSERT_EQUAL_INT_MESSAGE(row->state, machine()->state, where);
    const bool refused = expected >= 0 && expected < TO(0);
    const uint32_t abort_code = app_bench_command(&bench, command);
    TEST_ASSERT_EQUAL_HEX32_MESSAGE(refused ? SDO_ABORT_STATE : SDO_OK, abort_code, where);
    TEST_ASSERT_EQUAL_INT_MESSAGE(refused ? expected : 0, app_bench_read(&bench, 0x2003, 4), where);
    const int after = expected >= TO(0) ? expected - TO(0) : (int)row->state;
    TEST_ASSERT_EQUAL_INT_MESSAGE(after, machine()->state, where);
}

static void test_every_command_in_every_state(void)
{
    for (unsigned i = 0; i < sizeof rows / sizeof rows[0]; ++i) {
        for (unsigned k = 0; k < COMMANDS; ++k) {
            if (rows[i].cells[k] != NOT_TESTED) { /* home from off: test_app_homing */
                check_command(&rows[i], k + 1u, rows[i].cells[k]);
            }
        }
    }
}

static void test_configuration_and_upload_in_every_state(void)
{
    for (unsigned i = 0; i < sizeof rows / sizeof rows[0]; ++i) {
        const struct row *row = &rows[i];
        row->reach();
        TEST_ASSERT_EQUAL_HEX32_MESSAGE(row->cells[COMMANDS] != 0 ? SDO_OK : SDO_ABORT_STATE,
                                        app_bench_write(&bench, 0x2004, 2, 100000, 4), row->name);
        row->reach();
        TEST_ASSERT_EQUAL_HEX32_MESSAGE(row->cells[COMMANDS + 1u] != 0 ? SDO_OK : SDO_ABORT_STATE,
                                        app_bench_upload(&bench, image, sizeof image), row->name);
    }
}

/* ---- Object 0x2056: a start that names its program ---- */

static uint32_t named_start(uint8_t sub, uint32_t number)
{
    return app_bench_write(&bench, 0x2056, sub, number, 4);
}

static void expect_other_program(uint8_t sub, uint32_t number)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, named_start(sub, number));
    TEST_ASSERT_EQUAL_INT(MACHINE_OTHER_PROGRAM, app_bench_read(&bench, 0x2003, 4));
    TEST_ASSERT_EQUAL_INT(MACHINE_READY, machine()->state);
}

static void test_a_named_start_starts_that_program_only(void)
{
    for (uint8_t sub = 1; sub <= 2u; ++sub) {
        ready();
        const uint32_t crc32 = (uint32_t)app_bench_read(&bench, 0x2000, 5);
        app_image_make(image, 10, -4); /* another client uploads */
        TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_upload(&bench, image, sizeof image));
        expect_other_program(sub, crc32);
        expect_other_program(3, crc32);
        app_image_make(image, 10, -5);
        TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_upload(&bench, image, sizeof image));
        TEST_ASSERT_EQUAL_HEX32(SDO_OK, named_start(sub, crc32));
        TEST_ASSERT_EQUAL_INT(MACHINE_RUNNING, machine()->state);
    }
}

static void test_a_named_start_that_is_refused_ends_the_permission(void)
{
    ready();
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2055, 1, 1, 1));
    expect_other_program(1, 0x12345678u);
    TEST_ASSERT_EQUAL_INT64(0, app_bench_read(&bench, 0x2055, 1));
}

static void test_a_named_start_without_a_program(void)
{
    app_bench_init(&bench, X_COUNTS, Y_COUNTS);
    app_bench_make_ready(&bench);
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, named_start(1, 1));
    TEST_ASSERT_EQUAL_INT(MACHINE_NO_PROGRAM, app_bench_read(&bench, 0x2003, 4));
}

/* ---- Object 0x2057: stop commands between the check of the host and its start ---- */

static void expect_stops(uint32_t expected)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2057, 2, expected, 4));
}

static void test_a_start_after_a_stop_that_the_host_does_not_know(void)
{
    static const unsigned stops[] = {COMMAND_STOP, COMMAND_QUICK_STOP, COMMAND_DISABLE};
    for (unsigned i = 0; i < sizeof stops / sizeof stops[0]; ++i) {
        ready();
        const uint32_t before = (uint32_t)app_bench_read(&bench, 0x2057, 1);
        TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, stops[i]));
        TEST_ASSERT_NOT_EQUAL_UINT32(before, app_bench_read(&bench, 0x2057, 1));
        if (stops[i] != COMMAND_STOP) {
            (void)app_bench_until(&bench, MACHINE_OFF, 3000);
            app_bench_make_ready(&bench);
        }
        expect_stops(before);
        TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, app_bench_command(&bench, COMMAND_START));
        TEST_ASSERT_EQUAL_INT(MACHINE_STOPPED, app_bench_read(&bench, 0x2003, 4));
        TEST_ASSERT_EQUAL_INT(MACHINE_READY, machine()->state);
        /* the number is valid for one start */
        TEST_ASSERT_EQUAL_HEX32(UINT32_MAX, app_bench_read(&bench, 0x2057, 2));
        TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_START));
    }
}

static void test_a_start_that_knows_all_stops(void)
{
    ready();
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_STOP));
    expect_stops((uint32_t)app_bench_read(&bench, 0x2057, 1));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_START));
    TEST_ASSERT_EQUAL_HEX32(UINT32_MAX, app_bench_read(&bench, 0x2057, 2));
}

/* ---- Drives of axes outside their travel ---- */

static void limit_travel(int32_t least_counts, int32_t most_counts)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2006, 1, (uint32_t)least_counts, 4));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2007, 1, (uint32_t)most_counts, 4));
    (void)app_bench_until(&bench, MACHINE_OFF, 3000);
}

static void test_no_drive_is_switched_on_outside_its_travel(void)
{
    const int32_t slack = (int32_t)config_tolerance_counts(&bench.controller.config, 0);
    static const int32_t side[] = {-1, 1};
    for (unsigned i = 0; i < 2u; ++i) {
        off();
        const int32_t at = bench.drives[0].position_counts;
        const int32_t beyond = at + side[i] * (slack + 1);
        limit_travel(side[i] < 0 ? at - 1000000 : beyond, side[i] < 0 ? beyond : at + 1000000);
        TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, app_bench_command(&bench, COMMAND_ENABLE));
        TEST_ASSERT_EQUAL_INT(MACHINE_OUTSIDE_TRAVEL, app_bench_read(&bench, 0x2003, 4));
        TEST_ASSERT_EQUAL_INT(MACHINE_OFF, machine()->state);
        for (int32_t less = 0; less < 2; ++less) {
            off();
            const int32_t near = at + side[i] * (slack - less);
            limit_travel(side[i] < 0 ? at - 1000000 : near, side[i] < 0 ? near : at + 1000000);
            TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, COMMAND_ENABLE));
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_command_in_every_state);
    RUN_TEST(test_configuration_and_upload_in_every_state);
    RUN_TEST(test_a_named_start_starts_that_program_only);
    RUN_TEST(test_a_named_start_that_is_refused_ends_the_permission);
    RUN_TEST(test_a_named_start_without_a_program);
    RUN_TEST(test_a_start_after_a_stop_that_the_host_does_not_know);
    RUN_TEST(test_a_start_that_knows_all_stops);
    RUN_TEST(test_no_drive_is_switched_on_outside_its_travel);
    return UNITY_END();
}
