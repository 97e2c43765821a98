/* SPDX-License-Identifier: MIT */
/*
 * An image that runs programs without a bus: KERNEL FILE [COMMANDS [TIMES]], KERNEL 0 fixed or 1 float. The store
 * (which the emulator fills) holds one program image, or several one after the other; the setpoints of all ticks of all
 * of them, i32 of all path axes, go to FILE on the host. So every target can be asked for its bits, however little
 * memory it has. What is run is what the controller's tick runs.
 *
 * COMMANDS is a file (commands.h) that each of the programs is run with. A hold that nothing ends lasts until the last
 * command; then the run of that program is over. COMMANDS is - for none. TIMES gets a u32 for each tick: what it took
 * by the core's own clock (clock.h). Run on emulated boards and as a process by tests/system/test_target_bits.py and by
 * `make count`; reads and writes files of the host by semihosting.
 */
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "app/machine/config.h"
#include "app/machine/motion.h"
#include "clock.h"
#include "commands.h"
#include "core/program.h"
#include "port/semihost/semihost.h"
#include "table.h"

enum { STATUS_USAGE = 2, STATUS_PROGRAM = 4, STATUS_FILE = 5, STATUS_MOTION = 6, STATUS_TABLE = 7 };
enum { WORD_KERNEL, WORD_FILE, WORD_COMMANDS, WORD_TIMES, WORD_COUNT };

#define STORE_SIZE    TABLE_AT /* at least as much on every target */
#define BATCH         64
#define COUNTS_PER_MM 1000000u /* 1 nm, as on the bus by default */

extern const uint8_t startup_store_base[];

static struct motion motion;
static struct program program;
static struct commands commands;
static int32_t counts[BATCH * AXES_MAX]; /* of each tick as many as the program has path axes */
static uint32_t times[BATCH];
static int times_file = -1;

/* The counted part: time in, the setpoints of all axes out. */
__attribute__((noinline)) static int tick(int32_t *target_counts)
{
    return motion_step(&motion, target_counts);
}

/* A tick between two readings of the clock. */
static int timed_tick(size_t slot)
{
    const uint32_t before = clock_now();
    const int result = tick(&counts[slot * motion_axis_count(&motion)]);
    times[slot] = (clock_now() - before) & CLOCK_MASK;
    return result;
}

static int write_batch(int file, size_t filled)
{
    if (times_file >= 0 && semihost_write(times_file, times, filled * sizeof times[0]) != 0) {
        return -1;
    }
    return semihost_write(file, counts, filled * motion_axis_count(&motion) * sizeof counts[0]);
}

static int run(int file)
{
    size_t filled = 0;
    bool over = false;
    for (uint32_t k = 0; !over; k++) {
        commands_give(&commands, k, &motion);
        if (timed_tick(filled) < 0) {
            return STATUS_MOTION;
        }
        filled++;
        over = motion_over(&motion) || (motion_held(&motion) && !commands.more);
        if (filled == BATCH || over) {
            if (write_batch(file, filled) != 0) {
                return STATUS_FILE;
            }
            filled = 0;
        }
    }
    return 0;
}

static int run_image(const uint8_t *image, uint32_t size, uint8_t kernel, int file)
{
    struct config config;
    if (program_open(&program, image, size) != 0) {
        return STATUS_PROGRAM;
    }
    if (table_make(&program, kernel) != 0) {
        return STATUS_TABLE;
    }
    memset(&config, 0, sizeof config);
    config.period_us = program.header.period_us;
    config.counts_per_mm = COUNTS_PER_MM;
    config.kernel = kernel;
    if (motion_begin(&motion, &program, &config) < 0) {
        return STATUS_PROGRAM;
    }
    return run(file);
}

/* At least one; after the last one there is no further "HDGP". */
static int run_all(char *words[WORD_COUNT], int file)
{
    uint32_t done = 0;
    int status = 0;
    do {
        if (words[WORD_COMMANDS] != NULL && words[WORD_COMMANDS][0] != '-' &&
            commands_open(&commands, words[WORD_COMMANDS]) != 0) {
            return STATUS_FILE;
        }
        status = run_image(startup_store_base + done, STORE_SIZE - done,
                           (uint8_t)(words[WORD_KERNEL][0] - '0'), file);
        commands_close(&commands);
        done += program.header.image_size;
    } while (status == 0 && STORE_SIZE - done >= PROGRAM_HEADER_SIZE &&
             memcmp(startup_store_base + done, "HDGP", 4) == 0);
    return status;
}

/* The words of the command line; NULL for those that are not there. */
static void split_line(char *words[WORD_COUNT])
{
    static char line[384];
    char *at = semihost_command_line(line, sizeof line) == 0 ? line : NULL;
    for (int i = 0; i < WORD_COUNT; i++) {
        words[i] = at;
        at = at == NULL ? NULL : strchr(at, ' ');
        if (at != NULL) {
            *at++ = '\0';
        }
    }
}

int main(void)
{
    char *words[WORD_COUNT];
    split_line(words);
    if (words[WORD_FILE] == NULL || words[WORD_KERNEL][0] < '0' || words[WORD_KERNEL][0] > '2') {
        semihost_print("usage: KERNEL FILE [COMMANDS [TIMES]]\n");
        return STATUS_USAGE;
    }
    const int file = semihost_open(words[WORD_FILE], SEMIHOST_WRITE);
    if (file < 0) {
        return STATUS_FILE;
    }
    if (words[WORD_TIMES] != NULL) {
        times_file = semihost_open(words[WORD_TIMES], SEMIHOST_WRITE);
        if (times_file < 0) {
            return STATUS_FILE;
        }
    }
    clock_begin();
    const int status = run_all(words, file);
    if (times_file >= 0 && semihost_close(times_file) != 0) {
        return STATUS_FILE;
    }
    return semihost_close(file) == 0 ? status : STATUS_FILE;
}
