/* SPDX-License-Identifier: MIT */
/* Tests of node/node_options.h: the command line of hodograph-drive. Run by `make unit`; no I/O. */
#include "node/node_options.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "unity.h"

#define FIGURES                                                                                    \
    "gain_rad_s_v=83.0089,time_constant_s=0.19936,screw_mm_rad=1.59,torque_to_volts=1.4,"          \
    "volts_limit=5,k_pp_rad_s_mm=97.38,k_pv_nm_s_rad=1.19,k_iv_per_s=252.8,k_pf_rad_mm=0.8,"       \
    "k_vf=0.85"

static struct node_options options;
static char reason[256];

void setUp(void)
{
    reason[0] = '\0';
}

void tearDown(void)
{
}

/* Parses `--bus vcan0` and the axes given, up to a NULL. */
static enum node_options_result parse(const char *first, const char *second)
{
    static char texts[2][600];
    char *argv[] = {"hodograph-drive", "--bus", "vcan0", "--axis", texts[0], "--axis", texts[1]};
    (void)snprintf(texts[0], sizeof texts[0], "%s", first);
    (void)snprintf(texts[1], sizeof texts[1], "%s", second == NULL ? "" : second);
    return node_options_parse(&options, second == NULL ? 5 : 7, argv, reason, sizeof reason);
}

static void refused(const char *axis, const char *part)
{
    TEST_ASSERT_EQUAL_INT(NODE_OPTIONS_WRONG, parse(axis, NULL));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(reason, part), reason);
    TEST_ASSERT_NULL(strchr(reason, '\n'));
}

static void test_two_axes_with_defaults_and_without(void)
{
    TEST_ASSERT_EQUAL_INT(NODE_OPTIONS_OK, parse("node=2," FIGURES, FIGURES
                                                 ",node=127,position_mm=-1.25,counts_per_mm=1000,"
                                                 "loop_rate_hz=8000,encoder_counts_per_rev=4096,"
                                                 "interpolation=1,speed=1,delay_samples=1"));
    TEST_ASSERT_EQUAL_STRING("vcan0", options.bus);
    TEST_ASSERT_EQUAL_UINT(2, options.axis_count);
    const struct node_options_axis *a = &options.axes[0], *b = &options.axes[1];
    TEST_ASSERT_EQUAL_UINT8(2, a->node);
    TEST_ASSERT_TRUE(a->config.plant.gain_rad_s_v == 83.0089 && a->config.pdff.k_vf == 0.85);
    TEST_ASSERT_EQUAL_UINT32(1048576, a->config.encoder_counts_per_rev);
    TEST_ASSERT_EQUAL_UINT32(16000, a->config.loop_rate_hz);
    TEST_ASSERT_EQUAL_UINT32(1000000, a->config.counts_per_mm);
    TEST_ASSERT_EQUAL_UINT32(1000, a->config.period_us);
    TEST_ASSERT_TRUE(a->position_mm == 0.0);
    TEST_ASSERT_EQUAL_UINT32(DRIVE_LINEAR, a->config.interpolation);
    TEST_ASSERT_EQUAL_UINT32(DRIVE_CUBIC, b->config.interpolation);
    TEST_ASSERT_EQUAL_UINT32(0, a->config.speed + a->config.delay_samples);
    TEST_ASSERT_EQUAL_UINT32(DRIVE_SPEED_DIFFERENCES, b->config.speed);
    TEST_ASSERT_EQUAL_UINT32(1, b->config.delay_samples);
    TEST_ASSERT_EQUAL_UINT8(127, b->node);
    TEST_ASSERT_TRUE(b->position_mm == -1.25);
    TEST_ASSERT_EQUAL_UINT32(4096, b->config.encoder_counts_per_rev);
}

static void test_equipment(void)
{
    TEST_ASSERT_EQUAL_INT(NODE_OPTIONS_OK,
                          parse("node=2," FIGURES,
                                "node=3," FIGURES ",limit_negative_mm=-3,limit_positive_mm=99.5,"
                                "home_from_mm=1,home_to_mm=2,overload_s=0,"
                                "rated_torque_nm=2.5,friction_volts=0.1,"
                                "brake_volts=7,serial=4711,rated_current_a=3"));
    const struct equipment *a = &options.axes[0].equipment, *b = &options.axes[1].equipment;
    TEST_ASSERT_EQUAL_UINT32(2, a->serial);
    TEST_ASSERT_TRUE(a->overload_s == 10.0 && a->friction_volts == 0.0 && a->brake_volts == 5.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.5 * 5.0 / 1.4, a->rated_torque_nm);
    TEST_ASSERT_EQUAL_HEX32(0, equipment_inputs(a, 1e6) | equipment_inputs(a, -1e6));
    TEST_ASSERT_EQUAL_UINT32(4711, b->serial);
    TEST_ASSERT_TRUE(b->rated_torque_nm == 2.5 && b->rated_current_a == 3.0);
    TEST_ASSERT_TRUE(b->overload_s == 0.0 && b->friction_volts == 0.1 && b->brake_volts == 7.0);
    TEST_ASSERT_EQUAL_HEX32(EQUIPMENT_INPUT_NEGATIVE, equipment_inputs(b, -3.0));
    TEST_ASSERT_EQUAL_HEX32(EQUIPMENT_INPUT_POSITIVE, equipment_inputs(b, 99.5));
    TEST_ASSERT_EQUAL_HEX32(EQUIPMENT_INPUT_HOME, equipment_inputs(b, 1.5));
    TEST_ASSERT_EQUAL_HEX32(0, equipment_inputs(b, 3.0));
}

static void test_equipment_that_cannot_be(void)
{
    TEST_ASSERT_EQUAL_INT(NODE_OPTIONS_OK,
                          parse("node=2," FIGURES ",overload_s=0,friction_volts=0", NULL));
    const struct equipment good = options.axes[0].equipment;
    TEST_ASSERT_TRUE(equipment_ok(&good));
    struct equipment small = good;
    small.rated_torque_nm = small.rated_current_a = small.brake_volts = 1e-9;
    TEST_ASSERT_TRUE(equipment_ok(&small));
    struct equipment bad[6];
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        bad[i] = good;
    }
    bad[0].limit_positive_mm = bad[0].limit_negative_mm;
    bad[1].rated_torque_nm = 0.0;
    bad[2].rated_current_a = 0.0;
    bad[3].overload_s = -1e-9;
    bad[4].friction_volts = -1e-9;
    bad[5].brake_volts = 0.0;
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        TEST_ASSERT_FALSE(equipment_ok(&bad[i]));
    }
}

/* Whatever failed before, and whatever digit they begin with. */
static void test_whole_numbers(void)
{
    refused("node=2," FIGURES ",serial=99999999999999999999999", "'serial=");
    for (unsigned digit = 0; digit <= 9u; digit++) {
        char text[300];
        (void)snprintf(text, sizeof text, "node=2," FIGURES ",serial=%u7", digit);
        errno = ERANGE;
        TEST_ASSERT_EQUAL_INT_MESSAGE(NODE_OPTIONS_OK, parse(text, NULL), reason);
        TEST_ASSERT_EQUAL_UINT32(10u * digit + 7u, options.axes[0].equipment.serial);
    }
}

static void test_faults_are_named(void)
{
    refused("node=2", "'gain_rad_s_v'");
    refused(FIGURES, "'node'");
    refused("node=2," FIGURES ",k_vg=1", "'k_vg'");
    refused("node=2," FIGURES ",node=3", "'node'");
    refused("node=2," FIGURES ",position_mm=1x", "'position_mm=1x'");
    refused("node=2," FIGURES ",position_mm=", "'position_mm='");
    refused("node=2," FIGURES ",position_mm=nan", "'position_mm=nan'");
    refused("node=2," FIGURES ",loop_rate_hz=-1", "'loop_rate_hz=-1'");
    refused("node=2," FIGURES ",loop_rate_hz=4294967296", "'loop_rate_hz=4294967296'");
    refused("node=1," FIGURES, "'1'");
    refused("node=0," FIGURES, "'0'");
    refused("node=128," FIGURES, "'node=128'");
    refused("node=2,,", "''");
}

static void test_a_node_may_appear_once(void)
{
    TEST_ASSERT_EQUAL_INT(NODE_OPTIONS_WRONG, parse("node=2," FIGURES, "node=2," FIGURES));
    TEST_ASSERT_NOT_NULL(strstr(reason, "same"));
}

static void test_options_themselves(void)
{
    char *help[] = {"hodograph-drive", "--help"};
    char *unknown[] = {"hodograph-drive", "--bos", "vcan0"};
    char *lacking[] = {"hodograph-drive", "--bus"};
    char *none[] = {"hodograph-drive", "--bus", "vcan0"};
    char axis[] = "node=2," FIGURES;
    char *faults[] = {"hodograph-drive", "--bus", "vcan0", "--faults", "f", "--axis", axis};
    TEST_ASSERT_EQUAL_INT(NODE_OPTIONS_OK,
                          node_options_parse(&options, 7, faults, reason, sizeof reason));
    TEST_ASSERT_EQUAL_STRING("f", options.faults);
    TEST_ASSERT_EQUAL_INT(NODE_OPTIONS_HELP,
                          node_options_parse(&options, 2, help, reason, sizeof reason));
    TEST_ASSERT_EQUAL_INT(NODE_OPTIONS_WRONG,
                          node_options_parse(&options, 3, unknown, reason, sizeof reason));
    TEST_ASSERT_NOT_NULL(strstr(reason, "'--bos'"));
    TEST_ASSERT_EQUAL_INT(NODE_OPTIONS_WRONG,
                          node_options_parse(&options, 2, lacking, reason, sizeof reason));
    TEST_ASSERT_NOT_NULL(strstr(reason, "'--bus'"));
    TEST_ASSERT_EQUAL_INT(NODE_OPTIONS_WRONG,
                          node_options_parse(&options, 3, none, reason, sizeof reason));
    TEST_ASSERT_NOT_NULL(strstr(reason, "'--axis'"));
    TEST_ASSERT_EQUAL_INT(NODE_OPTIONS_WRONG,
                          node_options_parse(&options, 1, none, reason, sizeof reason));
    TEST_ASSERT_NULL(options.faults);
    char *operand[] = {"hodograph-drive", "--bus=vcan0", "vcan1", "--help"};
    TEST_ASSERT_EQUAL_INT(NODE_OPTIONS_WRONG,
                          node_options_parse(&options, 4, operand, reason, sizeof reason));
    TEST_ASSERT_EQUAL_STRING("unknown option 'vcan1' (see --help)", reason);
    char *letters[] = {"hodograph-drive", "-xy"};
    TEST_ASSERT_EQUAL_INT(NODE_OPTIONS_WRONG,
                          node_options_parse(&options, 2, letters, reason, sizeof reason));
    TEST_ASSERT_EQUAL_STRING("unknown option '-xy' (see --help)", reason);
    TEST_ASSERT_NOT_NULL(strstr(node_options_help, "Exit status"));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_two_axes_with_defaults_and_without);
    RUN_TEST(test_equipment);
    RUN_TEST(test_equipment_that_cannot_be);
    RUN_TEST(test_whole_numbers);
    RUN_TEST(test_faults_are_named);
    RUN_TEST(test_a_node_may_appear_once);
    RUN_TEST(test_options_themselves);
    return UNITY_END();
}
