/* SPDX-License-Identifier: MIT */
/* pdo_map: one remappable PDO of a device (CiA 301, 7.2.2, objects 0x1400 ... 0x1BFF): parameters, mapping, packing,
 * times.
 * 
 * Used by app/objects_axis, app/objects_outputs and sim/node. The parameters are in the object dictionary, with the
 * sub-indices of its EDS. This module checks writes to them (pdo_map_write, called by the dictionary's write hook) and
 * applies them (pdo_map_written). It keeps the mapped entries in a list, so that packing needs no search. PDOs of
 * 0x1400 ... are received, those of 0x1800 ... sent. The EDS says which objects may be mapped (PDOMapping); an object
 * must be readable to be sent, writable to be received. Packing and unpacking do not call the dictionary's hooks: the
 * application updates fields before packing, and checks received values when it uses them. Changes its struct and the
 * mapped values of the dictionary; no I/O.
 * 
 * Rules for writes, with their abort codes:
 *   COB-ID (sub 1)      another identifier while the PDO is valid (bit 31 clear), an identifier of
 *                       another service, or one of 29 bits: SDO_ABORT_VALUE
 *   type (sub 2)        sent: 0 ... 240, 254, 255 (no remote requests); received: the same; others:
 *                       SDO_ABORT_VALUE
 *   inhibit time (sub 3, 100 us)  while valid: SDO_ABORT_STATE
 *   event timer (sub 5, ms)       any time
 *   mapping             while valid: SDO_ABORT_STATE; an entry while sub 0 is not 0: SDO_ABORT_STATE;
 *                       an entry that does not exist: SDO_ABORT_NO_OBJECT, SDO_ABORT_NO_SUB; not
 *                       mappable or of another length: SDO_ABORT_NOT_MAPPABLE; more than 8 bytes in
 *                       all, when sub 0 is written: SDO_ABORT_PDO_LENGTH
 * So the order is: off, sub 0 to 0, entries, sub 0, on. No bits below a byte are mapped, no dummies.
 * 
 * All functions of one PDO in one context. */
#ifndef CANOPEN_PDO_MAP_H
#define CANOPEN_PDO_MAP_H

#include <stdbool.h>
#include <stdint.h>

#include "can/can_frame.h"
#include "canopen/od.h"

#define PDO_MAP_ENTRIES 8u

/* Bit 31 of the COB-ID: the PDO does not exist. */
#define PDO_MAP_OFF UINT32_C(0x80000000)

/* A mapped object, without a search: where its value is in the od's storage. */
struct pdo_field {
    uint8_t *value;
    uint8_t size; /* bytes: 1, 2, 4, 8 */
};

/* Read `valid`, `cob_id`, `type` and `length`; all other fields are private. */
struct pdo_map {
    struct od *od;
    struct pdo_field fields[PDO_MAP_ENTRIES];
    uint32_t waited_us;  /* sent: since the last frame; received: since the last one */
    uint32_t inhibit_us; /* 0: none */
    uint32_t event_us;   /* 0: none */
    uint16_t index;      /* of the communication parameters */
    uint16_t cob_id;
    uint8_t type;
    uint8_t count;  /* of mapped objects */
    uint8_t length; /* bytes */
    uint8_t syncs;  /* sent: since the last frame; types 1 ... 240 */
    bool valid;
    bool pending;        /* received: `last` waits for SYNC. Sent: `last` is out of date */
    bool watched;        /* received: the deadline runs */
    struct can_msg last; /* received or sent last */
};

enum pdo_map_result {
    PDO_MAP_NOT,   /* not this PDO, or not valid */
    PDO_MAP_TAKEN, /* its values are in the fields, or will be with pdo_map_sync */
    PDO_MAP_SHORT  /* fewer bytes than mapped: not processed (EMCY 0x8210) */
};

/* Takes the parameters at 0x1400 + n or 0x1800 + n and the mapping 0x200 above from the od. Again
 * after the od got its defaults. Both objects must exist. */
void pdo_map_init(struct pdo_map *map, struct od *od, uint16_t index);

/* Checks a write to the dictionary: SDO_OK if it is permitted, or does not concern this PDO. */
uint32_t pdo_map_write(const struct pdo_map *map, const struct od_entry *entry,
                       const uint8_t *value, uint32_t size);

/* Applies a write that has been stored. Returns true if it concerns this PDO. */
bool pdo_map_written(struct pdo_map *map, const struct od_entry *entry);

/* Received PDOs: a frame; types 0 ... 240 wait for pdo_map_sync, others act at once. Longer frames
 * are accepted, their extra bytes ignored. */
enum pdo_map_result pdo_map_receive(struct pdo_map *map, const struct can_msg *in);

/* Received PDOs, at SYNC: stores the waiting values. Returns true when there were any. */
bool pdo_map_apply(struct pdo_map *map);

/* Received PDOs: lets time pass. Returns true once when the event timer has run out since the last
 * frame; it starts with the first frame, and anew with each. */
bool pdo_map_overdue(struct pdo_map *map, uint32_t elapsed_us);

/* On leaving or entering OPERATIONAL: the event timer stops until the next frame; the count of SYNCs and the comparison
 * with the content sent last begin anew. */
void pdo_map_restart(struct pdo_map *map);

/* Sent PDOs, at SYNC, fields up to date: returns true when *out is to be sent. */
bool pdo_map_sync(struct pdo_map *map, struct can_msg *out);

/* Sent PDOs of types 254 and 255: lets time pass; sends on change, within the inhibit time, and when
 * the event timer runs out. Fields up to date. Returns true when *out is to be sent. */
bool pdo_map_process(struct pdo_map *map, uint32_t elapsed_us, struct can_msg *out);

/* Whether pdo_map_process could send: its fields need to be up to date. */
bool pdo_map_event_driven(const struct pdo_map *map);

#endif
