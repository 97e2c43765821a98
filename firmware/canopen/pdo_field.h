/* SPDX-License-Identifier: MIT */
/* pdo_field: one mapped object of a PDO: a number in the host's byte order, in a frame little-endian.
 *
 * In the context of its PDO. */
#ifndef CANOPEN_PDO_FIELD_H
#define CANOPEN_PDO_FIELD_H

#include <stdint.h>

struct pdo_field {
    uint8_t *value; /* in the od's storage */
    uint8_t size;   /* bytes: 1, 2, 4, 8 */
};

/* From `size` bytes of a frame into the object; and back. */
void pdo_field_store(const struct pdo_field *field, const uint8_t *from);
void pdo_field_load(const struct pdo_field *field, uint8_t *to);

#endif
