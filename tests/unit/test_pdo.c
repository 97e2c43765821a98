/* SPDX-License-Identifier: MIT */
/* Tests of canopen/pdo.h: the fixed process data of the bus. Run by `make unit`; no I/O. */
#include "canopen/pdo.h"

#include "canopen/cob.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

static void test_setpoint_on_the_wire(void)
{
    const struct pdo_setpoint setpoint = {.target_counts = -2, .controlword = 0x010F};
    const uint8_t expected[6] = {0x0F, 0x01, 0xFE, 0xFF, 0xFF, 0xFF};
    struct can_msg out;

    pdo_encode_setpoint(3, &setpoint, &out);
    TEST_ASSERT_EQUAL_HEX32(0x203, out.id);
    TEST_ASSERT_EQUAL_UINT8(6, out.len);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, out.data, 6);
}

static void test_actual_on_the_wire(void)
{
    const struct pdo_actual actual = {.position_counts = 0x01020304, .statusword = 0x1237};
    const uint8_t expected[6] = {0x37, 0x12, 0x04, 0x03, 0x02, 0x01};
    struct can_msg out;

    pdo_encode_actual(127, &actual, &out);
    TEST_ASSERT_EQUAL_HEX32(0x1FF, out.id);
    TEST_ASSERT_EQUAL_UINT8(6, out.len);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, out.data, 6);
}

static void test_there_and_back(void)
{
    static const int32_t positions[] = {INT32_MIN, -1, 0, 1, 123456789, INT32_MAX};
    struct can_msg out;

    for (unsigned i = 0; i < sizeof positions / sizeof positions[0]; i++) {
        struct pdo_setpoint setpoint = {positions[i], 0xFFFF};
        struct pdo_setpoint got_setpoint = {0, 0};
        struct pdo_actual actual = {positions[i], 0x8001};
        struct pdo_actual got_actual = {0, 0};

        pdo_encode_setpoint(2, &setpoint, &out);
        TEST_ASSERT_EQUAL_INT(2, pdo_decode_setpoint(&out, &got_setpoint));
        TEST_ASSERT_EQUAL_INT32(positions[i], got_setpoint.target_counts);
        TEST_ASSERT_EQUAL_HEX16(0xFFFF, got_setpoint.controlword);
        TEST_ASSERT_EQUAL_INT(0, pdo_decode_actual(&out, &got_actual));
        pdo_encode_actual(2, &actual, &out);
        TEST_ASSERT_EQUAL_INT(2, pdo_decode_actual(&out, &got_actual));
        TEST_ASSERT_EQUAL_INT32(positions[i], got_actual.position_counts);
        TEST_ASSERT_EQUAL_HEX16(0x8001, got_actual.statusword);
    }
}

static void test_volts(void)
{
    struct can_msg out;
    int16_t volts_mv = 0;

    pdo_encode_volts(2, -4321, &out);
    TEST_ASSERT_EQUAL_HEX32(0x282, out.id);
    TEST_ASSERT_EQUAL_UINT8(2, out.len);
    TEST_ASSERT_EQUAL_INT(2, pdo_decode_volts(&out, &volts_mv));
    TEST_ASSERT_EQUAL_INT16(-4321, volts_mv);
    out.len = 1;
    TEST_ASSERT_EQUAL_INT(PDO_ERR_SHORT, pdo_decode_volts(&out, &volts_mv));
}

static void test_feedforward_and_inputs(void)
{
    const struct pdo_setpoint setpoint = {.controlword = 0x000F, .target_counts = -2};
    const uint8_t wire[] = {0x0F, 0x00, 0xFE, 0xFF, 0xFF, 0xFF, 0x18, 0xFC};
    struct pdo_setpoint back;
    struct can_msg out;
    int16_t torque = 0;
    int32_t velocity = 0;
    uint32_t inputs = 0;

    pdo_encode_setpoint(3, &setpoint, &out);
    pdo_add_torque(&out, -1000);
    TEST_ASSERT_EQUAL_HEX32(0x203, out.id);
    TEST_ASSERT_EQUAL_UINT8(8, out.len);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(wire, out.data, 8);
    TEST_ASSERT_EQUAL_INT(3, pdo_decode_setpoint(&out, &back));
    TEST_ASSERT_EQUAL_INT32(-2, back.target_counts);
    TEST_ASSERT_EQUAL_INT(3, pdo_decode_torque(&out, &torque));
    TEST_ASSERT_EQUAL_INT16(-1000, torque);
    out.len = 6;
    TEST_ASSERT_EQUAL_INT(PDO_ERR_SHORT, pdo_decode_torque(&out, &torque));

    pdo_encode_velocity(4, INT32_MIN, &out);
    TEST_ASSERT_EQUAL_HEX32(0x304, out.id);
    TEST_ASSERT_EQUAL_INT(4, pdo_decode_velocity(&out, &velocity));
    TEST_ASSERT_EQUAL_INT32(INT32_MIN, velocity);

    pdo_encode_inputs(5, 0x80000006u, &out);
    TEST_ASSERT_EQUAL_HEX32(0x385, out.id);
    TEST_ASSERT_EQUAL_INT(5, pdo_decode_inputs(&out, &inputs));
    TEST_ASSERT_EQUAL_HEX32(0x80000006u, inputs);
    out.len = 3;
    TEST_ASSERT_EQUAL_INT(PDO_ERR_SHORT, pdo_decode_inputs(&out, &inputs));
}

static void test_lengths(void)
{
    struct pdo_actual actual = {7, 7};
    struct can_msg in;

    cob_frame(&in, 0x185, 5);
    TEST_ASSERT_EQUAL_INT(PDO_ERR_SHORT, pdo_decode_actual(&in, &actual));
    TEST_ASSERT_EQUAL_INT32(7, actual.position_counts);
    cob_frame(&in, 0x185, 8);
    TEST_ASSERT_EQUAL_INT(5, pdo_decode_actual(&in, &actual));
    TEST_ASSERT_EQUAL_INT32(0, actual.position_counts);
}

static void test_other_identifiers(void)
{
    struct pdo_actual actual;
    struct can_msg in;

    cob_frame(&in, 0x180, 6); /* node 0 does not exist */
    TEST_ASSERT_EQUAL_INT(0, pdo_decode_actual(&in, &actual));
    cob_frame(&in, 0x200, 6);
    TEST_ASSERT_EQUAL_INT(0, pdo_decode_actual(&in, &actual));
    cob_frame(&in, 0x701, 1);
    TEST_ASSERT_EQUAL_INT(0, pdo_decode_actual(&in, &actual));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_setpoint_on_the_wire);
    RUN_TEST(test_actual_on_the_wire);
    RUN_TEST(test_there_and_back);
    RUN_TEST(test_volts);
    RUN_TEST(test_feedforward_and_inputs);
    RUN_TEST(test_lengths);
    RUN_TEST(test_other_identifiers);
    return UNITY_END();
}
