/* SPDX-License-Identifier: MIT */
/*
 * commands: executes the commands of the operator, which are written to objects 0x2001 and 0x2056. Called by
 * app/objects and app/controller. Changes the controller's state.
 *
 * Main loop: objects.c calls commands_execute for each write of 0x2001 and commands_start for each of 0x2056,
 * controller.c calls commands_execute at shut-down. While a chunk (a part of a streamed job) is checked, controller.c
 * calls commands_execute_urgent. Receive interrupt: controller.c calls command_urgent_request.
 */
#ifndef APP_COMMANDS_H
#define APP_COMMANDS_H

#include "app/controller_state.h"

/* Values of object 0x2001. */
enum command {
    COMMAND_ENABLE = 1,     /* drives on; nothing moves */
    COMMAND_START = 2,      /* the open job, else the active program, from its start */
    COMMAND_STOP = 3,       /* controlled stop on the path: final */
    COMMAND_DISABLE = 4,    /* drives off */
    COMMAND_RESET = 5,      /* out of a fault; in state off: configures the drives again */
    COMMAND_HOLD = 6,       /* feed hold, which a resume ends */
    COMMAND_RESUME = 7,     /* goes on after a hold or a program stop */
    COMMAND_START_FROM = 8, /* the active program at the arc length of object 0x2011 */
    COMMAND_QUICK_STOP = 9, /* each drive brakes by its own ramp, then off */
    COMMAND_HOME = 10,      /* homes the axes that have a homing method */
};

/* Object 0x2057 sub 2: a start is not refused for stop commands that the host does not know of. */
#define STOP_COMMANDS_ANY UINT32_MAX

/* What a start names (object 0x2056): another client may have replaced it since the host last read it. */
enum start_name {
    START_ANY,     /* nothing: the open job, else the active program */
    START_PROGRAM, /* the active program by its CRC-32 */
    START_JOB,     /* the open job by its number */
};

/* Whether a command is executed at once, even while another SDO client has a transfer open, or a chunk is being
 * checked: hold, stop and quick stop. Pure. */
static inline bool command_is_urgent(uint8_t number)
{
    return number == (uint8_t)COMMAND_STOP || number == (uint8_t)COMMAND_HOLD ||
           number == (uint8_t)COMMAND_QUICK_STOP;
}

/* Whether a frame is an SDO request to this node for an urgent command: an expedited write of one byte. Pure. */
bool command_urgent_request(const struct can_msg *frame, uint8_t node);

/* Executes the urgent commands of a set: bit n stands for command n. The most severe one is executed last, so that it
 * prevails. The caller holds port_lock(). */
void commands_execute_urgent(struct machine *machine, uint16_t set);

/* Executes the command, or returns why it is refused. The result is also kept in controller->refusal. Takes port_lock()
 * itself. */
enum machine_refusal commands_execute(struct controller *controller, enum command command);

/* The same for COMMAND_START and COMMAND_START_FROM: refused if not the motion of this name would be started. */
enum machine_refusal commands_start(struct controller *controller, enum command command,
                                    enum start_name name, uint32_t number);

#endif
