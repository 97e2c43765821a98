/* SPDX-License-Identifier: MIT */
/* Implements app_bench.h (see there): a whole controller on the fake port, with two fake drives and an SDO client as
 * host, on a bus without delays. Part of the C tests; no I/O. */
#include "app_bench.h"

#include <string.h>

#include "app/commands.h"
#include "canopen/cob.h"
#include "canopen/pdo.h"
#include "canopen/sdo_abort.h"
#include "fake_port.h"
#include "unity.h"

#define HOST_TIMEOUT_US 2000000u

static void deliver(struct app_bench *bench, const struct can_msg *frame);

static void settle_in_wait(void *context)
{
    app_bench_settle(context);
}

static void watch(struct app_bench *bench, const struct can_msg *frame)
{
    struct emcy emcy;
    struct pdo_setpoint setpoint;
    bench->frames++;
    if (emcy_decode(frame, &emcy) == bench->controller.node) {
        bench->emergency = emcy.code;
    }
    if (frame->id == COB_NMT && frame->data[0] == (uint8_t)NMT_START) {
        bench->starts++;
    }
    const int node = pdo_decode_setpoint(frame, &setpoint);
    if ((node == 2 || node == 3) && machine_moving(&bench->controller.machine) &&
        bench->recorded < BENCH_TARGETS) {
        bench->targets[node - 2][bench->recorded] = setpoint.target_counts;
        bench->recorded += node == 3 ? 1u : 0u;
    }
    bench->beats += frame->id == COB_HEARTBEAT + 1u && frame->data[0] != 0u ? 1u : 0u;
}

static void to_controller(struct app_bench *bench, const struct can_msg *frame)
{
    watch(bench, frame);
    fake_port_receive(frame);
}

static void to_drives(struct app_bench *bench, const struct can_msg *frame)
{
    for (uint32_t i = 0; i < BENCH_DRIVES; ++i) {
        struct can_msg answers[2];
        const int count = fake_drive_receive(&bench->drives[i], frame, answers);
        for (int k = 0; k < count; ++k) {
            to_controller(bench, &answers[k]);
        }
    }
}

static void to_module(struct app_bench *bench, const struct can_msg *frame)
{
    if (bench->module.id != 0u && !bench->module_dead) {
        io_module_receive(&bench->module, frame);
    }
}

static void from_module(void *context, const struct can_msg *frame)
{
    to_controller(context, frame);
}

void app_bench_add_module(struct app_bench *bench, uint8_t node)
{
    io_module_init(&bench->module, node, (struct drive_node_port){from_module, bench});
}

static void to_host(struct app_bench *bench, const struct can_msg *frame)
{
    struct can_msg out;
    if (sdo_client_receive(&bench->host, frame, &out)) {
        deliver(bench, &out);
    }
}

static void deliver(struct app_bench *bench, const struct can_msg *frame)
{
    to_drives(bench, frame);
    to_controller(bench, frame);
}

static bool poll_drives(struct app_bench *bench, uint32_t elapsed_us)
{
    bool any = false;
    for (uint32_t i = 0; i < BENCH_DRIVES; ++i) {
        struct can_msg frame;
        if (fake_drive_process(&bench->drives[i], elapsed_us, &frame) != 0) {
            to_controller(bench, &frame);
            any = true;
        }
    }
    return any;
}

static bool pass_frames(struct app_bench *bench)
{
    struct can_msg frame;
    bool any = false;
    while (fake_port_take(&frame)) {
        watch(bench, &frame);
        to_drives(bench, &frame);
        to_module(bench, &frame);
        to_host(bench, &frame);
        any = true;
    }
    return any;
}

void app_bench_settle(struct app_bench *bench)
{
    bool busy = true;
    while (busy) {
        busy = poll_drives(bench, 0);
        controller_poll(&bench->controller);
        busy = pass_frames(bench) || busy;
    }
}

static void power_on(struct app_bench *bench)
{
    controller_init(&bench->controller, 1);
    TEST_ASSERT_EQUAL_INT(0, controller_start(&bench->controller));
}

void app_bench_power_cycle(struct app_bench *bench)
{
    fake_port_keep_store();
    power_on(bench);
    sdo_client_init(&bench->host, HOST_TIMEOUT_US);
    fake_port_on_wait(settle_in_wait, bench);
}

void app_bench_init(struct app_bench *bench, int32_t x_counts, int32_t y_counts)
{
    memset(bench, 0, sizeof *bench);
    fake_port_reset();
    power_on(bench);
    fake_drive_init(&bench->drives[0], 2, x_counts);
    fake_drive_init(&bench->drives[1], 3, y_counts);
    sdo_client_init(&bench->host, HOST_TIMEOUT_US);
    fake_port_on_wait(settle_in_wait, bench);
}

/* The drives' heartbeats, ten times a second as configured. */
static void beat(struct app_bench *bench)
{
    for (uint32_t i = 0; i < BENCH_DRIVES; ++i) {
        struct fake_drive *drive = &bench->drives[i];
        if (!drive->dead && !drive->silent_heart && drive->nmt.state != NMT_INITIALISING &&
            bench->ticks % DRIVE_HEARTBEAT_MS == 0u) {
            struct can_msg frame;
            cob_frame(&frame, COB_HEARTBEAT + drive->node, 1);
            frame.data[0] = (uint8_t)drive->nmt.state;
            to_controller(bench, &frame);
        }
    }
}

/* As a port does that waits for answers. */
void app_bench_period_without_main_loop(struct app_bench *bench)
{
    const bool guard_over = fake_port_awaited_us() > 0u && !fake_port_ready();
    fake_port_advance_us(guard_over ? fake_port_awaited_us() : bench->controller.config.period_us);
    fake_port_tick(0);
    (void)pass_frames(bench);
    beat(bench);
    if (bench->module.id != 0u && !bench->module_dead) {
        io_module_process(&bench->module, bench->controller.config.period_us);
    }
    bench->ticks++;
}

void app_bench_period(struct app_bench *bench)
{
    app_bench_period_without_main_loop(bench);
    app_bench_settle(bench);
}

void app_bench_periods(struct app_bench *bench, uint32_t count)
{
    for (uint32_t i = 0; i < count; ++i) {
        app_bench_period(bench);
    }
}

uint32_t app_bench_until(struct app_bench *bench, enum machine_state state, uint32_t most)
{
    uint32_t count = 0;
    while (bench->controller.machine.state != state) {
        TEST_ASSERT_TRUE_MESSAGE(count < most, "the state is not reached");
        app_bench_period(bench);
        count++;
    }
    return count;
}

void app_bench_make_ready(struct app_bench *bench)
{
    (void)app_bench_until(bench, MACHINE_OFF, 1000);
    app_bench_periods(bench, 3);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, app_bench_command(bench, COMMAND_ENABLE));
    (void)app_bench_until(bench, MACHINE_READY, 100);
    app_bench_periods(bench, AXIS_STANDSTILL_SYNCS);
}

static uint32_t finish_transfer(struct app_bench *bench, int begun, const struct can_msg *request)
{
    TEST_ASSERT_EQUAL_INT(0, begun);
    deliver(bench, request);
    app_bench_settle(bench);
    TEST_ASSERT_NOT_EQUAL_INT(SDO_CLIENT_BUSY, bench->host.status);
    return bench->host.status == SDO_CLIENT_DONE ? SDO_OK : bench->host.abort_code;
}

uint32_t app_bench_write(struct app_bench *bench, uint16_t index, uint8_t sub, uint64_t value,
                         uint8_t size)
{
    struct can_msg out;
    const int begun = sdo_client_write_number(&bench->host, bench->controller.node, index, sub,
                                              value, size, &out);
    return finish_transfer(bench, begun, &out);
}

/* What 0x2050 sub 2 does, without frames: most tests are about something else. */
static void confirm(struct controller *controller)
{
    controller->configured = (struct configured){.known = true, .crc32 = controller->config.crc32};
}

uint32_t app_bench_command(struct app_bench *bench, unsigned command)
{
    if (!bench->unconfirmed) {
        confirm(&bench->controller);
    }
    return app_bench_write(bench, 0x2001, 0, command, 1);
}

static uint32_t download(struct app_bench *bench, uint16_t index, const uint8_t *bytes,
                         uint32_t size)
{
    struct can_msg out;
    const int begun =
        sdo_client_write(&bench->host, bench->controller.node, index, 1, bytes, size, &out);
    return finish_transfer(bench, begun, &out);
}

uint32_t app_bench_upload(struct app_bench *bench, const uint8_t *image, uint32_t size)
{
    return download(bench, 0x2000, image, size);
}

uint32_t app_bench_chunk(struct app_bench *bench, const uint8_t *bytes, uint32_t size)
{
    return download(bench, 0x2060, bytes, size);
}

int64_t app_bench_read(struct app_bench *bench, uint16_t index, uint8_t sub)
{
    struct can_msg out;
    const int begun =
        sdo_client_read_number(&bench->host, bench->controller.node, index, sub, &out);
    TEST_ASSERT_EQUAL_HEX32(SDO_OK, finish_transfer(bench, begun, &out));
    return sdo_client_signed(&bench->host);
}
