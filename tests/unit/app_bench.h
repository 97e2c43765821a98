/* SPDX-License-Identifier: MIT */
/*
 * app_bench: a whole controller on the fake port, with two fake drives, optionally an I/O module, and an SDO client as
 * host, on a bus without delays. Used by the tests of firmware/app (test_app_*.c). Changes the bench that it is given
 * and the one fake port; ends the running test on a failure. One thread; no I/O.
 */
#ifndef TESTS_UNIT_APP_BENCH_H
#define TESTS_UNIT_APP_BENCH_H

#include <stdint.h>

#include "app/controller.h"
#include "canopen/sdo_client.h"
#include "fake_drive.h"
#include "node/io_module.h"

#define BENCH_DRIVES  2u
#define BENCH_TARGETS 8192u /* setpoints recorded for each axis */

struct app_bench {
    struct controller controller;
    struct fake_drive drives[BENCH_DRIVES];
    struct io_module module; /* id 0: there is none */
    bool module_dead;        /* it receives and sends nothing */
    struct sdo_client host;
    uint32_t ticks;
    uint32_t frames;                   /* seen on the bus */
    uint16_t emergency;                /* code of the controller's last EMCY */
    uint32_t starts;                   /* NMT start commands seen */
    uint32_t beats;                    /* heartbeats of the controller seen, not its boot-up */
    int32_t targets[2][BENCH_TARGETS]; /* setpoints sent while a program ran, by axis */
    uint32_t recorded;
    /* true: the host does not confirm the configuration. false: it confirms it before each command */
    bool unconfirmed;
};

/* Controller and drives at power-on; drives stand at the positions. */
void app_bench_init(struct app_bench *bench, int32_t x_counts, int32_t y_counts);

/* An I/O module of this node is on the bus. */
void app_bench_add_module(struct app_bench *bench, uint8_t node);

/* The power of the controller goes off and on; drives, the store and the recorded counts stay. */
void app_bench_power_cycle(struct app_bench *bench);

/* One bus period: tick, answers, main loop. */
void app_bench_period(struct app_bench *bench);
void app_bench_period_without_main_loop(struct app_bench *bench); /* without the main loop */
void app_bench_periods(struct app_bench *bench, uint32_t count);

/* Periods until the state; fails the test when it takes more than `most`. Returns how many. */
uint32_t app_bench_until(struct app_bench *bench, enum machine_state state, uint32_t most);

/* From boot: the drives are switched on and have stood still long enough for a start. */
void app_bench_make_ready(struct app_bench *bench);

/* Delivers all frames that are under way, and lets the main loop handle them. */
void app_bench_settle(struct app_bench *bench);

/* The host. Results: abort codes. */
uint32_t app_bench_write(struct app_bench *bench, uint16_t index, uint8_t sub, uint64_t value,
                         uint8_t size);
uint32_t app_bench_command(struct app_bench *bench, unsigned command);
uint32_t app_bench_upload(struct app_bench *bench, const uint8_t *image, uint32_t size);
/* The same to 0x2060 sub 1. */
uint32_t app_bench_chunk(struct app_bench *bench, const uint8_t *bytes, uint32_t size);
/* Fails the test when the object cannot be read. */
int64_t app_bench_read(struct app_bench *bench, uint16_t index, uint8_t sub);

#endif
