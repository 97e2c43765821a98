/* SPDX-License-Identifier: MIT */
/*
 * drive_configuration: the operations that configure one drive, or the I/O module, in their order: reads and writes of
 * its object dictionary (CiA 301, CiA 402-2, docs/reference/protocol.md section 3.1). The table in
 * drive_configuration.c has a row for each object or PDO. drive_boot executes the operations.
 *
 *     drive_configuration_begin(&configuration, &config, axis, &properties);
 *     while (drive_configuration_op(&configuration, &op)) { do it; drive_configuration_advance(&configuration); }
 *
 * Later operations depend on the properties that the drive reports in earlier ones. Used by app/controller,
 * app/drives/drive_boot and app/drives/drive_monitor. Changes its struct and the properties only. Main loop.
 */
#ifndef APP_DRIVES_DRIVE_CONFIGURATION_H
#define APP_DRIVES_DRIVE_CONFIGURATION_H

#include <stdbool.h>
#include <stdint.h>

#include "app/drives/drive_properties.h"
#include "app/machine/config.h"

/* The period of the drive's heartbeat, and the time after which it misses the controller's. The controller sends it
 * each 100 ms, but the check of a long program can delay it by a second. */
#define DRIVE_HEARTBEAT_MS          100u
#define DRIVE_CONTROLLER_TIMEOUT_MS 2000u

/* Drives, and the I/O module, where there is one. Pure. */
static inline uint8_t drive_configuration_nodes(const struct config *config)
{
    return (uint8_t)(config->axis_count + (config->outputs.node != 0u ? 1u : 0u));
}

/* Node of drive `i`, or of the I/O module, which comes after the drives. Pure. */
static inline uint8_t drive_configuration_node(const struct config *config, uint8_t i)
{
    return i < config->axis_count ? config->node[i] : config->outputs.node;
}

#define DRIVE_NODES (AXES_MAX + 1u)

/* Kinds of operation on a drive's dictionary. */
enum drive_op_kind {
    DRIVE_OP_NMT_PRE_OPERATIONAL, /* process data off while parameters change */
    DRIVE_OP_READ,                /* `masked` bits must be those of `value`; gives `property` */
    DRIVE_OP_WRITE,               /* a refusal is no error if the object has the value already */
    DRIVE_OP_PREPARE, /* a write that may be refused: a later one shows whether that matters */
};

struct drive_op {
    enum drive_op_kind kind;
    uint16_t index;
    uint8_t sub;
    uint8_t size;     /* bytes of a write */
    bool optional;    /* a drive without the object is accepted */
    uint8_t property; /* enum drive_property: which one a read gives */
    uint32_t value;   /* to write, to expect */
    uint32_t mask;    /* the bits that are compared */
};

struct drive_configuration {
    const struct config *config;
    struct drive_properties *properties;
    uint8_t axis;
    uint8_t row;
    uint8_t item; /* of the row, when it is a PDO */
};

/* `config` and `properties` must stay valid; the contents of `properties` are cleared. `axis` = axis_count of the
 * configuration: the I/O module. */
void drive_configuration_begin(struct drive_configuration *configuration,
                               const struct config *config, uint8_t axis,
                               struct drive_properties *properties);

/* The present operation; false at the end. */
bool drive_configuration_op(struct drive_configuration *configuration, struct drive_op *op);

/* The present operation is done; for a read, `value` is the result. */
void drive_configuration_advance(struct drive_configuration *configuration);

/* The drive refuses the present operation with the abort code. True: the operation was not necessary, and the next one
 * is the present one. */
bool drive_configuration_refused(struct drive_configuration *configuration, uint32_t abort_code);

#endif
