/* SPDX-License-Identifier: MIT */
/*
 * Fuzz harness of node/drive_node.h: a simulated drive receives any frames at any time. What it sends are frames, and
 * after a reset its SDO server answers.
 *
 * Input: one byte selects what happens next.
 *
 * Run by `make fuzz` with libFuzzer, and on its corpus by `make test` and `make unit` (replay.c). No I/O, except that a
 * broken rule is printed and aborts the process.
 */
#include <string.h>

#include "canopen/cob.h"
#include "drive_bench.h"
#include "fuzz.h"

#define SYNCS_MAX 400u

static struct {
    struct drive_node node;
    uint8_t counter;
    uint32_t syncs;
    bool answered;
} self;

static void sent(void *context, const struct can_msg *frame)
{
    (void)context;
    FUZZ_CHECK(frame->id <= CAN_ID_MAX && frame->len <= CAN_DATA_MAX);
    self.answered = self.answered || frame->id == COB_SDO_RESPONSE + DRIVE_BENCH_ID;
}

static void receive(uint32_t id, const uint8_t *data, uint8_t length)
{
    struct can_msg frame;
    cob_frame(&frame, (uint16_t)id, length);
    memcpy(frame.data, data, length);
    drive_node_receive(&self.node, &frame);
}

static void sync(uint8_t step)
{
    if (++self.syncs <= SYNCS_MAX) {
        self.counter = (uint8_t)(1u + (self.counter + step - 1u) % 240u);
        receive(COB_SYNC, &self.counter, 1);
    }
}

static void follow(struct fuzz_input *in, uint8_t syncs)
{
    uint8_t setpoint[6] = {0x0F};
    const uint8_t word = fuzz_byte(in);
    setpoint[0] = (word & 0x80u) != 0u ? word & 0x7Fu : 0x0Fu;
    setpoint[1] = (word & 0xC0u) == 0xC0u ? fuzz_byte(in) : 0u;
    cob_put(setpoint + 2, 1000000u + fuzz_number(in, 3), 4);
    for (uint8_t i = 0; i < syncs; ++i) {
        receive(COB_RPDO1 + DRIVE_BENCH_ID, setpoint, sizeof setpoint);
        sync(1);
    }
}

static void write(struct fuzz_input *in)
{
    const struct od_table *table = &od_drive_table;
    const struct od_entry *entry = &table->entries[fuzz_number(in, 2) % table->entry_count];
    uint8_t request[8] = {0};
    request[0] = (uint8_t)(0x23u | ((4u - (entry->size & 3u)) & 3u) << 2);
    cob_put(request + 1, entry->index, 2);
    request[3] = entry->sub;
    fuzz_bytes(in, request + 4, 4);
    receive(COB_SDO_REQUEST + DRIVE_BENCH_ID, request, sizeof request);
}

static void step(struct fuzz_input *in)
{
    const uint8_t what = fuzz_byte(in);
    struct can_msg frame;
    if (what < 0x40u) {
        follow(in, what & 15u);
    } else if (what < 0x60u) {
        drive_node_process(&self.node, (what - 0x40u) * 1000u);
    } else if (what < 0xA0u) {
        write(in);
    } else if (what < 0xB0u) {
        sync(fuzz_byte(in));
    } else if (what < 0xC0u) {
        const uint8_t nmt[2] = {(uint8_t)(1u + (what & 1u)), DRIVE_BENCH_ID};
        const uint8_t other[2] = {(uint8_t)(128u + (what & 1u)), 0};
        receive(COB_NMT, (what & 8u) != 0u ? other : nmt, 2);
    } else if (what < 0xD0u) {
        uint8_t request[8];
        fuzz_bytes(in, request, sizeof request);
        receive(COB_SDO_REQUEST + DRIVE_BENCH_ID, request, sizeof request);
    } else {
        fuzz_frame(in, &frame);
        drive_node_receive(&self.node, &frame);
    }
}

static void answers(void)
{
    const uint8_t reset[2] = {129, DRIVE_BENCH_ID};
    const uint8_t request[8] = {0x40, 0x00, 0x10, 0};
    receive(COB_NMT, reset, sizeof reset);
    drive_node_process(&self.node, 0);
    self.answered = false;
    receive(COB_SDO_REQUEST + DRIVE_BENCH_ID, request, sizeof request);
    drive_node_process(&self.node, 0);
    FUZZ_CHECK(self.answered);
}

static void harness(struct fuzz_input *in)
{
    const struct drive_node_port port = {sent, NULL};
    memset(&self, 0, sizeof self);
    FUZZ_CHECK(drive_node_init(&self.node, DRIVE_BENCH_ID, &drive_bench_config, 1000000, port) ==
               0);
    drive_node_process(&self.node, 0);
    const uint8_t start[2] = {1, DRIVE_BENCH_ID};
    receive(COB_NMT, start, sizeof start);
    while (fuzz_left(in)) {
        step(in);
    }
    answers();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    return fuzz_run(harness, data, size);
}
