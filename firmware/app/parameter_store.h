/* SPDX-License-Identifier: MIT */
/*
 * parameter_store: parameters of the object dictionary that are kept without power (objects 0x1010 and 0x1011).
 *
 *     parameter_store_find(&store, &od);                 after power-on: finds and checks the stored parameters
 *     parameter_store_restore(&store, &od, 0, 0xFFFF);   into the dictionary
 *     parameter_store_save(&store, &od, crc32, true);
 *
 * Parameters are all objects that can be read and written and that describe the machine, its drives, or this node on
 * the bus: 0x1006, 0x1016, 0x1017, 0x1029, the configuration (app/machine/config.h), the node number 0x2054. A save
 * writes them to the parameter bank that does not hold the newest ones, and the bank's record last (bank_record.h). So
 * after a loss of power at any moment the old parameters or the new ones are found, complete. Called by
 * app/controller.c and app/objects.c. Main loop. Layout of the content: Erases and writes the parameter banks of the
 * store; restoring writes the dictionary.
 *
 *     CRC-32 of (index u16, sub u8, size u8) of each parameter u32 | CRC-32 of the configuration u32 | confirmed u8 |
 *     zero u8 x 3 | values in rising order of (index, sub), little-endian | zeros to a multiple of 8 bytes
 *
 * parameter_store_forget writes a record with a content of 0 bytes: the defaults are selected (0x1011). Only the
 * content of the newest record is used. If it is damaged, has a value that this firmware refuses, or is of a firmware
 * with other parameters, nothing is restored.
 */
#ifndef APP_PARAMETER_STORE_H
#define APP_PARAMETER_STORE_H

#include <stdbool.h>
#include <stdint.h>

#include "canopen/od.h"

/* Values of object 0x2050 sub 4. */
enum parameter_store_state {
    PARAMETER_STORE_EMPTY = 0,    /* nothing has been stored */
    PARAMETER_STORE_WHOLE = 1,    /* complete: can be restored */
    PARAMETER_STORE_OTHER = 2,    /* of a firmware with other parameters */
    PARAMETER_STORE_DAMAGED = 3,  /* wrong CRC, or a value that is not allowed */
    PARAMETER_STORE_DEFAULTS = 4, /* the defaults are selected */
};

struct parameter_store {
    enum parameter_store_state state;
    unsigned bank;         /* of the newest record; meaningless while EMPTY */
    uint32_t sequence;     /* of that record */
    uint32_t config_crc32; /* WHOLE: of the stored configuration, else 0 */
    bool confirmed;        /* WHOLE: the configuration was confirmed when it was stored */
};

/* Finds the newest parameters and checks them. */
void parameter_store_find(struct parameter_store *store, const struct od *od);

/* Puts the stored values of objects `first` to `last` into the dictionary, without hooks. Does nothing, and returns
 * false, unless the state is WHOLE. */
bool parameter_store_restore(const struct parameter_store *store, struct od *od, uint16_t first,
                             uint16_t last);

/* Stores the present values. Writes nothing if exactly these are stored already. 0, or PORT_ERR_STORE: then the stored
 * parameters have not changed. */
int parameter_store_save(struct parameter_store *store, const struct od *od, uint32_t config_crc32,
                         bool confirmed);

/* The defaults become valid with the next power-on or reset of the node. 0, or PORT_ERR_STORE: nothing has changed. */
int parameter_store_forget(struct parameter_store *store);

#endif
