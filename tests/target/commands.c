/* SPDX-License-Identifier: MIT */
/* Implements commands.h (see there): commands to a motion, read from a file. Part of the
 * images setpoints and isr; reads the file by semihosting. */
#include "commands.h"

#include "port/semihost/semihost.h"

static void read_next(struct commands *commands)
{
    if (semihost_read(commands->file, commands->next, sizeof commands->next) != 0) {
        commands_close(commands);
    }
}

int commands_open(struct commands *commands, const char *path)
{
    commands->file = semihost_open(path, SEMIHOST_READ);
    commands->more = commands->file >= 0;
    if (!commands->more) {
        return -1;
    }
    read_next(commands);
    return 0;
}

static void carry_out(uint32_t what, struct motion *motion)
{
    switch (what) {
    case COMMAND_HOLD:
        motion_hold(motion);
        break;
    case COMMAND_RESUME:
        motion_resume(motion);
        break;
    case COMMAND_STOP:
        motion_stop(motion);
        break;
    default:
        motion_override(motion, what);
        break;
    }
}

void commands_give(struct commands *commands, uint32_t k, struct motion *motion)
{
    while (commands->more && commands->next[0] <= k) {
        carry_out(commands->next[1], motion);
        read_next(commands);
    }
}

void commands_close(struct commands *commands)
{
    if (commands->more) {
        (void)semihost_close(commands->file);
        commands->more = false;
    }
}
