/* SPDX-License-Identifier: MIT */
/*
 * drive_plan: the configuration of one drive as a list of operations on its dictionary, in order:
 * CiA 301 and CiA 402-2, docs/reference/protocol.md section 2.
 *
 *     drive_plan_begin(&plan, &config, axis, &facts);
 *     while (drive_plan_op(&plan, &op)) { do it; drive_plan_advance(&plan); }
 *
 * What the drive says of itself on the way (facts) decides what follows. Mainline.
 */
#ifndef APP_DRIVES_DRIVE_PLAN_H
#define APP_DRIVES_DRIVE_PLAN_H

#include <stdbool.h>
#include <stdint.h>

#include "app/drives/drive_pdo.h"
#include "app/drives/drive_properties.h"
#include "app/machine/config.h"

/* The drive's heartbeat, and for how long it may miss the controller's (sent each 100 ms; checking a
 * long program can keep the mainline from it for a second). */
#define DRIVE_HEARTBEAT_MS         100u
#define DRIVE_CONTROLLER_SILENT_MS 2000u

struct drive_plan {
    const struct config *config;
    struct drive_properties *facts;
    uint8_t axis;
    uint8_t row;
    uint8_t item; /* of the row, when it is a PDO */
};

/* `config` and `facts` must stay; the facts are forgotten. */
void drive_plan_begin(struct drive_plan *plan, const struct config *config, uint8_t axis,
                      struct drive_properties *facts);

/* The present operation; false at the end. */
bool drive_plan_op(struct drive_plan *plan, struct drive_op *op);

/* The present operation is done; a read has brought `value`. */
void drive_plan_advance(struct drive_plan *plan);

/* The drive refuses the present operation with the abort code: true when the plan can do without it, and has gone on. */
bool drive_plan_refused(struct drive_plan *plan, uint32_t abort_code);

#endif
