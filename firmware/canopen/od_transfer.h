/* SPDX-License-Identifier: MIT */
/* od_transfer: writes or reads one object of a dictionary piece by piece. It joins the segments and blocks of
 * sdo_server to the object dictionary (canopen/od). Called by canopen/sdo_server. Changes its struct and the
 * dictionary; no I/O.
 *
 *     write: od_transfer_begin_write, od_transfer_put as often as needed, od_transfer_finish_write
 *     read:  od_transfer_begin_read,  od_transfer_get as often as needed
 *     od_transfer_drop if a transfer ends early, or one of these functions returned an abort code
 *
 * A value other than a DOMAIN is collected and written in one piece at the end, so that an incomplete transfer changes
 * nothing. A value that is read is copied at the beginning, so that all its pieces are of one moment. DOMAIN data goes
 * to and comes from the hooks of the dictionary as it is moved.
 *
 * Results are abort codes or SDO_OK (canopen/sdo_abort.h). All functions: main loop (the hooks may take long).
 */
#ifndef CANOPEN_OD_TRANSFER_H
#define CANOPEN_OD_TRANSFER_H

#include <stdbool.h>
#include <stdint.h>

#include "canopen/od.h"

/* Longest value that is not a DOMAIN, in bytes. */
#define OD_VALUE_MAX 64u

/* Read `entry`, `size` and `moved`; all other fields are private. */
struct od_transfer {
    struct od *od;
    const struct od_entry *entry; /* valid after a begin that gave SDO_OK */
    uint32_t size;  /* bytes; write: as announced, 0: not announced; read: of the whole */
    uint32_t moved; /* write: bytes put; read: the caller's own count, 0 at the beginning */
    bool open;      /* a DOMAIN's domain_end or domain_abort is due */
    uint8_t value[OD_VALUE_MAX];
};

void od_transfer_init(struct od_transfer *t, struct od *od);

/* `announced`: size in bytes that the client announced; 0: none. Checks existence, access and size. */
uint32_t od_transfer_begin_write(struct od_transfer *t, uint16_t index, uint8_t sub,
                                 uint32_t announced);

/* The next `size` bytes. SDO_ABORT_TOO_LONG beyond the announced size, or the size of the value. */
uint32_t od_transfer_put(struct od_transfer *t, const uint8_t *data, uint32_t size);

/* All bytes are there: SDO_ABORT_TOO_SHORT when fewer than announced, else the result of the dictionary. */
uint32_t od_transfer_finish_write(struct od_transfer *t);

/* Sets `size`. Checks existence and access. */
uint32_t od_transfer_begin_read(struct od_transfer *t, uint16_t index, uint8_t sub);

/* Copies `size` bytes from `offset` on, which must lie within the object; the same bytes may be requested again. */
uint32_t od_transfer_get(struct od_transfer *t, uint32_t offset, uint8_t *data, uint32_t size);

/* Ends a write of a DOMAIN that is not finished, by the hook domain_abort; else does nothing. */
void od_transfer_drop(struct od_transfer *t);

#endif
