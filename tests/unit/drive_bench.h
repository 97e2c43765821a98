/* SPDX-License-Identifier: MIT */
/* drive_bench: one simulated drive on the bench: node 3, standing at 1 mm, NMT operational. What it sends is kept;
 * failures are Unity's. Used by the tests of sim/node, sim/plant and sim/offline, and by harnesses of tests/fuzz. One
 * thread; no I/O. */
#ifndef DRIVE_BENCH_H
#define DRIVE_BENCH_H

#include <stdint.h>

#include "node/drive_node.h"
#include "node/node_faults.h"

enum { DRIVE_BENCH_ID = 3, DRIVE_BENCH_SENT = 256 };

struct drive_bench {
    struct drive_node node;
    struct can_msg sent[DRIVE_BENCH_SENT]; /* since the last SYNC */
    int sent_count;
    uint8_t counter;
    int32_t target;
    uint16_t word;
};

extern struct drive_bench bench;

/* The paper's drive of the x axis, at 1 ms and a million counts in a mm. */
extern const struct drive_config drive_bench_config;

/* Power-on, boot-up, NMT start. */
void drive_bench_begin(void);
void drive_bench_begin_with(const struct drive_config *config);

void drive_bench_nmt(enum nmt_command command);

/* The newest frame `function + DRIVE_BENCH_ID` since the last SYNC; NULL: none. */
const struct can_msg *drive_bench_newest(uint32_t function);

/* RPDO1, kept and sent again with each drive_bench_run. */
void drive_bench_setpoint(uint16_t controlword, int32_t target);

/* The next SYNC. */
void drive_bench_sync(void);

/* So many periods: setpoint, SYNC, and 1 ms of wall time. */
void drive_bench_run(int periods);

/* To Operation enabled, the target where the axis stands. */
void drive_bench_enable(void);

/* Begins or ends an injected fault. */
void drive_bench_fault(struct fault_rule rule, bool on);

/* From the TPDOs of the last SYNC. */
uint16_t drive_bench_statusword(void);
int32_t drive_bench_position(void);
int16_t drive_bench_volts_mv(void);

/* Takes the waiting EMCYs; the last one has this code and error register. */
void drive_bench_expect_emcy(uint16_t code, uint8_t error_register);

/* As by SDO; write returns the abort code. */
uint32_t drive_bench_write(uint16_t index, uint8_t sub, int64_t value);
int64_t drive_bench_read(uint16_t index, uint8_t sub);

#endif
