/* SPDX-License-Identifier: MIT */
/*
 * An image that runs one program without a bus: KERNEL FILE, KERNEL 0 fixed or 1 float. The program image lies in the
 * store (the emulator puts it there); the setpoints of all its ticks, i32 x and y, go to FILE on the host. So every
 * target can be asked for its bits, however little memory it has. What is run is what the controller's tick runs.
 */
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "app/machine/config.h"
#include "app/machine/motion.h"
#include "core/program.h"
#include "port/semihost/semihost.h"

enum { STATUS_USAGE = 2, STATUS_PROGRAM = 4, STATUS_FILE = 5, STATUS_MOTION = 6 };

#define STORE_SIZE    0x20000u /* at least as much on every target */
#define BATCH         64
#define COUNTS_PER_MM 1000000u /* 1 nm, as on the bus by default */

extern const uint8_t startup_store_base[];

static struct motion motion;
static struct program program;
static int32_t counts[BATCH][PLANE_AXES];

/* The counted part: time in, two setpoints out. */
__attribute__((noinline)) static int tick(int32_t target_counts[PLANE_AXES])
{
    return motion_step(&motion, target_counts);
}

static int run(int file)
{
    size_t filled = 0;
    bool over = false;
    while (!over) {
        if (tick(counts[filled]) < 0) {
            return STATUS_MOTION;
        }
        filled++;
        over = motion_over(&motion);
        if (filled == BATCH || over) {
            if (semihost_write(file, counts, filled * sizeof counts[0]) != 0) {
                return STATUS_FILE;
            }
            filled = 0;
        }
    }
    return 0;
}

int main(void)
{
    char line[160];
    if (semihost_command_line(line, sizeof line) != 0 || line[0] < '0' || line[0] > '1' ||
        line[1] != ' ') {
        semihost_print("usage: KERNEL FILE\n");
        return STATUS_USAGE;
    }
    if (program_open(&program, startup_store_base, STORE_SIZE) != 0) {
        return STATUS_PROGRAM;
    }
    struct config config;
    memset(&config, 0, sizeof config);
    config.period_us = program.header.period_us;
    config.counts_per_mm = COUNTS_PER_MM;
    config.kernel = (uint8_t)(line[0] - '0');
    if (motion_begin(&motion, &program, &config) < 0) {
        return STATUS_PROGRAM;
    }
    const int file = semihost_open(line + 2, SEMIHOST_WRITE);
    if (file < 0) {
        return STATUS_FILE;
    }
    const int status = run(file);
    return semihost_close(file) == 0 ? status : STATUS_FILE;
}
