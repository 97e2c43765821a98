/* SPDX-License-Identifier: MIT */
/* Outputs of the path at an I/O module: through the dictionary, compared with the positions of ideal drives, on a
 * bus without delays. Run by `make unit`; no I/O. */
#include <string.h>

#include "app/commands.h"
#include "app_bench.h"
#include "app_image.h"
#include "canopen/cob.h"
#include "canopen/emcy.h"
#include "canopen/sdo_abort.h"
#include "core/crc32.h"
#include "core/program.h"
#include "unity.h"

#define X_COUNTS 10000000
#define Y_COUNTS (-5000000)
#define MODULE   16u
#define MOST     8u
#define Q40_MM   INT64_C(1099511627776)

#define ON_UM         1500 /* the valve, output 9 */
#define OFF_UM        3000
#define GAIN          (100 * 65536) /* of the power, analogue output 1, by mm/s */
#define VALVE         0x0200u
#define LAMP          0x0001u /* on from the start */
#define KEPT_AT_STOP  1u
#define KEPT_AT_FAULT 2u
#define OFF_AT_END    4u
#define OFF_IN_HOLD   8u

static struct app_bench bench;
static uint8_t image[APP_IMAGE_SIZE + MOST * PROGRAM_EVENT_SIZE];
static uint32_t image_size;

static void add_event(int64_t place_q40_mm, uint8_t kind, uint8_t channel, uint16_t mask,
                      int32_t value)
{
    uint8_t *at = image + image_size;
    cob_put(at, (uint64_t)place_q40_mm, 8);
    at[8] = kind;
    at[9] = channel;
    cob_put16(at + 10, mask);
    cob_put32(at + 12, (uint32_t)value);
    image_size += PROGRAM_EVENT_SIZE;
    cob_put32(image + 76, (image_size - APP_IMAGE_SIZE) / PROGRAM_EVENT_SIZE);
    cob_put32(image + 8, image_size);
    cob_put32(image + 12, crc32_update(0, image + 16, image_size - 16u));
}

static int64_t um(int32_t value)
{
    return value * Q40_MM / 1000;
}

static void make_image(void)
{
    app_image_make(image, 10, -5);
    image_size = APP_IMAGE_SIZE;
    add_event(0, PROGRAM_EVENT_DIGITAL, 0, LAMP, LAMP);
    add_event(0, PROGRAM_EVENT_PROPORTIONAL, 1, 0, GAIN);
    add_event(um(ON_UM), PROGRAM_EVENT_DIGITAL, 0, VALVE, VALVE);
    add_event(um(ON_UM), PROGRAM_EVENT_ANALOGUE, 2, 0, -1234);
    add_event(um(OFF_UM), PROGRAM_EVENT_DIGITAL, 0, VALVE, 0);
}

static void command(unsigned number)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(&bench, number));
}

static void configure(uint8_t sub, uint32_t value, uint8_t size)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2035, sub, value, size));
}

static uint16_t digital(void)
{
    const uint8_t *bytes = bench.module.values.write_output_8_bit;
    return (uint16_t)(bytes[0] | bytes[1] << 8);
}

static int16_t analogue(unsigned i)
{
    return bench.module.values.write_analogue_output_16_bit[i];
}

static int32_t place_counts(void)
{
    return bench.drives[0].position_counts - X_COUNTS;
}

static void configure_module(void)
{
    app_bench_add_module(&bench, MODULE);
    configure(1, MODULE, 1);
    configure(2, 16, 1);
    configure(3, 3, 1);
}

static void make_ready(void)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_upload(&bench, image, image_size));
    app_bench_make_ready(&bench);
}

void setUp(void)
{
    app_bench_init(&bench, X_COUNTS, Y_COUNTS);
    make_image();
    configure_module();
}

void tearDown(void)
{
}

/* The outputs are those of the place where the axes are, at this very SYNC; the valve's places are no counts
 * exactly. */
static void check_place(void)
{
    const int32_t at = place_counts();
    const bool valve = at >= ON_UM * 1000 && at < OFF_UM * 1000;
    TEST_ASSERT_EQUAL_HEX16(valve ? LAMP | VALVE : LAMP, digital());
    TEST_ASSERT_EQUAL_INT16(at >= ON_UM * 1000 ? -1234 : 0, analogue(2));
}

static void run_to_the_end(void)
{
    uint32_t most = 6000;
    while (bench.controller.machine.state != MACHINE_READY && most-- > 0u) {
        app_bench_period(&bench);
        check_place();
    }
    TEST_ASSERT_EQUAL_INT32(4000000, place_counts());
}

/* The first setpoint is reached two SYNCs after it is sent. */
static void start(void)
{
    command(COMMAND_START);
    app_bench_periods(&bench, 3);
}

static void test_outputs_are_on_where_the_axes_are(void)
{
    make_ready();
    TEST_ASSERT_EQUAL_HEX16(0, digital());
    start();
    run_to_the_end();
    TEST_ASSERT_EQUAL_HEX16(LAMP, digital());
    TEST_ASSERT_EQUAL_INT16(0, analogue(1));
    TEST_ASSERT_EQUAL_INT(LAMP, app_bench_read(&bench, 0x2036, 1));
    TEST_ASSERT_EQUAL_INT(0, app_bench_read(&bench, 0x2036, 2));
    TEST_ASSERT_EQUAL_INT(-1234, app_bench_read(&bench, 0x2036, 5));
}

static void test_the_place_is_kept_at_any_override(void)
{
    static const uint8_t percents[] = {50, 200, 7, 130};
    make_ready();
    start();
    for (uint32_t i = 0; bench.controller.machine.state != MACHINE_READY; ++i) {
        if (i % 40u == 0u) {
            TEST_ASSERT_EQUAL_HEX32(SDO_OK,
                                    app_bench_write(&bench, 0x2010, 1, percents[i / 40u % 4u], 2));
        }
        app_bench_period(&bench);
        check_place();
        TEST_ASSERT_TRUE(i < 6000u);
    }
}

static void test_a_hold_at_any_instant_keeps_them(void)
{
    for (uint32_t at = 5; at < 450u; at += 33u) {
        setUp();
        make_ready();
        start();
        app_bench_periods(&bench, at);
        command(COMMAND_HOLD);
        for (uint32_t i = 0; i < 300u; ++i) {
            app_bench_period(&bench);
            check_place();
        }
        TEST_ASSERT_EQUAL_INT16(0, analogue(1));
        if (bench.controller.machine.state == MACHINE_HELD) { /* else the end came first */
            command(COMMAND_RESUME);
        }
        run_to_the_end();
    }
}

/* In mid-program, after the places where both switch on. */
static void start_with_outputs_on(uint32_t behaviour)
{
    configure(4, behaviour, 1);
    make_ready();
    start();
    app_bench_periods(&bench, 250);
    TEST_ASSERT_EQUAL_HEX16(LAMP | VALVE, digital());
}

static void test_off_in_hold_comes_back(void)
{
    start_with_outputs_on(OFF_IN_HOLD);
    command(COMMAND_HOLD);
    app_bench_periods(&bench, 2);
    TEST_ASSERT_EQUAL_HEX16(0, digital());
    TEST_ASSERT_EQUAL_INT16(0, analogue(2));
    (void)app_bench_until(&bench, MACHINE_HELD, 500);
    command(COMMAND_RESUME);
    app_bench_periods(&bench, 3);
    check_place();
    run_to_the_end();
}

static void test_proportional_value_follows_the_feed(void)
{
    int16_t most = 0;
    make_ready();
    start();
    for (uint32_t i = 0; i < 500u; ++i) {
        const int32_t before = place_counts();
        app_bench_period(&bench);
        /* 100 for each mm/s; 1 mm/s is 1000 counts a period, but for the change of the feed within it */
        TEST_ASSERT_INT32_WITHIN(10, (place_counts() - before) / 10, analogue(1));
        most = analogue(1) > most ? analogue(1) : most;
    }
    TEST_ASSERT_INT16_WITHIN(1, 1500, most);
}

static void check_after_stop(unsigned number, uint32_t behaviour, bool kept)
{
    setUp();
    start_with_outputs_on(behaviour);
    command(number);
    app_bench_periods(&bench, 2);
    TEST_ASSERT_EQUAL_HEX16(kept ? LAMP | VALVE : 0, digital());
    app_bench_periods(&bench, 600);
    TEST_ASSERT_EQUAL_INT16(0, kept ? 0 : analogue(2));
    if (kept && number == COMMAND_STOP) {
        check_place();
        TEST_ASSERT_EQUAL_INT16(0, analogue(1));
    } else {
        TEST_ASSERT_EQUAL_HEX16(kept ? LAMP | VALVE : 0, digital());
    }
}

static void test_stop_and_quick_stop(void)
{
    check_after_stop(COMMAND_STOP, 0, false);
    check_after_stop(COMMAND_STOP, KEPT_AT_STOP, true);
    check_after_stop(COMMAND_STOP, KEPT_AT_FAULT, false);
    check_after_stop(COMMAND_QUICK_STOP, 0, false);
    check_after_stop(COMMAND_QUICK_STOP, KEPT_AT_STOP, false);
    check_after_stop(COMMAND_QUICK_STOP, KEPT_AT_FAULT, true);
}

static void test_end_and_disable(void)
{
    configure(4, OFF_AT_END, 1);
    make_ready();
    start();
    (void)app_bench_until(&bench, MACHINE_READY, 1000);
    app_bench_periods(&bench, 2);
    TEST_ASSERT_EQUAL_HEX16(0, digital());
    setUp();
    make_ready();
    start();
    (void)app_bench_until(&bench, MACHINE_READY, 1000);
    app_bench_periods(&bench, AXIS_STANDSTILL_SYNCS);
    TEST_ASSERT_EQUAL_HEX16(LAMP, digital());
    command(COMMAND_DISABLE);
    app_bench_periods(&bench, 3);
    TEST_ASSERT_EQUAL_HEX16(0, digital());
}

static void test_start_from_a_place_has_all_events_before_it(void)
{
    app_bench_init(&bench, X_COUNTS + 2000000, Y_COUNTS);
    configure_module();
    make_ready();
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2011, 0, (uint64_t)um(2000), 8));
    command(COMMAND_START_FROM);
    app_bench_periods(&bench, 3);
    run_to_the_end();
}

static void test_delay_by_ticks(void)
{
    for (uint32_t delay = 0; delay <= CONFIG_OUTPUTS_DELAY_MAX; ++delay) {
        uint32_t on = 0;
        uint32_t there = 0;
        setUp();
        configure(5, delay, 1);
        make_ready();
        start();
        for (uint32_t i = 1; i < 450u; ++i) {
            app_bench_period(&bench);
            on = on == 0u && (digital() & VALVE) != 0u ? i : on;
            there = there == 0u && place_counts() >= ON_UM * 1000 ? i : there;
        }
        TEST_ASSERT_EQUAL_UINT32(there + delay, on + 1u);
    }
}

static void test_module_that_is_lost_stops_the_machine(void)
{
    make_ready();
    start();
    app_bench_periods(&bench, 100);
    bench.module_dead = true;
    (void)app_bench_until(&bench, MACHINE_FAULT, 1500);
    TEST_ASSERT_EQUAL_HEX16(EMCY_HEARTBEAT, app_bench_read(&bench, 0x2003, 1));
    TEST_ASSERT_EQUAL_INT(MODULE, app_bench_read(&bench, 0x2003, 2));
}

static void test_module_that_restarts_stops_the_machine(void)
{
    make_ready();
    start();
    app_bench_periods(&bench, 100);
    app_bench_add_module(&bench, MODULE);
    app_bench_periods(&bench, 5);
    TEST_ASSERT_EQUAL_INT(MACHINE_FAULT, bench.controller.machine.state);
    TEST_ASSERT_EQUAL_HEX16(FAULT_REBOOTED, app_bench_read(&bench, 0x2003, 1));
    TEST_ASSERT_EQUAL_INT(MODULE, app_bench_read(&bench, 0x2003, 2));
    app_bench_periods(&bench, 1000);
    command(COMMAND_RESET);
    (void)app_bench_until(&bench, MACHINE_OFF, 3000);
    TEST_ASSERT_EQUAL_HEX16(0, digital());
}

/* Its start command was lost, or it has left OPERATIONAL: its heartbeats come all the time. */
static void test_module_that_is_not_operational_is_started_again(void)
{
    make_ready();
    command(COMMAND_DISABLE);
    bench.module.nmt.state = NMT_PRE_OPERATIONAL;
    (void)app_bench_until(&bench, MACHINE_BOOT, 1200);
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
    TEST_ASSERT_EQUAL_INT(NMT_OPERATIONAL, bench.module.nmt.state);
    app_bench_periods(&bench, 3000);
    TEST_ASSERT_EQUAL_INT(MACHINE_OFF, bench.controller.machine.state);
}

static void test_module_that_is_not_operational_stops_the_machine(void)
{
    make_ready();
    bench.module.nmt.state = NMT_STOPPED;
    app_bench_periods(&bench, 900);
    TEST_ASSERT_EQUAL_INT(MACHINE_READY, bench.controller.machine.state);
    (void)app_bench_until(&bench, MACHINE_FAULT, 300);
    TEST_ASSERT_EQUAL_HEX16(EMCY_HEARTBEAT, app_bench_read(&bench, 0x2003, 1));
    TEST_ASSERT_EQUAL_INT(MODULE, app_bench_read(&bench, 0x2003, 2));
    TEST_ASSERT_EQUAL_HEX32(NMT_STOPPED, app_bench_read(&bench, 0x2003, 3));
}

/* It was configured and started, and is lost before its first heartbeat. */
static void test_module_that_is_lost_before_its_first_heartbeat(void)
{
    while (bench.controller.machine.state != MACHINE_OFF) {
        app_bench_period(&bench);
        if (bench.module.nmt.state == NMT_OPERATIONAL) {
            bench.module_dead = true;
        }
    }
    bench.controller.monitor.consumers[BENCH_DRIVES].presence = HEARTBEAT_UNKNOWN;
    (void)app_bench_until(&bench, MACHINE_BOOT, 1200);
}

/* Kept at the fault; but in boot they are off, also while a drive is missing. */
static void test_boot_that_waits_for_a_drive_switches_off(void)
{
    configure(4, KEPT_AT_FAULT, 1);
    make_ready();
    start();
    app_bench_periods(&bench, 100);
    bench.drives[1].dead = true;
    (void)app_bench_until(&bench, MACHINE_FAULT, 100);
    app_bench_periods(&bench, 2500);
    TEST_ASSERT_EQUAL_HEX16(LAMP, digital() & LAMP);
    command(COMMAND_RESET);
    (void)app_bench_until(&bench, MACHINE_BOOT, 1000);
    app_bench_periods(&bench, 100);
    TEST_ASSERT_EQUAL_INT(MACHINE_BOOT, bench.controller.machine.state);
    TEST_ASSERT_EQUAL_HEX16(0, digital());
}

/* The power of the controller was off for less than the module waits for its heartbeat; a drive has lost it too. */
static void test_controller_that_restarts_switches_off(void)
{
    make_ready();
    start();
    app_bench_periods(&bench, 100);
    bench.drives[0].dead = true;
    app_bench_power_cycle(&bench);
    configure(1, MODULE, 1);
    configure(2, 16, 1);
    configure(3, 3, 1);
    TEST_ASSERT_EQUAL_HEX16(LAMP, digital() & LAMP);
    app_bench_periods(&bench, 100);
    TEST_ASSERT_EQUAL_HEX16(0, digital());
    TEST_ASSERT_EQUAL_INT16(0, analogue(1));
}

/* It does not know its module any more. The module misses its heartbeats, as if the power had stayed off. */
static void test_controller_that_restarts_without_a_configuration(void)
{
    make_ready();
    app_bench_periods(&bench, 1000); /* the module has received a heartbeat */
    start();
    app_bench_periods(&bench, 100);
    app_bench_power_cycle(&bench);
    bench.beats = 0;
    app_bench_periods(&bench, 100);
    TEST_ASSERT_EQUAL_HEX16(LAMP, digital() & LAMP);
    app_bench_periods(&bench, 2200);
    TEST_ASSERT_EQUAL_HEX16(0, digital());
    TEST_ASSERT_EQUAL_INT16(0, analogue(1));
    TEST_ASSERT_EQUAL_INT(MACHINE_OFF, bench.controller.machine.state);
    TEST_ASSERT_EQUAL_UINT32(1, bench.beats);
    app_bench_periods(&bench, 1000);
    TEST_ASSERT_UINT32_WITHIN(1, 9, bench.beats);
}

static void test_module_that_is_missing_or_another_one(void)
{
    bench.module_dead = true;
    app_bench_periods(&bench, 2000);
    TEST_ASSERT_EQUAL_INT(MACHINE_BOOT, bench.controller.machine.state);
    TEST_ASSERT_EQUAL_INT(MODULE, app_bench_read(&bench, 0x2025, 1));
    bench.module_dead = false;
    configure(7, 4711, 4);
    app_bench_periods(&bench, 1500);
    TEST_ASSERT_EQUAL_INT(MACHINE_BOOT, bench.controller.machine.state);
    TEST_ASSERT_EQUAL_HEX32(0x101802, app_bench_read(&bench, 0x2025, 2));
    configure(7, 3, 4);
    (void)app_bench_until(&bench, MACHINE_OFF, 2000);
    TEST_ASSERT_EQUAL_INT64(2, app_bench_read(&bench, 0x2028, 2));
    TEST_ASSERT_EQUAL_INT64(0, app_bench_read(&bench, 0x2028, 3)); /* there is no third drive */
}

static void test_refused_values(void)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_VALUE, app_bench_write(&bench, 0x2035, 2, 9, 1));
    TEST_ASSERT_NOT_EQUAL(SDO_OK, app_bench_write(&bench, 0x2035, 3, 4, 1));
    TEST_ASSERT_NOT_EQUAL(SDO_OK, app_bench_write(&bench, 0x2035, 5, 9, 1));
    configure(1, 3, 1); /* the node of a drive */
    app_bench_periods(&bench, 500);
    TEST_ASSERT_EQUAL_INT(MACHINE_BOOT, bench.controller.machine.state);
    TEST_ASSERT_EQUAL_HEX32(0x203501, app_bench_read(&bench, 0x2025, 2));
}

static void test_module_without_its_controller_switches_off(void)
{
    for (unsigned i = 0; i < 3u; ++i) { /* it would keep them */
        bench.module.values.analogue_output_error_mode[i] = 0;
    }
    make_ready();
    start();
    app_bench_periods(&bench, 250);
    TEST_ASSERT_EQUAL_HEX16(LAMP | VALVE, digital());
    TEST_ASSERT_EQUAL_INT16(-1234, analogue(2));
    for (uint32_t i = 0; i < 200u; ++i) {
        io_module_process(&bench.module, 11000);
    }
    TEST_ASSERT_EQUAL_HEX16(0, digital());
    TEST_ASSERT_EQUAL_INT16(0, analogue(2));
}

/* ---- Outputs at standstill (0x2058) ---- */

static uint32_t set_outputs(uint8_t sub, uint32_t value)
{
    return app_bench_write(&bench, 0x2058, sub, value, sub <= 2u ? 1u : 2u);
}

static void set_lamp_and_speed(void)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, set_outputs(4, (uint16_t)-321));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, set_outputs(1, LAMP));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, set_outputs(2, VALVE >> 8));
    app_bench_periods(&bench, 3);
    TEST_ASSERT_EQUAL_HEX16(LAMP | VALVE, digital());
    TEST_ASSERT_EQUAL_INT16(-321, analogue(1));
}

static void test_outputs_at_standstill(void)
{
    make_ready();
    set_lamp_and_speed();
    TEST_ASSERT_EQUAL_INT(LAMP, app_bench_read(&bench, 0x2058, 1));
    TEST_ASSERT_EQUAL_INT(VALVE >> 8, app_bench_read(&bench, 0x2058, 2));
    TEST_ASSERT_EQUAL_INT(-321, app_bench_read(&bench, 0x2058, 4));
    app_bench_periods(&bench, 500);
    TEST_ASSERT_EQUAL_HEX16(LAMP | VALVE, digital());
    command(COMMAND_START); /* the program has LAMP on, VALVE and the second analogue output off */
    while (digital() != LAMP) { /* never off in between */
        app_bench_period(&bench);
        TEST_ASSERT_BITS_HIGH(LAMP, digital());
    }
    run_to_the_end();
}

/* Sub 7 has all outputs: no frame has only some of them. */
static void test_outputs_at_standstill_switch_together(void)
{
    const uint64_t all = (uint64_t)(LAMP | VALVE) | (uint64_t)(uint16_t)-321 << 32u;
    make_ready();
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2058, 7, all, 8));
    for (unsigned i = 0; i < 3; ++i) {
        app_bench_period(&bench);
        TEST_ASSERT_TRUE(digital() == 0u || digital() == (LAMP | VALVE));
        TEST_ASSERT_EQUAL_INT16(digital() == 0u ? 0 : -321, analogue(1));
    }
    TEST_ASSERT_EQUAL_HEX16(LAMP | VALVE, digital());
    TEST_ASSERT_EQUAL_HEX64(all, app_bench_read(&bench, 0x2058, 7));
    TEST_ASSERT_EQUAL_INT(LAMP, app_bench_read(&bench, 0x2058, 1));
    TEST_ASSERT_EQUAL_INT(VALVE >> 8, app_bench_read(&bench, 0x2058, 2));
    TEST_ASSERT_EQUAL_INT(-321, app_bench_read(&bench, 0x2058, 4));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2058, 7, 0, 8));
    app_bench_periods(&bench, 3);
    TEST_ASSERT_EQUAL_HEX16(0, digital());
}

static void test_outputs_at_standstill_end_with_a_stop(void)
{
    static const unsigned stops[] = {COMMAND_STOP, COMMAND_QUICK_STOP, COMMAND_DISABLE};
    for (unsigned i = 0; i < sizeof stops / sizeof stops[0]; ++i) {
        setUp();
        make_ready();
        set_lamp_and_speed();
        command(stops[i]);
        app_bench_periods(&bench, 3);
        TEST_ASSERT_EQUAL_HEX16(0, digital());
        TEST_ASSERT_EQUAL_INT16(0, analogue(1));
    }
    for (uint32_t at_end = 0; at_end <= OFF_AT_END; at_end += OFF_AT_END) {
        setUp();
        configure(4, KEPT_AT_STOP | at_end, 1);
        make_ready();
        set_lamp_and_speed();
        command(COMMAND_STOP);
        app_bench_periods(&bench, 3);
        TEST_ASSERT_EQUAL_HEX16(at_end != 0u ? 0 : LAMP | VALVE, digital());
    }
}

static void test_outputs_at_standstill_need_it(void)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, set_outputs(1, LAMP)); /* drives off */
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, app_bench_write(&bench, 0x2058, 7, LAMP, 8));
    make_ready();
    start();
    app_bench_periods(&bench, 100);
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, set_outputs(2, VALVE >> 8));
    check_place();
    run_to_the_end();
}

/* Outputs of a motion in a job of the host stay at its end; those of the next one, which does not say so, go off. */
static void test_outputs_stay_at_the_end_once(void)
{
    configure(4, OFF_AT_END, 1);
    make_ready();
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2058, 6, 1, 1));
    start();
    (void)app_bench_until(&bench, MACHINE_READY, 1000);
    app_bench_periods(&bench, AXIS_STANDSTILL_SYNCS);
    TEST_ASSERT_EQUAL_HEX16(LAMP, digital());
    TEST_ASSERT_EQUAL_INT(0, app_bench_read(&bench, 0x2058, 6));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2011, 0, (uint64_t)um(4000), 8));
    command(COMMAND_START_FROM);
    (void)app_bench_until(&bench, MACHINE_RUNNING, 10);
    (void)app_bench_until(&bench, MACHINE_READY, 1000);
    app_bench_periods(&bench, 2);
    TEST_ASSERT_EQUAL_HEX16(0, digital());
    set_lamp_and_speed(); /* OFF_AT_END concerns the end alone */
}

/* The tick that follows the stop may be the one that ends the motion. */
static void test_a_stop_while_the_axes_arrive_switches_off(void)
{
    static const uint32_t behaviour[] = {0, OFF_AT_END, OFF_AT_END | KEPT_AT_STOP};
    for (uint32_t i = 0; i < 3u; ++i) {
        bool arrives = true;
        for (uint32_t ticks = 0; arrives; ++ticks) {
            setUp();
            configure(4, behaviour[i], 1);
            make_ready();
            TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2058, 6, 1, 1));
            start();
            while (!motion_over(&bench.controller.machine.motion)) {
                app_bench_period(&bench);
            }
            app_bench_periods(&bench, ticks);
            arrives = bench.controller.machine.state == MACHINE_RUNNING;
            command(COMMAND_STOP);
            app_bench_periods(&bench, AXIS_STANDSTILL_SYNCS);
            TEST_ASSERT_EQUAL_INT(MACHINE_READY, bench.controller.machine.state);
            TEST_ASSERT_EQUAL_HEX16(0, digital());
        }
    }
}

/* A host that learns in motion that nothing follows. The value is not for the next motion. */
static void test_outputs_stay_is_written_in_motion(void)
{
    for (uint8_t stay = 0; stay <= 1; ++stay) {
        setUp();
        configure(4, OFF_AT_END, 1);
        make_ready();
        TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2058, 6, 1u - stay, 1));
        start();
        app_bench_periods(&bench, 100);
        TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2058, 6, stay, 1));
        TEST_ASSERT_EQUAL_INT(0, app_bench_read(&bench, 0x2058, 6));
        (void)app_bench_until(&bench, MACHINE_READY, 1000);
        app_bench_periods(&bench, 2);
        TEST_ASSERT_EQUAL_HEX16(stay != 0u ? LAMP : 0u, digital());
    }
}

/* Also if a feed hold begins where the motion is over: the job of the host goes on. */
static void test_outputs_stay_at_an_end_in_a_hold(void)
{
    configure(4, OFF_AT_END, 1);
    make_ready();
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2058, 6, 1, 1));
    start();
    while (!motion_over(&bench.controller.machine.motion)) {
        app_bench_period(&bench);
    }
    command(COMMAND_HOLD);
    TEST_ASSERT_EQUAL_INT(MACHINE_HOLDING, bench.controller.machine.state);
    (void)app_bench_until(&bench, MACHINE_READY, 1000);
    app_bench_periods(&bench, AXIS_STANDSTILL_SYNCS);
    TEST_ASSERT_EQUAL_HEX16(LAMP, digital());
}

static void test_outputs_that_stay_at_the_end_go_off_at_a_stop(void)
{
    for (uint32_t kept = 0; kept <= KEPT_AT_STOP; ++kept) {
        setUp();
        configure(4, OFF_AT_END | kept, 1);
        make_ready();
        TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2058, 6, 1, 1));
        start();
        app_bench_periods(&bench, 250);
        command(COMMAND_STOP);
        app_bench_periods(&bench, 2);
        TEST_ASSERT_EQUAL_HEX16(kept != 0u ? LAMP | VALVE : 0u, digital());
        (void)app_bench_until(&bench, MACHINE_READY, 1000);
        app_bench_periods(&bench, 2);
        TEST_ASSERT_EQUAL_HEX16(0, digital());
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_outputs_are_on_where_the_axes_are);
    RUN_TEST(test_the_place_is_kept_at_any_override);
    RUN_TEST(test_a_hold_at_any_instant_keeps_them);
    RUN_TEST(test_off_in_hold_comes_back);
    RUN_TEST(test_proportional_value_follows_the_feed);
    RUN_TEST(test_stop_and_quick_stop);
    RUN_TEST(test_end_and_disable);
    RUN_TEST(test_outputs_at_standstill);
    RUN_TEST(test_outputs_at_standstill_switch_together);
    RUN_TEST(test_outputs_at_standstill_end_with_a_stop);
    RUN_TEST(test_outputs_at_standstill_need_it);
    RUN_TEST(test_outputs_stay_at_the_end_once);
    RUN_TEST(test_a_stop_while_the_axes_arrive_switches_off);
    RUN_TEST(test_outputs_stay_is_written_in_motion);
    RUN_TEST(test_outputs_stay_at_an_end_in_a_hold);
    RUN_TEST(test_outputs_that_stay_at_the_end_go_off_at_a_stop);
    RUN_TEST(test_start_from_a_place_has_all_events_before_it);
    RUN_TEST(test_delay_by_ticks);
    RUN_TEST(test_module_that_is_lost_stops_the_machine);
    RUN_TEST(test_module_that_restarts_stops_the_machine);
    RUN_TEST(test_module_that_is_not_operational_is_started_again);
    RUN_TEST(test_module_that_is_not_operational_stops_the_machine);
    RUN_TEST(test_module_that_is_lost_before_its_first_heartbeat);
    RUN_TEST(test_boot_that_waits_for_a_drive_switches_off);
    RUN_TEST(test_controller_that_restarts_switches_off);
    RUN_TEST(test_controller_that_restarts_without_a_configuration);
    RUN_TEST(test_module_that_is_missing_or_another_one);
    RUN_TEST(test_refused_values);
    RUN_TEST(test_module_without_its_controller_switches_off);
    return UNITY_END();
}
