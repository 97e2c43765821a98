/* SPDX-License-Identifier: MIT */
/* Configuration of the drives by SDO: order, what is optional, what is reported when it fails. Run by `make unit`;
 * no I/O. */
#include "app/drives/drive_boot.h"

#include "canopen/pdo.h"
#include "canopen/sdo_abort.h"

#include "app_bench.h"
#include "fake_port.h"
#include "unity.h"

static struct app_bench bench;

void setUp(void)
{
    app_bench_init(&bench, 10000000, -5000000);
}

void tearDown(void)
{
}

static struct fake_drive *drive(unsigned axis)
{
    return &bench.drives[axis];
}

static void boot(void)
{
    (void)app_bench_until(&bench, MACHINE_OFF, 1000);
}

static void expect_trouble(unsigned node, uint32_t object, uint32_t abort_code)
{
    app_bench_periods(&bench, 700);
    TEST_ASSERT_EQUAL_INT(MACHINE_BOOT, app_bench_read(&bench, 0x2002, 0));
    TEST_ASSERT_EQUAL_INT64(node, app_bench_read(&bench, 0x2025, 1));
    TEST_ASSERT_EQUAL_INT64(object, app_bench_read(&bench, 0x2025, 2));
    TEST_ASSERT_EQUAL_HEX32(abort_code, app_bench_read(&bench, 0x2025, 3));
}

/* The writes of one object after the other, as values. */
static void expect_writes(const struct fake_write *expected, uint32_t count)
{
    uint32_t at = 0;
    TEST_ASSERT_NOT_EQUAL_UINT32(0, fake_drive_written(drive(0), expected[0].object, &at));
    for (uint32_t i = 0; i < count; ++i) {
        const struct fake_write *write = &drive(0)->writes[at + i];
        TEST_ASSERT_EQUAL_HEX32(expected[i].object, write->object);
        TEST_ASSERT_EQUAL_HEX32(expected[i].value, write->value);
    }
}

/* Vendor, product and revision, each by itself: nothing has been written to the drive that is not the expected one. */
static void test_a_drive_of_another_identity_is_refused(void)
{
    for (uint8_t sub = 1; sub <= 3u; ++sub) {
        setUp();
        bench.drives[1].values.identity_object.vendor_id = 0x29C;
        bench.drives[1].values.identity_object.product_code = 0x402;
        bench.drives[1].values.identity_object.revision_number = 0x10003;
        TEST_ASSERT_EQUAL_HEX32(SDO_OK,
                                app_bench_write(&bench, (uint16_t)(0x2050u + sub), 2, 0x777, 4));
        expect_trouble(3, 0x101800u + sub, SDO_OK);
        TEST_ASSERT_EQUAL_UINT32(0, bench.drives[1].write_count);
        const uint32_t found = (uint32_t)app_bench_read(&bench, 0x2025, 4);
        TEST_ASSERT_EQUAL_HEX32(app_bench_read(&bench, (uint16_t)(0x2026u + sub), 2), found);
        TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, app_bench_command(&bench, 1));
        TEST_ASSERT_EQUAL_INT64(MACHINE_DRIVES_MISSING, app_bench_read(&bench, 0x2003, 4));
        TEST_ASSERT_EQUAL_HEX32(SDO_OK,
                                app_bench_write(&bench, (uint16_t)(0x2050u + sub), 2, found, 4));
        boot();
        TEST_ASSERT_EQUAL_INT64(0, app_bench_read(&bench, 0x2025, 1));
    }
}

/* It reports no identity, but one is expected. */
static void test_a_drive_without_identity_is_not_the_expected_one(void)
{
    bench.drives[0].lacks[0] = 0x1018;
    boot();
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2051, 1, 5, 4));
    expect_trouble(2, 0x101801, SDO_ABORT_NO_OBJECT);
}

static void test_a_pdo_is_disabled_mapped_and_enabled(void)
{
    static const struct fake_write rpdo1[] = {
        {0x140001, 0x80000202}, {0x140002, 1},          {0x160000, 0},
        {0x160001, 0x60400010}, {0x160002, 0x607A0020}, {0x160000, 2},
        {0x140005, 200},        {0x140001, 0x202},      {0x140101, 0x80000302},
    };
    static const struct fake_write tpdo3[] = {
        {0x180201, 0xC0000382}, {0x180202, 255}, {0x1A0200, 0}, {0x1A0201, 0x60FD0020},
        {0x1A0200, 1},          {0x180203, 100}, {0x180205, 0}, {0x180201, 0x40000382},
    };
    boot();
    expect_writes(rpdo1, sizeof rpdo1 / sizeof rpdo1[0]);
    expect_writes(tpdo3, sizeof tpdo3 / sizeof tpdo3[0]);
    TEST_ASSERT_EQUAL_HEX32(0x40000182, drive(0)->values.tpdo1_communication_parameter.cob_id);
    TEST_ASSERT_EQUAL_HEX32(0x40000283, drive(1)->values.tpdo2_communication_parameter.cob_id);
    TEST_ASSERT_EQUAL_HEX32(0xC0000483, drive(1)->values.tpdo4_communication_parameter.cob_id);
}

static void test_times_heartbeats_and_reactions(void)
{
    uint32_t zero = 0;
    uint32_t counter = 0;
    boot();
    const struct od_drive *values = &drive(1)->values;
    TEST_ASSERT_EQUAL_HEX32(0x00010000u + DRIVE_CONTROLLER_TIMEOUT_MS,
                            values->consumer_heartbeat_time[0]);
    TEST_ASSERT_EQUAL_INT(3, values->abort_connection_option_code);
    TEST_ASSERT_EQUAL_INT(2, values->quick_stop_option_code);
    TEST_ASSERT_EQUAL_UINT32(2000000000u, values->quick_stop_deceleration);
    TEST_ASSERT_EQUAL_UINT32(0xFFFFFFFFu, values->following_error_window);
    TEST_ASSERT_EQUAL_UINT16(200, values->simulation.sync_timeout);
    /* the counter of SYNC only changes while the period is 0 */
    TEST_ASSERT_EQUAL_UINT32(1, fake_drive_written(drive(0), 0x101900, &counter));
    TEST_ASSERT_EQUAL_UINT32(240, drive(0)->writes[counter].value);
    TEST_ASSERT_EQUAL_UINT32(2, fake_drive_written(drive(0), 0x100600, &zero));
    TEST_ASSERT_EQUAL_UINT32(0, drive(0)->writes[zero].value);
    TEST_ASSERT_TRUE(zero < counter);
    TEST_ASSERT_EQUAL_UINT32(1000, values->communication_cycle_period);
}

static void test_settings_of_an_axis_reach_its_drive_only(void)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2020, 2, 4096, 4));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2021, 2, 5000000, 4));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2022, 2, 3, 4));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2023, 2, 2, 4));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x201D, 2, 70000, 4));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x201E, 2, 30, 2));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2012, 2, 17, 1));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2013, 2, (uint32_t)-9, 4));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2015, 2, 777, 4));
    boot();
    const struct od_drive *values = &drive(1)->values;
    TEST_ASSERT_EQUAL_UINT32(4096, values->position_encoder_resolution[0]);
    TEST_ASSERT_EQUAL_UINT32(5000000, values->feed_constant[0]);
    TEST_ASSERT_EQUAL_UINT32(3, values->gear_ratio[0]);
    TEST_ASSERT_EQUAL_UINT32(2, values->gear_ratio[1]);
    TEST_ASSERT_EQUAL_UINT32(70000, values->following_error_window);
    TEST_ASSERT_EQUAL_UINT16(30, values->following_error_time_out);
    TEST_ASSERT_EQUAL_INT(17, values->homing_method);
    TEST_ASSERT_EQUAL_INT32(-9, values->home_offset);
    TEST_ASSERT_EQUAL_UINT32(777, values->homing_speeds[1]);
    TEST_ASSERT_EQUAL_UINT32(0, fake_drive_written(drive(0), 0x608F01, NULL));
    TEST_ASSERT_EQUAL_UINT32(0, fake_drive_written(drive(0), 0x609800, NULL));
    TEST_ASSERT_EQUAL_UINT32(0, fake_drive_written(drive(0), 0x606500, NULL));
    TEST_ASSERT_EQUAL_UINT32(0, fake_drive_written(drive(0), 0x606600, NULL));
}

static void test_feedforward_changes_the_mapping(void)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2004, 11, 3, 1));
    boot();
    TEST_ASSERT_EQUAL_HEX32(0x60B20010, drive(0)->values.rpdo1_mapping_parameter.mapped_object_3);
    TEST_ASSERT_EQUAL_UINT8(3, drive(0)->values.rpdo1_mapping_parameter.count);
    TEST_ASSERT_EQUAL_HEX32(0x302, drive(0)->values.rpdo2_communication_parameter.cob_id);
    TEST_ASSERT_EQUAL_HEX32(0x60B10020, drive(0)->values.rpdo2_mapping_parameter.mapped_object_1);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2004, 11, 0, 1));
    boot();
    TEST_ASSERT_EQUAL_UINT8(2, drive(0)->values.rpdo1_mapping_parameter.count);
    TEST_ASSERT_EQUAL_HEX32(0x80000302, drive(0)->values.rpdo2_communication_parameter.cob_id);
}

static void test_an_offset_that_cannot_be_mapped_is_left_out(void)
{
    drive(0)->unmappable = 0x60B20010;
    drive(1)->lacks[0] = 0x1401;
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2004, 11, 3, 1));
    boot();
    TEST_ASSERT_EQUAL_UINT8(2, drive(0)->values.rpdo1_mapping_parameter.count);
    TEST_ASSERT_EQUAL_HEX32(0x202, drive(0)->values.rpdo1_communication_parameter.cob_id);
    TEST_ASSERT_EQUAL_HEX32(0x302, drive(0)->values.rpdo2_communication_parameter.cob_id);
    TEST_ASSERT_EQUAL_UINT8(3, drive(1)->values.rpdo1_mapping_parameter.count);
    app_bench_periods(&bench, 3);
    TEST_ASSERT_EQUAL_UINT8(6, drive(0)->setpoint_size);
    TEST_ASSERT_EQUAL_UINT8(8, drive(1)->setpoint_size);
    TEST_ASSERT_NOT_EQUAL_UINT32(0, drive(0)->velocities);
    TEST_ASSERT_EQUAL_UINT32(0, drive(1)->velocities);
}

/* The controller was switched off in motion: the drive still has the offsets of that instant. */
static void test_offsets_that_are_not_sent_are_cleared(void)
{
    drive(0)->values.velocity_offset = 100000;
    drive(0)->values.torque_offset = -300;
    drive(1)->lacks[0] = 0x60B1;
    drive(1)->lacks[1] = 0x60B2;
    boot();
    TEST_ASSERT_EQUAL_INT32(0, drive(0)->values.velocity_offset);
    TEST_ASSERT_EQUAL_INT16(0, drive(0)->values.torque_offset);
}

static void test_a_fixed_mapping_passes_if_it_is_the_right_one(void)
{
    drive(0)->fixed_mapping = true;
    drive(0)->values.tpdo3_communication_parameter.cob_id = 0x40000382;
    drive(0)->values.tpdo3_communication_parameter.transmission_type = 255;
    drive(0)->values.tpdo3_communication_parameter.inhibit_time = 100;
    drive(0)->values.tpdo3_mapping_parameter.count = 1;
    drive(0)->values.tpdo3_mapping_parameter.mapped_object_1 = 0x60FD0020;
    drive(0)->values.rpdo1_communication_parameter.event_timer = 200;
    boot();
    TEST_ASSERT_TRUE(bench.controller.boot.properties[0].known[DRIVE_INPUTS_MAPPED]);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2004, 11, 1, 1));
    expect_trouble(2, 0x160003, SDO_ABORT_READ_ONLY);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2004, 11, 0, 1));
    boot();
    TEST_ASSERT_EQUAL_INT64(0, app_bench_read(&bench, 0x2025, 1));
}

/* TPDO3 is not required: without it the inputs are read by SDO. */
static void test_inputs_without_their_pdo(void)
{
    drive(0)->lacks[0] = 0x1802;
    drive(1)->refuses = 0x1A0201;
    drive(1)->values.tpdo3_mapping_parameter.mapped_object_1 = 0x60410010;
    drive(1)->values.digital_inputs = 4;
    boot();
    TEST_ASSERT_FALSE(bench.controller.boot.properties[0].known[DRIVE_INPUTS_MAPPED]);
    TEST_ASSERT_FALSE(bench.controller.boot.properties[1].known[DRIVE_INPUTS_MAPPED]);
    TEST_ASSERT_TRUE((drive(1)->values.tpdo3_communication_parameter.cob_id & 0x80000000u) != 0u);
    TEST_ASSERT_EQUAL_INT64(4, app_bench_read(&bench, 0x201B, 2));
    drive(0)->values.digital_inputs = 2;
    drive(0)->values.following_error_actual_value = -12345;
    app_bench_periods(&bench, 600);
    TEST_ASSERT_EQUAL_INT64(2, app_bench_read(&bench, 0x201B, 1));
    TEST_ASSERT_EQUAL_INT64(-12345, app_bench_read(&bench, 0x201C, 1));
    TEST_ASSERT_EQUAL_INT64(0, app_bench_read(&bench, 0x201C, 2));
}

static void test_inputs_by_their_pdo(void)
{
    struct can_msg frame;
    boot();
    pdo_encode_inputs(3, 0x10005, &frame);
    fake_port_receive(&frame);
    TEST_ASSERT_EQUAL_INT64(0x10005, app_bench_read(&bench, 0x201B, 2));
    pdo_encode_inputs(77, 1, &frame);
    fake_port_receive(&frame);
    TEST_ASSERT_EQUAL_INT64(0, app_bench_read(&bench, 0x201B, 1));
}

/* Each drive is polled a few times a second, not more. */
static void test_looking_costs_little(void)
{
    boot();
    const uint32_t before = drive(0)->reads;
    app_bench_periods(&bench, 1000);
    TEST_ASSERT_UINT32_WITHIN(2, 4, drive(0)->reads - before);
}

static void test_inputs_are_read_as_often(void)
{
    drive(0)->lacks[0] = 0x1802;
    drive(1)->lacks[0] = 0x1802;
    boot();
    const uint32_t before = drive(0)->reads;
    app_bench_periods(&bench, 2000);
    TEST_ASSERT_UINT32_WITHIN(2, 16, drive(0)->reads - before);
}

static void test_objects_that_a_drive_may_lack(void)
{
    static const uint16_t optional[] = {0x1006, 0x1016, 0x1019, 0x1029,
                                        0x6007, 0x6085, 0x605A, 0x6065};
    for (unsigned i = 0; i < 8u; ++i) {
        drive(1)->lacks[i] = optional[i];
    }
    boot();
}

static void test_objects_that_it_must_have(void)
{
    static const uint16_t required[] = {0x1017, 0x607D, 0x60C2, 0x6502, 0x1800};
    for (unsigned i = 0; i < sizeof required / sizeof required[0]; ++i) {
        app_bench_init(&bench, 0, 0);
        drive(1)->lacks[0] = required[i];
        app_bench_periods(&bench, 300);
        TEST_ASSERT_EQUAL_INT(MACHINE_BOOT, bench.controller.machine.state);
        TEST_ASSERT_EQUAL_UINT8(3, bench.controller.boot.trouble.node);
        TEST_ASSERT_EQUAL_HEX16(required[i], bench.controller.boot.trouble.object >> 8);
        TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_NO_OBJECT, bench.controller.boot.trouble.abort_code);
    }
}

static void test_a_window_that_is_wanted_must_be_there(void)
{
    drive(0)->lacks[0] = 0x6065;
    boot();
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x201D, 1, 70000, 4));
    expect_trouble(2, 0x606500, SDO_ABORT_NO_OBJECT);
}

static void test_a_drive_without_the_mode(void)
{
    drive(0)->values.supported_drive_modes = 0x20;
    expect_trouble(2, 0x650200, SDO_OK);
    TEST_ASSERT_EQUAL_HEX32(0x20, app_bench_read(&bench, 0x2025, 4));
}

/* The low half of 0x1000 is the profile: all 16 bits of it. */
static void test_a_device_of_another_profile(void)
{
    drive(0)->values.device_type ^= 0x4000u;
    expect_trouble(2, 0x100000, SDO_OK);
    drive(0)->values.device_type ^= 0x4000u ^ 0x80000000u; /* the upper half is the drive's */
    boot();
}

static void test_a_mode_that_is_not_taken(void)
{
    drive(1)->mode_stuck = 1;
    expect_trouble(3, 0x606100, SDO_OK);
    TEST_ASSERT_EQUAL_HEX32(1, app_bench_read(&bench, 0x2025, 4));
    drive(1)->mode_stuck = 0;
    boot();
}

static void test_a_value_that_is_refused_is_reported(void)
{
    drive(1)->refuses = 0x607D02;
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2007, 2, 123, 4));
    expect_trouble(3, 0x607D02, SDO_ABORT_VALUE);
    TEST_ASSERT_EQUAL_HEX32(0x7FFFFFFF, app_bench_read(&bench, 0x2025, 4));
    drive(1)->values.software_position_limit[1] = 123;
    boot();
}

/* A drive that compares the two takes a travel beside its old one, above and below, also without "no minimum". */
static void test_limits_beside_the_old_ones(void)
{
    static const int32_t places[] = {3000000, -3000000, 0};
    for (int open = 0; open < 2; ++open) {
        setUp();
        drive(0)->ordered_limits = true;
        drive(0)->no_open_limits = open == 0;
        for (uint32_t i = 0; i < 3u; ++i) {
            const int32_t least = places[i];
            const int32_t most = least + 1000000;
            TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2006, 1, (uint32_t)least, 4));
            TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2007, 1, (uint32_t)most, 4));
            boot();
            TEST_ASSERT_EQUAL_INT32(least, drive(0)->values.software_position_limit[0]);
            TEST_ASSERT_EQUAL_INT32(most, drive(0)->values.software_position_limit[1]);
        }
    }
}

static void test_a_node_that_is_given_twice_is_reported(void)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2005, 2, 2, 1));
    expect_trouble(2, 0x200502, SDO_ABORT_INCOMPATIBLE);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_write(&bench, 0x2005, 2, 3, 1));
    boot();
    TEST_ASSERT_EQUAL_INT64(0, app_bench_read(&bench, 0x2025, 1));
}

static void test_an_axis_at_the_controllers_own_node_is_reported(void)
{
    struct drive_boot attempt;
    struct config config = bench.controller.config;
    struct can_msg out;
    config.own_node = config.node[1];
    drive_boot_init(&attempt);
    drive_boot_begin(&attempt, &config);
    TEST_ASSERT_EQUAL_INT(0, drive_boot_process(&attempt, DRIVE_BOOT_PAUSE_US, &out));
    TEST_ASSERT_EQUAL_UINT8(config.own_node, attempt.trouble.node);
    TEST_ASSERT_EQUAL_HEX32(0x200502, attempt.trouble.object);
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_INCOMPATIBLE, attempt.trouble.abort_code);
}

static void test_what_a_drive_reports_is_kept(void)
{
    drive(1)->values.identity_object.vendor_id = 0x123;
    drive(1)->values.identity_object.serial_number = 99;
    boot();
    const struct drive_properties *properties = bench.controller.boot.properties;
    TEST_ASSERT_TRUE(drive_is_simulated(&properties[0]));
    TEST_ASSERT_FALSE(drive_is_simulated(&properties[1]));
    TEST_ASSERT_EQUAL_UINT32(99, properties[1].value[DRIVE_SERIAL]);
    TEST_ASSERT_EQUAL_INT64(2, app_bench_read(&bench, 0x2028, 1));
    TEST_ASSERT_EQUAL_INT64(0x123, app_bench_read(&bench, 0x2027, 2));
    TEST_ASSERT_EQUAL_INT64(99, app_bench_read(&bench, 0x202A, 2));
    TEST_ASSERT_FALSE(bench.controller.machine.simulated);
    TEST_ASSERT_TRUE((drive(1)->values.tpdo2_communication_parameter.cob_id & 0x80000000u) != 0u);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_drive_of_another_identity_is_refused);
    RUN_TEST(test_a_drive_without_identity_is_not_the_expected_one);
    RUN_TEST(test_a_pdo_is_disabled_mapped_and_enabled);
    RUN_TEST(test_times_heartbeats_and_reactions);
    RUN_TEST(test_settings_of_an_axis_reach_its_drive_only);
    RUN_TEST(test_feedforward_changes_the_mapping);
    RUN_TEST(test_an_offset_that_cannot_be_mapped_is_left_out);
    RUN_TEST(test_offsets_that_are_not_sent_are_cleared);
    RUN_TEST(test_a_fixed_mapping_passes_if_it_is_the_right_one);
    RUN_TEST(test_inputs_without_their_pdo);
    RUN_TEST(test_inputs_by_their_pdo);
    RUN_TEST(test_looking_costs_little);
    RUN_TEST(test_inputs_are_read_as_often);
    RUN_TEST(test_objects_that_a_drive_may_lack);
    RUN_TEST(test_objects_that_it_must_have);
    RUN_TEST(test_a_window_that_is_wanted_must_be_there);
    RUN_TEST(test_a_drive_without_the_mode);
    RUN_TEST(test_a_device_of_another_profile);
    RUN_TEST(test_a_mode_that_is_not_taken);
    RUN_TEST(test_a_value_that_is_refused_is_reported);
    RUN_TEST(test_limits_beside_the_old_ones);
    RUN_TEST(test_a_node_that_is_given_twice_is_reported);
    RUN_TEST(test_an_axis_at_the_controllers_own_node_is_reported);
    RUN_TEST(test_what_a_drive_reports_is_kept);
    return UNITY_END();
}
