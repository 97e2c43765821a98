/* SPDX-License-Identifier: MIT */
/*
 * Fuzz harness of faults/fault_rules.h: any text to the parser of fault rules, and what the injector and the drives do
 * by the rules that it takes. A refusal has one line; all frames that come out are frames; time that is due comes.
 *
 * Input: text up to the first byte 0, then frames and time.
 *
 * Run by `make fuzz` with libFuzzer, and on its corpus by `make test` and `make unit` (replay.c). No I/O, except that a
 * broken rule is printed and aborts the process.
 */
#include <string.h>

#include "drive_bench.h"
#include "faults/fault_rules.h"
#include "fuzz.h"
#include "injector/forwarder.h"
#include "node/node_faults.h"

#define NODES      2u
#define TEXT_MAX   4096u
#define ROUNDS_MAX 4096u

static struct fault_rules rules;
static struct forwarder forwarder;
static struct drive_node nodes[NODES];
static struct node_faults faults;
static uint64_t now_ns;

static void check_frame(const struct can_msg *frame)
{
    FUZZ_CHECK(frame->id <= CAN_ID_MAX && frame->len <= CAN_DATA_MAX);
}

static void from_forwarder(void *context, enum fault_side to, const struct can_msg *frame)
{
    (void)context;
    FUZZ_CHECK(to == FAULT_SIDE_CONTROLLER || to == FAULT_SIDE_DRIVES);
    check_frame(frame);
}

static void noted(void *context, const struct fault_trigger *trigger, enum fault_side from,
                  const struct can_msg *frame, bool on)
{
    (void)context;
    (void)from;
    (void)frame;
    (void)on;
    FUZZ_CHECK(trigger->rule->line > 0u);
}

static void from_drive(void *context, const struct can_msg *frame)
{
    (void)context;
    check_frame(frame);
}

static void noted_by_drive(const struct fault_rule *rule, uint64_t at_ns, int64_t tick, bool on)
{
    (void)tick;
    (void)on;
    FUZZ_CHECK(rule->line > 0u && at_ns > 0u);
}

static bool parse(struct fuzz_input *in)
{
    static char text[TEXT_MAX];
    char reason[320] = "";
    size_t length = 0;
    uint8_t byte = fuzz_byte(in);
    while (byte != 0u && length < sizeof text) {
        text[length++] = (char)byte;
        byte = fuzz_byte(in);
    }
    const int result = fault_rules_parse(&rules, text, length, reason, sizeof reason);
    FUZZ_CHECK(result == 0 || (reason[0] != '\0' && strchr(reason, '\n') == NULL));
    FUZZ_CHECK(rules.count <= FAULT_RULES_MAX);
    return result == 0;
}

static void take(struct fuzz_input *in, uint8_t what)
{
    struct can_msg frame;
    fuzz_frame(in, &frame);
    if ((what & 2u) != 0u) { /* what rules and ticks go by */
        static const uint16_t usual[] = {0x080, 0x202, 0x203, 0x182, 0x183, 0x602, 0x582, 0x702};
        frame.id = usual[(what >> 2) & 7u];
    }
    const enum fault_side from = (what & 1u) != 0u ? FAULT_SIDE_CONTROLLER : FAULT_SIDE_DRIVES;
    forwarder_receive(&forwarder, from, &frame, now_ns);
    node_faults_receive(&faults, &frame, now_ns);
    for (unsigned i = 0; i < NODES; ++i) {
        drive_node_receive(&nodes[i], &frame);
    }
}

static void pass_time(uint32_t us)
{
    const uint64_t end_ns = now_ns + 1000ull * us;
    unsigned rounds = 0;
    while (forwarder_due_ns(&forwarder) <= end_ns) {
        const uint64_t due_ns = forwarder_due_ns(&forwarder);
        FUZZ_CHECK(++rounds < ROUNDS_MAX);
        now_ns = due_ns > now_ns ? due_ns : now_ns;
        forwarder_process(&forwarder, now_ns);
    }
    now_ns = end_ns;
    node_faults_process(&faults, now_ns);
    for (unsigned i = 0; i < NODES; ++i) {
        drive_node_process(&nodes[i], us);
    }
}

static void harness(struct fuzz_input *in)
{
    const struct drive_node_port port = {from_drive, NULL};
    const struct forwarder_port sides = {from_forwarder, noted, NULL};
    memset(&rules, 0, sizeof rules);
    now_ns = 1000000000u;
    if (!parse(in)) {
        return;
    }
    FUZZ_CHECK(drive_node_init(&nodes[0], 2, &drive_bench_config, 0, port) == 0);
    FUZZ_CHECK(drive_node_init(&nodes[1], 3, &drive_bench_config, 0, port) == 0);
    forwarder_init(&forwarder, &rules, sides);
    node_faults_init(&faults, &rules, nodes, NODES, noted_by_drive);
    while (fuzz_left(in)) {
        const uint8_t what = fuzz_byte(in);
        if (what < 0x40u) {
            pass_time(what * 500u);
        } else {
            take(in, what);
        }
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    return fuzz_run(harness, data, size);
}
