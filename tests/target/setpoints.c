/* SPDX-License-Identifier: MIT */
/*
 * An image that runs one program without a bus: KERNEL FILE [COMMANDS], KERNEL 0 fixed or 1 float. The program image
 * lies in the store (the emulator puts it there); the setpoints of all its ticks, i32 x and y, go to FILE on the host. So
 * every target can be asked for its bits, however little memory it has. What is run is what the controller's tick runs.
 *
 * COMMANDS is a file of pairs of u32, in order: before this tick (0 is the first), this override in per cent, or one of
 * the commands below. A hold that nothing ends lasts until the last command; then the run is over.
 */
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "app/machine/config.h"
#include "app/machine/motion.h"
#include "core/program.h"
#include "port/semihost/semihost.h"

enum { STATUS_USAGE = 2, STATUS_PROGRAM = 4, STATUS_FILE = 5, STATUS_MOTION = 6 };

enum { COMMAND_HOLD = 1000, COMMAND_RESUME, COMMAND_STOP };

#define STORE_SIZE    0x20000u /* at least as much on every target */
#define BATCH         64
#define COUNTS_PER_MM 1000000u /* 1 nm, as on the bus by default */

extern const uint8_t startup_store_base[];

static struct {
    int file;         /* negative when there are no more */
    uint32_t next[2]; /* its tick, and what */
} commands = {.file = -1};

static struct motion motion;
static struct program program;
static int32_t counts[BATCH][PLANE_AXES];

static void commands_next(void)
{
    if (semihost_read(commands.file, commands.next, sizeof commands.next) != 0) {
        (void)semihost_close(commands.file);
        commands.file = -1;
    }
}

static int commands_open(const char *path)
{
    commands.file = semihost_open(path, SEMIHOST_READ);
    if (commands.file < 0) {
        return -1;
    }
    commands_next();
    return 0;
}

static void commands_give(uint32_t k)
{
    while (commands.file >= 0 && commands.next[0] <= k) {
        switch (commands.next[1]) {
        case COMMAND_HOLD:
            motion_hold(&motion);
            break;
        case COMMAND_RESUME:
            motion_resume(&motion);
            break;
        case COMMAND_STOP:
            motion_stop(&motion);
            break;
        default:
            motion_override(&motion, commands.next[1]);
            break;
        }
        commands_next();
    }
}

/* The counted part: time in, two setpoints out. */
__attribute__((noinline)) static int tick(int32_t target_counts[PLANE_AXES])
{
    return motion_step(&motion, target_counts);
}

static int run(int file)
{
    size_t filled = 0;
    bool over = false;
    for (uint32_t k = 0; !over; k++) {
        commands_give(k);
        if (tick(counts[filled]) < 0) {
            return STATUS_MOTION;
        }
        filled++;
        over = motion_over(&motion) || (motion_held(&motion) && commands.file < 0);
        if (filled == BATCH || over) {
            if (semihost_write(file, counts, filled * sizeof counts[0]) != 0) {
                return STATUS_FILE;
            }
            filled = 0;
        }
    }
    return 0;
}

/* The words of the command line; how many there are, at most 3. */
static int split_line(char *words[3])
{
    static char line[384];
    int count = 0;
    if (semihost_command_line(line, sizeof line) != 0) {
        return 0;
    }
    for (char *at = line; at != NULL && count < 3; count++) {
        words[count] = at;
        at = strchr(at, ' ');
        if (at != NULL) {
            *at++ = '\0';
        }
    }
    return count;
}

int main(void)
{
    char *words[3];
    const int word_count = split_line(words);
    if (word_count < 2 || words[0][0] < '0' || words[0][0] > '1') {
        semihost_print("usage: KERNEL FILE [COMMANDS]\n");
        return STATUS_USAGE;
    }
    if (program_open(&program, startup_store_base, STORE_SIZE) != 0) {
        return STATUS_PROGRAM;
    }
    struct config config;
    memset(&config, 0, sizeof config);
    config.period_us = program.header.period_us;
    config.counts_per_mm = COUNTS_PER_MM;
    config.kernel = (uint8_t)(words[0][0] - '0');
    if (motion_begin(&motion, &program, &config) < 0) {
        return STATUS_PROGRAM;
    }
    const int file = semihost_open(words[1], SEMIHOST_WRITE);
    if (file < 0 || (word_count > 2 && commands_open(words[2]) != 0)) {
        return STATUS_FILE;
    }
    const int status = run(file);
    return semihost_close(file) == 0 ? status : STATUS_FILE;
}
