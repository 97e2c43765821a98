/* SPDX-License-Identifier: MIT */
/*
 * objects: the behaviour of the controller's object dictionary (controller.eds): values that are computed when they are
 * read, checks and effects of writes, commands, the program's image. Used by app/controller.c. Main loop. Writes change
 * the controller, the machine under the lock, the period of the tick and the stored parameters.
 *
 * Handlers are attached to entries in one table (objects.c): an object with behaviour needs its lines in the EDS file,
 * its handlers and a row in that table. Those of one axis are in objects_axis.c, those of the outputs in
 * objects_outputs.c, those of the program in objects_program.c, those of jobs in objects_stream.c. Objects of the
 * configuration are found by config_contains (app/machine/config.h).
 */
#ifndef APP_OBJECTS_H
#define APP_OBJECTS_H

#include "canopen/od.h"

/* Hooks of the dictionary; their context is the struct controller. Main loop.
 *   read     always SDO_OK
 *   write    SDO_ABORT_STATE when a command or change is not possible now, SDO_ABORT_VALUE when the value is not
 *            allowed, other codes by CiA 301. Commands are executed here.
 *   urgent   hold, stop and quick stop */
extern const struct od_hooks objects_hooks;

#endif
