/* SPDX-License-Identifier: MIT */
/* Both sides of the CiA 402 state machine, each against the standard's tables and against each other. Run by
 * `make unit`; no I/O. */
#include "canopen/cia402.h"

#include "canopen/cia402_device.h"
#include "canopen/cia402_master.h"
#include "unity.h"

#define STATES 8

static struct cia402_device device;

void setUp(void)
{
    cia402_device_init(&device);
}

void tearDown(void)
{
}

static void put_in(enum cia402_state state)
{
    cia402_device_init(&device);
    device.state = state;
}

static void test_statuswords_of_the_standard(void)
{
    static const uint16_t bits[STATES] = {0x00, 0x40, 0x21, 0x23, 0x27, 0x07, 0x0F, 0x08};

    for (int state = 0; state < STATES; state++) {
        TEST_ASSERT_EQUAL_HEX16(bits[state], cia402_status_bits((enum cia402_state)state));
    }
}

static void test_decodes_whatever_the_other_bits_are(void)
{
    const uint16_t others = 0xFF90; /* all but 0 ... 3, 5, 6 */

    for (int state = 0; state < STATES; state++) {
        uint16_t bits = cia402_status_bits((enum cia402_state)state);
        TEST_ASSERT_EQUAL_INT(state, cia402_decode(bits));
        TEST_ASSERT_EQUAL_INT(state, cia402_decode((uint16_t)(bits | others)));
    }
    TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, cia402_decode(0x0060));
    TEST_ASSERT_EQUAL_INT(CIA402_FAULT, cia402_decode(0x0028));
    TEST_ASSERT_EQUAL_INT(CIA402_NOT_READY, cia402_decode(0x0001)); /* no such coding */
    TEST_ASSERT_EQUAL_STRING("Operation enabled", cia402_state_name(CIA402_OPERATION_ENABLED));
}

static void test_power_on(void)
{
    TEST_ASSERT_EQUAL_INT(CIA402_NOT_READY, device.state);
    TEST_ASSERT_FALSE(cia402_device_control(&device, CIA402_SHUTDOWN));
    TEST_ASSERT_TRUE(cia402_device_ready(&device));
    TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, device.state);
    TEST_ASSERT_FALSE(cia402_device_ready(&device));
}

/* Every state with every command: the table of transitions 2 ... 11, 15, 16 as CiA 402-2 has it. */
static void test_every_command_in_every_state(void)
{
    enum {
        NR = CIA402_NOT_READY,
        SD = CIA402_SWITCH_ON_DISABLED,
        RD = CIA402_READY_TO_SWITCH_ON,
        SW = CIA402_SWITCHED_ON,
        OE = CIA402_OPERATION_ENABLED,
        QS = CIA402_QUICK_STOP_ACTIVE,
        FR = CIA402_FAULT_REACTION_ACTIVE,
        FT = CIA402_FAULT
    };
    static const uint16_t commands[6] = {CIA402_DISABLE_VOLTAGE,  CIA402_QUICK_STOP,
                                         CIA402_SHUTDOWN,         CIA402_SWITCH_ON,
                                         CIA402_ENABLE_OPERATION, CIA402_FAULT_RESET};
    static const int expected[STATES][6] = {
        [NR] = {NR, NR, NR, NR, NR, NR}, [SD] = {SD, SD, RD, SD, SD, SD},
        [RD] = {SD, SD, RD, SW, SW, SD}, [SW] = {SD, SD, RD, SW, OE, SD},
        [OE] = {SD, QS, RD, SW, OE, SD}, [QS] = {SD, QS, QS, QS, QS, SD},
        [FR] = {FR, FR, FR, FR, FR, FR}, [FT] = {FT, FT, FT, FT, FT, SD},
    };

    for (int state = 0; state < STATES; state++) {
        for (int i = 0; i < 6; i++) {
            put_in((enum cia402_state)state);
            bool changed = cia402_device_control(&device, commands[i]);
            TEST_ASSERT_EQUAL_INT(expected[state][i], device.state);
            TEST_ASSERT_EQUAL_INT(expected[state][i] != state, changed);
        }
    }
}

static void test_ready_to_operation_takes_two_steps(void)
{
    put_in(CIA402_READY_TO_SWITCH_ON);
    cia402_device_control(&device, CIA402_ENABLE_OPERATION);
    TEST_ASSERT_EQUAL_INT(CIA402_SWITCHED_ON, device.state);
    cia402_device_control(&device, CIA402_ENABLE_OPERATION);
    TEST_ASSERT_EQUAL_INT(CIA402_OPERATION_ENABLED, device.state);
}

static void test_quick_stop_options(void)
{
    put_in(CIA402_OPERATION_ENABLED);
    device.options.quick_stop = 0;
    cia402_device_control(&device, CIA402_QUICK_STOP);
    TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, device.state);

    put_in(CIA402_OPERATION_ENABLED);
    device.options.quick_stop = 2;
    cia402_device_control(&device, CIA402_QUICK_STOP);
    TEST_ASSERT_EQUAL_INT(CIA402_STOP_QUICKLY, cia402_device_action(&device));
    TEST_ASSERT_TRUE(cia402_device_stopped(&device));
    TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, device.state);

    put_in(CIA402_OPERATION_ENABLED);
    device.options.quick_stop = 6;
    TEST_ASSERT_TRUE(cia402_device_quick_stop(&device));
    TEST_ASSERT_FALSE(cia402_device_stopped(&device));
    TEST_ASSERT_TRUE(device.stopped);
    TEST_ASSERT_EQUAL_INT(CIA402_QUICK_STOP_ACTIVE, device.state);
    TEST_ASSERT_TRUE(cia402_device_control(&device, CIA402_ENABLE_OPERATION));
    TEST_ASSERT_EQUAL_INT(CIA402_OPERATION_ENABLED, device.state);
    TEST_ASSERT_FALSE(device.stopped);
}

static void test_quick_stop_only_out_of_operation(void)
{
    put_in(CIA402_SWITCHED_ON);
    TEST_ASSERT_FALSE(cia402_device_quick_stop(&device));
    TEST_ASSERT_EQUAL_INT(CIA402_SWITCHED_ON, device.state);
    TEST_ASSERT_FALSE(cia402_device_stopped(&device));
}

static void test_faults(void)
{
    static const enum cia402_state after[STATES] = {
        CIA402_FAULT,
        CIA402_FAULT,
        CIA402_FAULT,
        CIA402_FAULT,
        CIA402_FAULT_REACTION_ACTIVE,
        CIA402_FAULT_REACTION_ACTIVE,
        CIA402_FAULT_REACTION_ACTIVE,
        CIA402_FAULT,
    };

    for (int state = 0; state < STATES; state++) {
        put_in((enum cia402_state)state);
        cia402_device_fault(&device);
        TEST_ASSERT_EQUAL_INT(after[state], device.state);
    }
    put_in(CIA402_OPERATION_ENABLED);
    cia402_device_fault(&device);
    TEST_ASSERT_EQUAL_INT(CIA402_STOP_FOR_FAULT, cia402_device_action(&device));
    TEST_ASSERT_TRUE(cia402_device_stopped(&device));
    TEST_ASSERT_EQUAL_INT(CIA402_FAULT, device.state);
    put_in(CIA402_OPERATION_ENABLED);
    device.options.fault_reaction = 0;
    cia402_device_fault(&device);
    TEST_ASSERT_EQUAL_INT(CIA402_FAULT, device.state);
}

static void test_fault_reset_needs_a_rising_edge(void)
{
    put_in(CIA402_OPERATION_ENABLED);
    cia402_device_control(&device, CIA402_ENABLE_OPERATION | CIA402_CONTROL_FAULT_RESET);
    cia402_device_fault(&device);
    cia402_device_stopped(&device);
    TEST_ASSERT_FALSE(cia402_device_control(&device, CIA402_FAULT_RESET));
    TEST_ASSERT_FALSE(cia402_device_control(&device, CIA402_DISABLE_VOLTAGE));
    TEST_ASSERT_TRUE(cia402_device_control(&device, CIA402_FAULT_RESET));
    TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, device.state);
}

static void test_actions(void)
{
    static const enum cia402_action actions[STATES] = {
        CIA402_POWER_OFF, CIA402_POWER_OFF,    CIA402_POWER_OFF,      CIA402_HOLD,
        CIA402_FOLLOW,    CIA402_STOP_QUICKLY, CIA402_STOP_FOR_FAULT, CIA402_POWER_OFF,
    };

    for (int state = 0; state < STATES; state++) {
        put_in((enum cia402_state)state);
        TEST_ASSERT_EQUAL_INT(actions[state], cia402_device_action(&device));
    }
}

static void test_leaving_with_a_stop(void)
{
    static const struct {
        uint16_t command;
        enum cia402_state to;
    } rows[] = {{CIA402_SHUTDOWN, CIA402_READY_TO_SWITCH_ON},
                {CIA402_SWITCH_ON, CIA402_SWITCHED_ON}};

    for (int i = 0; i < 2; i++) {
        put_in(CIA402_OPERATION_ENABLED);
        device.options.shutdown = 1;
        device.options.disable = 1;
        TEST_ASSERT_FALSE(cia402_device_control(&device, rows[i].command));
        TEST_ASSERT_EQUAL_INT(CIA402_SLOW_DOWN, cia402_device_action(&device));
        TEST_ASSERT_EQUAL_INT(CIA402_OPERATION_ENABLED, device.state);
        TEST_ASSERT_FALSE(cia402_device_control(&device, CIA402_ENABLE_OPERATION));
        TEST_ASSERT_EQUAL_INT(CIA402_FOLLOW, cia402_device_action(&device));
        TEST_ASSERT_FALSE(cia402_device_stopped(&device)); /* called off */
        cia402_device_control(&device, rows[i].command);
        TEST_ASSERT_TRUE(cia402_device_stopped(&device));
        TEST_ASSERT_EQUAL_INT(rows[i].to, device.state);
    }
    put_in(CIA402_OPERATION_ENABLED);
    device.options.disable = 1;
    cia402_device_control(&device, CIA402_SWITCH_ON);
    TEST_ASSERT_TRUE(cia402_device_control(&device, CIA402_DISABLE_VOLTAGE)); /* does not wait */
    TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, device.state);
    TEST_ASSERT_FALSE(device.leaving);
}

static void test_power_off_from_inside(void)
{
    for (int state = 0; state < STATES; state++) {
        put_in((enum cia402_state)state);
        const bool has_power =
            state >= CIA402_READY_TO_SWITCH_ON && state <= CIA402_QUICK_STOP_ACTIVE;
        TEST_ASSERT_EQUAL_INT(has_power, cia402_device_power_off(&device));
        TEST_ASSERT_EQUAL_INT(has_power ? CIA402_SWITCH_ON_DISABLED : state, device.state);
    }
}

static void test_a_cause_that_persists(void)
{
    put_in(CIA402_FAULT);
    device.fault_persists = true;
    TEST_ASSERT_FALSE(cia402_device_control(&device, CIA402_FAULT_RESET));
    cia402_device_control(&device, 0);
    device.fault_persists = false;
    TEST_ASSERT_TRUE(cia402_device_control(&device, CIA402_FAULT_RESET));
}

static void test_standing_after_a_quick_stop_is_target_reached(void)
{
    put_in(CIA402_OPERATION_ENABLED);
    device.options.quick_stop = 6;
    cia402_device_control(&device, CIA402_QUICK_STOP);
    TEST_ASSERT_EQUAL_HEX16(0, cia402_device_statusword(&device) & CIA402_STATUS_TARGET_REACHED);
    TEST_ASSERT_FALSE(cia402_device_stopped(&device));
    TEST_ASSERT_TRUE((cia402_device_statusword(&device) & CIA402_STATUS_TARGET_REACHED) != 0);
    TEST_ASSERT_TRUE(cia402_device_control(&device, CIA402_ENABLE_OPERATION));
    TEST_ASSERT_EQUAL_HEX16(0, cia402_device_statusword(&device) & CIA402_STATUS_TARGET_REACHED);
}

static void test_statusword_carries_the_flags(void)
{
    put_in(CIA402_OPERATION_ENABLED);
    device.flags = CIA402_STATUS_REMOTE | CIA402_STATUS_VOLTAGE | CIA402_STATUS_FOLLOWS;
    TEST_ASSERT_EQUAL_HEX16(0x1237, cia402_device_statusword(&device));
    put_in(CIA402_SWITCHED_ON);
    device.flags = CIA402_STATUS_REMOTE | CIA402_STATUS_VOLTAGE | CIA402_STATUS_FOLLOWS;
    TEST_ASSERT_EQUAL_HEX16(0x0233, cia402_device_statusword(&device));
}

/* Master and device with a delay of `lag` periods from statusword to controlword. */
static int periods_to(enum cia402_goal goal, unsigned lag)
{
    uint16_t words[4];
    uint16_t control = device.controlword;

    for (unsigned i = 0; i < 4; i++) {
        words[i] = cia402_device_statusword(&device);
    }
    for (int period = 0; period < 40; period++) {
        words[(unsigned)period % 4] = cia402_device_statusword(&device);
        if (cia402_master_reached(goal, cia402_device_statusword(&device))) {
            return period;
        }
        control = cia402_master_controlword(
            goal, cia402_decode(words[((unsigned)period + 4 - lag) % 4]), control);
        cia402_device_control(&device, control);
    }
    return -1;
}

static void test_master_reaches_each_goal_from_each_state(void)
{
    static const enum cia402_goal goals[] = {CIA402_GOAL_OFF, CIA402_GOAL_READY,
                                             CIA402_GOAL_SWITCHED_ON, CIA402_GOAL_ENABLED};

    for (unsigned lag = 0; lag < 3; lag++) {
        for (int state = CIA402_SWITCH_ON_DISABLED; state <= CIA402_QUICK_STOP_ACTIVE; state++) {
            for (unsigned i = 0; i < sizeof goals / sizeof goals[0]; i++) {
                put_in((enum cia402_state)state);
                TEST_ASSERT_GREATER_OR_EQUAL_INT(0, periods_to(goals[i], lag));
            }
        }
    }
}

static void test_master_enables_in_three_steps(void)
{
    put_in(CIA402_SWITCH_ON_DISABLED);
    TEST_ASSERT_EQUAL_INT(3, periods_to(CIA402_GOAL_ENABLED, 0));
}

static void test_master_stays_at_its_goal(void)
{
    for (int state = CIA402_READY_TO_SWITCH_ON; state <= CIA402_OPERATION_ENABLED; state++) {
        enum cia402_goal goal =
            (enum cia402_goal)(CIA402_GOAL_READY + state - CIA402_READY_TO_SWITCH_ON);
        put_in((enum cia402_state)state);
        TEST_ASSERT_EQUAL_INT(0, periods_to(goal, 0));
        cia402_device_control(&device, cia402_master_controlword(goal, device.state, 0));
        TEST_ASSERT_EQUAL_INT(state, device.state);
    }
}

static void test_master_leaves_a_fault_only_by_command(void)
{
    for (unsigned lag = 0; lag < 3; lag++) {
        put_in(CIA402_FAULT);
        TEST_ASSERT_EQUAL_INT(-1, periods_to(CIA402_GOAL_ENABLED, lag));
        TEST_ASSERT_EQUAL_INT(-1, periods_to(CIA402_GOAL_OFF, lag));
        TEST_ASSERT_GREATER_OR_EQUAL_INT(0, periods_to(CIA402_GOAL_RESET, lag));
        put_in(CIA402_FAULT);
        device.controlword = CIA402_FAULT_RESET; /* already set: has to fall first */
        TEST_ASSERT_GREATER_OR_EQUAL_INT(0, periods_to(CIA402_GOAL_RESET, lag));
    }
}

/* Transitions of CiA 402-2 by goal, one letter a state: 6, 7, F are the commands, 0 and Q off and quick stop, R
 * reset. */
static void test_master_commands_are_those_of_the_standard(void)
{
    static const char *const letters[CIA402_GOALS] = {"00000000", "06666000", "06777000",
                                                      "067FF000", "QQQQQQQQ", "0000000R"};
    for (int goal = 0; goal < CIA402_GOALS; goal++) {
        for (int state = 0; state < CIA402_STATES; state++) {
            const char letter = letters[goal][state];
            const uint16_t expected = letter == '0'   ? CIA402_DISABLE_VOLTAGE
                                      : letter == '6' ? CIA402_SHUTDOWN
                                      : letter == '7' ? CIA402_SWITCH_ON
                                      : letter == 'F' ? CIA402_ENABLE_OPERATION
                                      : letter == 'Q' ? CIA402_QUICK_STOP
                                                      : CIA402_FAULT_RESET;
            TEST_ASSERT_EQUAL_HEX16(
                expected,
                cia402_master_controlword((enum cia402_goal)goal, (enum cia402_state)state, 0));
        }
    }
    TEST_ASSERT_EQUAL_HEX16(
        0, cia402_master_controlword(CIA402_GOAL_RESET, CIA402_FAULT, CIA402_FAULT_RESET));
}

static void test_master_quick_stop(void)
{
    put_in(CIA402_OPERATION_ENABLED);
    TEST_ASSERT_EQUAL_INT(1, periods_to(CIA402_GOAL_QUICK_STOP, 0));
    TEST_ASSERT_EQUAL_HEX16(CIA402_QUICK_STOP,
                            cia402_master_controlword(CIA402_GOAL_QUICK_STOP, device.state, 0));
    put_in(CIA402_SWITCHED_ON);
    TEST_ASSERT_EQUAL_HEX16(CIA402_QUICK_STOP,
                            cia402_master_controlword(CIA402_GOAL_QUICK_STOP, device.state, 0));
    (void)periods_to(CIA402_GOAL_QUICK_STOP, 0);
    TEST_ASSERT_EQUAL_INT(CIA402_SWITCH_ON_DISABLED, device.state);
}

static void test_modes(void)
{
    TEST_ASSERT_EQUAL_HEX32(0x80, CIA402_SUPPORTS(CIA402_MODE_CSP));
    TEST_ASSERT_EQUAL_HEX32(0x20, CIA402_SUPPORTS(CIA402_MODE_HOMING));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_statuswords_of_the_standard);
    RUN_TEST(test_decodes_whatever_the_other_bits_are);
    RUN_TEST(test_power_on);
    RUN_TEST(test_every_command_in_every_state);
    RUN_TEST(test_ready_to_operation_takes_two_steps);
    RUN_TEST(test_quick_stop_options);
    RUN_TEST(test_quick_stop_only_out_of_operation);
    RUN_TEST(test_faults);
    RUN_TEST(test_fault_reset_needs_a_rising_edge);
    RUN_TEST(test_actions);
    RUN_TEST(test_leaving_with_a_stop);
    RUN_TEST(test_power_off_from_inside);
    RUN_TEST(test_a_cause_that_persists);
    RUN_TEST(test_standing_after_a_quick_stop_is_target_reached);
    RUN_TEST(test_statusword_carries_the_flags);
    RUN_TEST(test_master_reaches_each_goal_from_each_state);
    RUN_TEST(test_master_enables_in_three_steps);
    RUN_TEST(test_master_stays_at_its_goal);
    RUN_TEST(test_master_leaves_a_fault_only_by_command);
    RUN_TEST(test_master_commands_are_those_of_the_standard);
    RUN_TEST(test_master_quick_stop);
    RUN_TEST(test_modes);
    return UNITY_END();
}
