/* SPDX-License-Identifier: MIT */
/* commands: object 0x2001. Mainline. */
#ifndef APP_COMMANDS_H
#define APP_COMMANDS_H

#include "app/controller.h"

enum command {
    COMMAND_ENABLE = 1,
    COMMAND_START = 2,
    COMMAND_STOP = 3,
    COMMAND_DISABLE = 4,
    COMMAND_RESET = 5,
    COMMAND_HOLD = 6,
    COMMAND_RESUME = 7,
    COMMAND_START_FROM = 8, /* at the arc length of object 0x2011 */
    COMMAND_QUICK_STOP = 9,
    COMMAND_HOME = 10,
};

/* Does it, or says why not; the answer is also kept in controller->refusal. */
enum machine_refusal commands_execute(struct controller *controller, enum command command);

#endif
