/* SPDX-License-Identifier: MIT */
/* Tests of canopen/pdo_map.h: one remappable PDO of a device. Run by `make unit`; no I/O. */
#include "canopen/pdo_map.h"

#include "canopen/cob.h"
#include "canopen/sdo_abort.h"
#include "od_drive.h"
#include "unity.h"

enum { ID = 5 };

static struct od_drive values;
static struct od od;
static struct pdo_map rpdo;
static struct pdo_map rpdo2;
static struct pdo_map tpdo;
static struct pdo_map tpdo3;
static struct pdo_map *const maps[] = {&rpdo, &rpdo2, &tpdo, &tpdo3};

static uint32_t on_write(void *context, const struct od_entry *entry, const uint8_t *value,
                         uint32_t size)
{
    (void)context;
    for (unsigned i = 0; i < 4; i++) {
        const uint32_t code = pdo_map_write(maps[i], entry, value, size);
        if (code != SDO_OK) {
            return code;
        }
    }
    return SDO_OK;
}

static void on_written(void *context, const struct od_entry *entry)
{
    (void)context;
    for (unsigned i = 0; i < 4; i++) {
        (void)pdo_map_written(maps[i], entry);
    }
}

static const struct od_hooks hooks = {.write = on_write, .written = on_written};

static uint32_t set(uint16_t index, uint8_t sub, uint32_t value)
{
    const struct od_entry *entry = od_find(&od, index, sub);
    uint8_t bytes[4];
    TEST_ASSERT_NOT_NULL(entry);
    cob_put(bytes, value, entry->size);
    return od_write(&od, entry, bytes, entry->size);
}

static void put(uint16_t index, uint8_t sub, uint32_t value)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, set(index, sub, value));
}

/* A received frame with the bytes 1, 2, 3 ... */
static struct can_msg frame(uint32_t id, uint8_t len)
{
    struct can_msg out;
    cob_frame(&out, id, len);
    for (uint8_t i = 0; i < len; i++) {
        out.data[i] = (uint8_t)(i + 1);
    }
    return out;
}

void setUp(void)
{
    values = od_drive_defaults;
    od_drive_set_node(&values, ID);
    od_init(&od, &od_drive_table, &values, &hooks, NULL);
    pdo_map_init(&rpdo, &od, 0x1400);
    pdo_map_init(&rpdo2, &od, 0x1401);
    pdo_map_init(&tpdo, &od, 0x1800);
    pdo_map_init(&tpdo3, &od, 0x1802);
}

void tearDown(void)
{
}

static void test_defaults_are_the_fixed_pdos(void)
{
    TEST_ASSERT_TRUE(rpdo.valid);
    TEST_ASSERT_EQUAL_HEX16(0x205, rpdo.cob_id);
    TEST_ASSERT_EQUAL_UINT8(6, rpdo.length);
    TEST_ASSERT_FALSE(rpdo2.valid);
    TEST_ASSERT_EQUAL_HEX16(0x305, rpdo2.cob_id);
    TEST_ASSERT_TRUE(tpdo.valid);
    TEST_ASSERT_EQUAL_HEX16(0x185, tpdo.cob_id);
    TEST_ASSERT_EQUAL_UINT8(6, tpdo.length);
    TEST_ASSERT_FALSE(tpdo3.valid);
}

static void test_synchronous_values_wait_for_sync(void)
{
    const struct can_msg in = frame(0x205, 6);
    TEST_ASSERT_EQUAL_INT(PDO_MAP_TAKEN, pdo_map_receive(&rpdo, &in));
    TEST_ASSERT_EQUAL_HEX16(0, values.controlword);
    TEST_ASSERT_TRUE(pdo_map_apply(&rpdo));
    TEST_ASSERT_EQUAL_HEX16(0x0201, values.controlword);
    TEST_ASSERT_EQUAL_HEX32(0x06050403, values.target_position);
    TEST_ASSERT_FALSE(pdo_map_apply(&rpdo));
}

static void test_asynchronous_values_act_at_once(void)
{
    const struct can_msg in = frame(0x205, 8);
    put(0x1400, 2, 255);
    TEST_ASSERT_EQUAL_INT(PDO_MAP_TAKEN, pdo_map_receive(&rpdo, &in));
    TEST_ASSERT_EQUAL_HEX16(0x0201, values.controlword);
    TEST_ASSERT_FALSE(pdo_map_apply(&rpdo));
}

static void test_other_and_short_frames(void)
{
    const struct can_msg other = frame(0x206, 6);
    const struct can_msg off = frame(0x305, 4);
    const struct can_msg brief = frame(0x205, 5);
    TEST_ASSERT_EQUAL_INT(PDO_MAP_NOT, pdo_map_receive(&rpdo, &other));
    TEST_ASSERT_EQUAL_INT(PDO_MAP_NOT, pdo_map_receive(&rpdo2, &off));
    TEST_ASSERT_EQUAL_INT(PDO_MAP_SHORT, pdo_map_receive(&rpdo, &brief));
    TEST_ASSERT_FALSE(pdo_map_apply(&rpdo));
}

static void test_remapping_in_order(void)
{
    put(0x1400, 1, PDO_MAP_OFF | 0x205);
    put(0x1600, 0, 0);
    put(0x1600, 3, 0x60B20010);
    put(0x1600, 0, 3);
    put(0x1400, 1, 0x205);
    TEST_ASSERT_EQUAL_UINT8(8, rpdo.length);
    struct can_msg in = frame(0x205, 6);
    TEST_ASSERT_EQUAL_INT(PDO_MAP_SHORT, pdo_map_receive(&rpdo, &in));
    in = frame(0x205, 8);
    TEST_ASSERT_EQUAL_INT(PDO_MAP_TAKEN, pdo_map_receive(&rpdo, &in));
    (void)pdo_map_apply(&rpdo);
    TEST_ASSERT_EQUAL_HEX16(0x0807, values.torque_offset);
    put(0x1401, 1, 0x305);
    in = frame(0x305, 4);
    TEST_ASSERT_EQUAL_INT(PDO_MAP_TAKEN, pdo_map_receive(&rpdo2, &in));
    (void)pdo_map_apply(&rpdo2);
    TEST_ASSERT_EQUAL_HEX32(0x04030201, values.velocity_offset);
}

static void test_refusals_while_valid(void)
{
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, set(0x1600, 0, 0));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, set(0x1600, 1, 0x60400010));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, set(0x1800, 3, 10));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_VALUE, set(0x1400, 1, 0x206));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, set(0x1400, 1, 0x205));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, set(0x1400, 1, 0x40000205));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, set(0x1400, 5, 100));
}

static void test_refusals_of_a_mapping(void)
{
    put(0x1400, 1, PDO_MAP_OFF | 0x205);
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_STATE, set(0x1600, 1, 0x60400010));
    put(0x1600, 0, 0);
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_NO_OBJECT, set(0x1600, 1, 0x6FFF0010));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_NO_SUB, set(0x1600, 1, 0x60400110));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_NOT_MAPPABLE, set(0x1600, 1, 0x605A0010));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_NOT_MAPPABLE, set(0x1600, 1, 0x60410010)); /* ro */
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_NOT_MAPPABLE, set(0x1600, 1, 0x60400008));
    put(0x1600, 1, 0x607A0020);
    put(0x1600, 2, 0x60B10020);
    put(0x1600, 3, 0x60400010);
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_PDO_LENGTH, set(0x1600, 0, 3));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_NO_OBJECT, set(0x1600, 0, 4)); /* sub 4 is empty */
    put(0x1600, 0, 2);
    TEST_ASSERT_EQUAL_UINT8(8, rpdo.length);
}

static void test_refusals_of_parameters(void)
{
    static const uint32_t ids[] = {0x000, 0x080, 0x101, 0x180, 0x585, 0x605, 0x6E0, 0x705, 0x7FF};
    put(0x1401, 1, PDO_MAP_OFF | 0x666);
    for (unsigned i = 0; i < sizeof ids / sizeof ids[0]; i++) {
        TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_VALUE, set(0x1401, 1, ids[i]));
    }
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_VALUE, set(0x1401, 1, 0x20000305));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_VALUE, set(0x1401, 1, 0x00000A05));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, set(0x1401, 1, 0x385));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, set(0x1401, 2, 240));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_VALUE, set(0x1401, 2, 241));
    TEST_ASSERT_EQUAL_HEX32(SDO_ABORT_VALUE, set(0x1401, 2, 253));
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, set(0x1401, 2, 254));
}

static void test_deadline(void)
{
    const struct can_msg in = frame(0x205, 6);
    put(0x1400, 5, 10);
    TEST_ASSERT_FALSE(pdo_map_overdue(&rpdo, 50000)); /* starts with the first frame */
    (void)pdo_map_receive(&rpdo, &in);
    TEST_ASSERT_FALSE(pdo_map_overdue(&rpdo, 10000));
    (void)pdo_map_receive(&rpdo, &in);
    TEST_ASSERT_FALSE(pdo_map_overdue(&rpdo, 10000));
    TEST_ASSERT_TRUE(pdo_map_overdue(&rpdo, 1));
    TEST_ASSERT_FALSE(pdo_map_overdue(&rpdo, 50000));
    (void)pdo_map_receive(&rpdo, &in);
    pdo_map_restart(&rpdo);
    TEST_ASSERT_FALSE(pdo_map_overdue(&rpdo, 50000));
}

static void test_sent_with_every_so_many_syncs(void)
{
    struct can_msg out;
    values.statusword = 0x1234;
    values.position_actual_value = -2;
    TEST_ASSERT_TRUE(pdo_map_sync(&tpdo, &out));
    TEST_ASSERT_EQUAL_HEX32(0x185, out.id);
    TEST_ASSERT_EQUAL_UINT8(6, out.len);
    TEST_ASSERT_EQUAL_HEX64(0xFFFFFFFE1234u, cob_get(out.data, 6));
    put(0x1800, 2, 3);
    for (int i = 1; i <= 9; i++) {
        TEST_ASSERT_EQUAL_INT(i % 3 == 0, pdo_map_sync(&tpdo, &out));
    }
}

static void test_sent_with_sync_on_change(void)
{
    struct can_msg out;
    put(0x1800, 2, 0);
    TEST_ASSERT_TRUE(pdo_map_sync(&tpdo, &out));
    TEST_ASSERT_FALSE(pdo_map_sync(&tpdo, &out));
    values.statusword = 1;
    TEST_ASSERT_TRUE(pdo_map_sync(&tpdo, &out));
    TEST_ASSERT_FALSE(pdo_map_process(&tpdo, 1000000, &out));
}

static void test_sent_on_change(void)
{
    struct can_msg out;
    TEST_ASSERT_FALSE(pdo_map_process(&tpdo3, 1000000, &out)); /* off */
    put(0x1802, 1, 0x385);
    TEST_ASSERT_TRUE(pdo_map_process(&tpdo3, 0, &out));
    TEST_ASSERT_EQUAL_UINT8(4, out.len);
    TEST_ASSERT_FALSE(pdo_map_sync(&tpdo3, &out));
    TEST_ASSERT_FALSE(pdo_map_process(&tpdo3, 1000000, &out));
    values.digital_inputs = 1;
    TEST_ASSERT_TRUE(pdo_map_process(&tpdo3, 0, &out));
    values.digital_inputs = 2; /* 10 ms of inhibit time */
    TEST_ASSERT_FALSE(pdo_map_process(&tpdo3, 9999, &out));
    TEST_ASSERT_TRUE(pdo_map_process(&tpdo3, 1, &out));
    TEST_ASSERT_EQUAL_HEX8(2, out.data[0]);
    put(0x1802, 5, 50);
    (void)pdo_map_process(&tpdo3, 0, &out);
    TEST_ASSERT_FALSE(pdo_map_process(&tpdo3, 49999, &out));
    TEST_ASSERT_TRUE(pdo_map_process(&tpdo3, 1, &out));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_defaults_are_the_fixed_pdos);
    RUN_TEST(test_synchronous_values_wait_for_sync);
    RUN_TEST(test_asynchronous_values_act_at_once);
    RUN_TEST(test_other_and_short_frames);
    RUN_TEST(test_remapping_in_order);
    RUN_TEST(test_refusals_while_valid);
    RUN_TEST(test_refusals_of_a_mapping);
    RUN_TEST(test_refusals_of_parameters);
    RUN_TEST(test_deadline);
    RUN_TEST(test_sent_with_every_so_many_syncs);
    RUN_TEST(test_sent_with_sync_on_change);
    RUN_TEST(test_sent_on_change);
    return UNITY_END();
}
