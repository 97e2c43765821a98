/* SPDX-License-Identifier: MIT */
/* Tests of canopen/nmt.h: the NMT slave's state machine and the master's commands. Run by `make unit`; no I/O. */
#include "canopen/nmt.h"

#include "canopen/cob.h"
#include "unity.h"

#define NODE 7u

static struct nmt_slave slave;
static struct can_msg out;
static int node_resets, communication_resets, changes;
static enum nmt_state last_state;

static void on_reset_node(void *context)
{
    TEST_ASSERT_EQUAL_PTR(&slave, context);
    node_resets++;
}

static void on_reset_communication(void *context)
{
    (void)context;
    communication_resets++;
}

static void on_changed(void *context, enum nmt_state state)
{
    (void)context;
    changes++;
    last_state = state;
}

static const struct nmt_hooks hooks = {on_reset_node, on_reset_communication, on_changed};

void setUp(void)
{
    node_resets = communication_resets = changes = 0;
    nmt_slave_init(&slave, NODE, &hooks, &slave);
}

void tearDown(void)
{
}

static bool command(enum nmt_command code, uint8_t node)
{
    struct can_msg in;

    nmt_master_command(code, node, &in);
    return nmt_slave_receive(&slave, &in);
}

static void boot(void)
{
    TEST_ASSERT_TRUE(nmt_slave_process(&slave, &out));
}

static void test_boots_with_one_frame(void)
{
    TEST_ASSERT_EQUAL_HEX8(NMT_INITIALISING, slave.state);
    boot();
    TEST_ASSERT_EQUAL_HEX32(0x707, out.id);
    TEST_ASSERT_EQUAL_UINT8(1, out.len);
    TEST_ASSERT_EQUAL_HEX8(0, out.data[0]);
    TEST_ASSERT_EQUAL_HEX8(NMT_PRE_OPERATIONAL, slave.state);
    TEST_ASSERT_EQUAL_INT(1, changes);
    TEST_ASSERT_EQUAL_HEX8(NMT_PRE_OPERATIONAL, last_state);
    TEST_ASSERT_FALSE(nmt_slave_process(&slave, &out));
    TEST_ASSERT_EQUAL_INT(0, node_resets + communication_resets);
}

static void test_executes_its_own_and_common_commands(void)
{
    boot();
    TEST_ASSERT_TRUE(command(NMT_START, 0));
    TEST_ASSERT_EQUAL_HEX8(NMT_OPERATIONAL, slave.state);
    TEST_ASSERT_TRUE(command(NMT_STOP, NODE));
    TEST_ASSERT_EQUAL_HEX8(NMT_STOPPED, slave.state);
    TEST_ASSERT_TRUE(command(NMT_ENTER_PRE_OPERATIONAL, NODE));
    TEST_ASSERT_EQUAL_HEX8(NMT_PRE_OPERATIONAL, slave.state);
    TEST_ASSERT_FALSE(command(NMT_START, NODE + 1));
    TEST_ASSERT_EQUAL_HEX8(NMT_PRE_OPERATIONAL, slave.state);
    command(NMT_START, NODE);
    nmt_slave_process(&slave, &out);
    TEST_ASSERT_EQUAL_HEX8(NMT_OPERATIONAL, last_state);
}

static void test_ignores_malformed_frames(void)
{
    struct can_msg in;

    boot();
    cob_frame(&in, 0x000, 1);
    in.data[0] = NMT_START;
    TEST_ASSERT_FALSE(nmt_slave_receive(&slave, &in));
    cob_frame(&in, 0x001, 2);
    in.data[0] = NMT_START;
    TEST_ASSERT_FALSE(nmt_slave_receive(&slave, &in));
    cob_frame(&in, 0x000, 2);
    in.data[0] = 0x03;
    TEST_ASSERT_FALSE(nmt_slave_receive(&slave, &in));
    TEST_ASSERT_EQUAL_HEX8(NMT_PRE_OPERATIONAL, slave.state);
}

static void test_resets_in_the_main_loop_and_boots_again(void)
{
    boot();
    command(NMT_START, 0);
    TEST_ASSERT_TRUE(command(NMT_RESET_NODE, NODE));
    TEST_ASSERT_EQUAL_HEX8(NMT_INITIALISING, slave.state);
    TEST_ASSERT_EQUAL_INT(0, node_resets);
    boot();
    TEST_ASSERT_EQUAL_INT(1, node_resets);
    TEST_ASSERT_EQUAL_INT(0, communication_resets);
    TEST_ASSERT_EQUAL_HEX32(0x707, out.id);
    TEST_ASSERT_EQUAL_HEX8(NMT_PRE_OPERATIONAL, slave.state);
    command(NMT_RESET_COMMUNICATION, 0);
    boot();
    TEST_ASSERT_EQUAL_INT(1, communication_resets);
    TEST_ASSERT_EQUAL_INT(1, node_resets);
}

static void test_a_reset_is_not_overtaken(void)
{
    boot();
    command(NMT_RESET_COMMUNICATION, NODE);
    TEST_ASSERT_FALSE(command(NMT_START, NODE));
    TEST_ASSERT_TRUE(command(NMT_RESET_NODE, NODE));
    TEST_ASSERT_FALSE(command(NMT_RESET_COMMUNICATION, NODE));
    boot();
    TEST_ASSERT_EQUAL_INT(1, node_resets);
    TEST_ASSERT_EQUAL_INT(0, communication_resets);
}

static void test_nothing_starts_before_the_boot_up(void)
{
    TEST_ASSERT_FALSE(command(NMT_START, NODE));
    TEST_ASSERT_EQUAL_HEX8(NMT_INITIALISING, slave.state);
}

static void test_works_without_hooks(void)
{
    nmt_slave_init(&slave, NODE, NULL, NULL);
    boot();
    command(NMT_RESET_NODE, NODE);
    boot();
    TEST_ASSERT_EQUAL_INT(0, node_resets);
}

static void test_communication_errors(void)
{
    static const struct {
        enum nmt_state before;
        uint8_t behaviour;
        enum nmt_state after;
    } cases[] = {
        {NMT_OPERATIONAL, 0, NMT_PRE_OPERATIONAL},
        {NMT_PRE_OPERATIONAL, 0, NMT_PRE_OPERATIONAL},
        {NMT_STOPPED, 0, NMT_STOPPED},
        {NMT_OPERATIONAL, 1, NMT_OPERATIONAL},
        {NMT_OPERATIONAL, 2, NMT_STOPPED},
        {NMT_PRE_OPERATIONAL, 2, NMT_STOPPED},
        {NMT_INITIALISING, 2, NMT_INITIALISING},
        {NMT_OPERATIONAL, 3, NMT_OPERATIONAL},
    };

    for (unsigned i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        slave.state = cases[i].before;
        nmt_slave_error(&slave, cases[i].behaviour);
        TEST_ASSERT_EQUAL_HEX8(cases[i].after, slave.state);
    }
}

static void test_services_of_the_states(void)
{
    TEST_ASSERT_TRUE(nmt_permits_sdo(NMT_PRE_OPERATIONAL));
    TEST_ASSERT_TRUE(nmt_permits_sdo(NMT_OPERATIONAL));
    TEST_ASSERT_FALSE(nmt_permits_sdo(NMT_STOPPED));
    TEST_ASSERT_FALSE(nmt_permits_sdo(NMT_INITIALISING));
    TEST_ASSERT_TRUE(nmt_permits_pdo(NMT_OPERATIONAL));
    TEST_ASSERT_FALSE(nmt_permits_pdo(NMT_PRE_OPERATIONAL));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_boots_with_one_frame);
    RUN_TEST(test_executes_its_own_and_common_commands);
    RUN_TEST(test_ignores_malformed_frames);
    RUN_TEST(test_resets_in_the_main_loop_and_boots_again);
    RUN_TEST(test_a_reset_is_not_overtaken);
    RUN_TEST(test_nothing_starts_before_the_boot_up);
    RUN_TEST(test_works_without_hooks);
    RUN_TEST(test_communication_errors);
    RUN_TEST(test_services_of_the_states);
    return UNITY_END();
}
