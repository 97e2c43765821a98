/* SPDX-License-Identifier: MIT */
/*
 * An image that runs the whole tick of the controller, with two drives that follow unless trouble.h says otherwise, on
 * a port that is only memory: to count what the timer interrupt costs on every core, also where no emulated board has a
 * CAN bus. The words are those of setpoints.c, KERNEL FILE COMMANDS; FILE gets a u32 for each counted tick: what it
 * took by the core's own clock (clock.h). The store holds one program image or several. A FILE of a name that trouble.h
 * has is not written: it makes the drives misbehave, in every program.
 *
 * Run on emulated boards by `make count` and by the tests of the counts; reads and writes files of the host by
 * semihosting.
 *
 * What a real port adds: its own handler, and writing a frame into the controller's registers instead of memory.
 */
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "app/machine/machine.h"
#include "app/tick.h"
#include "clock.h"
#include "commands.h"
#include "core/program.h"
#include "port/port.h"
#include "port/semihost/semihost.h"
#include "table.h"
#include "trouble.h"

enum { STATUS_USAGE = 2, STATUS_PROGRAM = 4, STATUS_FILE = 5, STATUS_STATE = 6 };
enum { DRIVES = 2, FRAMES = 8, LONGEST_WAIT_TICKS = 1000, BATCH = 64 };
enum { WORD_KERNEL, WORD_FILE, WORD_COMMANDS, WORD_COUNT };

/* Statuswords with voltage, remote and, in Operation enabled, "follows" (CiA 402). */
enum { SWITCH_ON_DISABLED = 0x250, READY = 0x231, SWITCHED_ON = 0x233, ENABLED = 0x1237 };
enum { FOLLOWING_ERROR = 0x2000 };

#define STORE_SIZE    TABLE_AT
#define COUNTS_PER_MM 1000000u

extern const uint8_t startup_store_base[];

static struct program program;
static struct motion prepared;
static struct machine machine;
static struct tick tick;
static struct commands commands;
static struct trouble trouble;
static uint32_t path_ticks; /* of this program */
static struct {
    struct can_msg frames[FRAMES];
    uint32_t count;
    uint32_t time_ns;
    uint32_t time_us; /* wraps by itself, as port.h has it */
} bus;
static struct {
    uint32_t took[BATCH];
    uint32_t count;
    int file; /* -1: none */
    bool failed;
} times = {.file = -1};
static struct {
    uint16_t statusword;
    int32_t latched_counts; /* reached at the next SYNC */
    int32_t position_counts;
} drives[DRIVES];

int port_can_send(const struct can_msg *message)
{
    bus.frames[bus.count++ % FRAMES] = *message;
    return 0;
}

bool port_can_delivered(void)
{
    return true;
}

uint32_t port_time_ns(void)
{
    return bus.time_ns;
}

void port_tick_urgent(bool urgent)
{
    (void)urgent;
}

enum port_timing port_timing(void)
{
    return PORT_TIMING_KEPT;
}

void port_tick_await(uint32_t guard_us, bool hurry)
{
    (void)guard_us;
    (void)hurry;
}

/* The counted part: what a port's timer interrupt calls. */
__attribute__((noinline)) static void isr(uint32_t now_us)
{
    tick_run(&tick, now_us, 0);
}

static void write_times(void)
{
    const uint32_t size = times.count * (uint32_t)sizeof times.took[0];
    times.failed = times.failed || semihost_write(times.file, times.took, size) != 0;
    times.count = 0;
}

/* A tick between two readings of the clock; inlined, its argument would be computed between them. */
__attribute__((noinline)) static void timed_isr(uint32_t now_us)
{
    const uint32_t before = clock_now();
    isr(now_us);
    const uint32_t took = (clock_now() - before) & CLOCK_MASK;
    if (times.file >= 0) {
        times.took[times.count++] = took;
        if (times.count == BATCH) {
            write_times();
        }
    }
}

/* The other counted part: what its receive interrupt calls. */
__attribute__((noinline)) static void receive(const struct can_msg *answer, uint32_t now_us)
{
    struct pdo_actual actual;
    const int node = pdo_decode_actual(answer, &actual);
    if (node > 0) {
        (void)machine_receive(&machine, (uint8_t)node, &actual, now_us);
    }
}

static uint16_t carry_out(uint16_t controlword)
{
    switch (controlword & 0xFu) {
    case 0x6u:
        return READY;
    case 0x7u:
        return SWITCHED_ON;
    case 0xFu:
        return ENABLED;
    default:
        return SWITCH_ON_DISABLED;
    }
}

static bool answers(uint32_t drive)
{
    const bool lost = drive == DRIVES - 1u && path_ticks >= trouble.lost_from;
    return !lost && (!trouble.silent || machine.statistics.syncs % 3u != 0u);
}

/* Drives answer the SYNC of this tick and take the setpoints that followed it. */
static void drives_answer(uint32_t now_us)
{
    for (uint32_t i = 0; i < DRIVES; i++) {
        const struct axis *axis = &machine.axes[i];
        struct can_msg answer = {.id = 0x180u + axis->node, .len = 6};
        drives[i].position_counts = drives[i].latched_counts;
        drives[i].latched_counts = axis->target_sent_counts;
        answer.data[0] = (uint8_t)drives[i].statusword;
        answer.data[1] = (uint8_t)(drives[i].statusword >> 8);
        for (uint32_t k = 0; k < 4; k++) {
            answer.data[2 + k] = (uint8_t)((uint32_t)drives[i].position_counts >> (8 * k));
        }
        drives[i].statusword = carry_out(axis->controlword);
        if (path_ticks >= trouble.error_from) {
            drives[i].statusword |= FOLLOWING_ERROR;
        }
        if (answers(i)) {
            receive(&answer, now_us);
        }
    }
}

static void period(void)
{
    const uint32_t period_us = machine.config.period_us;
    bus.time_ns += period_us * 1000u;
    bus.time_us += period_us;
    machine_note_main_loop(&machine);
    if (machine_on_path(&machine)) {
        timed_isr(bus.time_us);
    } else {
        tick_run(&tick, bus.time_us, 0);
    }
    drives_answer(bus.time_us);
}

static bool wait_for(enum machine_state state)
{
    for (uint32_t k = 0; k < LONGEST_WAIT_TICKS && machine.state != state; k++) {
        period();
    }
    return machine.state == state;
}

static bool switch_on(const struct config *config)
{
    machine_init(&machine, config);
    tick_init(&tick, &machine);
    machine_drives_configured(&machine, false);
    if (!wait_for(MACHINE_OFF) || machine_enable(&machine) != MACHINE_ACCEPTED ||
        !wait_for(MACHINE_READY)) {
        return false;
    }
    for (uint32_t k = 0; k < LONGEST_WAIT_TICKS && machine_busy(&machine); k++) {
        period();
    }
    return true;
}

static int run_image(const uint8_t *image, uint32_t size, uint8_t kernel)
{
    const int32_t anywhere[AXES_MAX] = {0};
    struct config config;
    if (program_open(&program, image, size) != 0) {
        return STATUS_PROGRAM;
    }
    if (table_make(&program, kernel) != 0) {
        return STATUS_PROGRAM;
    }
    memset(&config, 0, sizeof config);
    config.period_us = program.header.period_us;
    config.counts_per_mm = COUNTS_PER_MM;
    config.kernel = kernel;
    config.start_tolerance_counts = UINT32_MAX;
    config.axis_count = DRIVES;
    config.node[0] = 2;
    config.node[1] = 3;
    config.missed_max = 1;
    for (unsigned i = 0; i < DRIVES; ++i) { /* compared, and never outside */
        config.deviation_counts[i] = UINT32_MAX;
        config.deviation_syncs[i] = CONFIG_DEVIATION_SYNCS;
    }
    if (motion_begin(&prepared, &program, &config) < 0) {
        return STATUS_PROGRAM;
    }
    if (!switch_on(&config) || machine_start(&machine, &prepared, anywhere) != MACHINE_ACCEPTED) {
        return STATUS_STATE;
    }
    for (path_ticks = 0; machine_on_path(&machine); path_ticks++) {
        commands_give(&commands, path_ticks, &machine.motion);
        period();
        if (motion_held(&machine.motion) && !commands.more) {
            break;
        }
    }
    path_ticks = 0;
    return (machine.state == MACHINE_FAULT) == trouble_is_fatal(&trouble) ? 0 : STATUS_STATE;
}

static int run_all(const char *commands_path, uint8_t kernel)
{
    uint32_t done = 0;
    int status = 0;
    do {
        if (commands_path != NULL && commands_open(&commands, commands_path) != 0) {
            return STATUS_FILE;
        }
        status = run_image(startup_store_base + done, STORE_SIZE - done, kernel);
        commands_close(&commands);
        done += program.header.image_size;
    } while (status == 0 && STORE_SIZE - done >= PROGRAM_HEADER_SIZE &&
             memcmp(startup_store_base + done, "HDGP", 4) == 0);
    return status;
}

/* False: there are fewer words than these. */
static bool split_line(char *words[WORD_COUNT])
{
    static char line[384];
    char *at = semihost_command_line(line, sizeof line) == 0 ? line : NULL;
    for (int i = 0; i < WORD_COUNT && at != NULL; i++) {
        words[i] = at;
        at = strchr(at, ' ');
        if (at != NULL) {
            *at++ = '\0';
        } else if (i + 1 < WORD_COUNT) {
            return false;
        }
    }
    return words[0] != NULL;
}

static int run(char *words[WORD_COUNT])
{
    const bool written = !trouble_read(&trouble, words[WORD_FILE]);
    times.file = written ? semihost_open(words[WORD_FILE], SEMIHOST_WRITE) : -1;
    if (written && times.file < 0) {
        return STATUS_FILE;
    }
    clock_begin();
    const char *path = words[WORD_COMMANDS][0] == '-' ? NULL : words[WORD_COMMANDS];
    const int status = run_all(path, (uint8_t)(words[WORD_KERNEL][0] - '0'));
    if (written) {
        write_times();
        times.failed = semihost_close(times.file) != 0 || times.failed;
    }
    return status == 0 && times.failed ? STATUS_FILE : status;
}

int main(void)
{
    char *words[WORD_COUNT] = {NULL};
    if (!split_line(words) || words[WORD_KERNEL][0] < '0' || words[WORD_KERNEL][0] > '1') {
        semihost_print("usage: KERNEL FILE COMMANDS\n");
        return STATUS_USAGE;
    }
    return run(words);
}
