/* SPDX-License-Identifier: MIT */
/*
 * drive_pdo: one PDO of a drive as the controller wants it, and the writes that make it so, in the
 * order of CiA 301 (7.5.2.36): disable, transmission type, no mapping, entries, their count,
 * times, enable.
 *
 * Pure; docs/reference/protocol.md section 2 has the PDOs.
 */
#ifndef APP_DRIVES_DRIVE_PDO_H
#define APP_DRIVES_DRIVE_PDO_H

#include <stdbool.h>
#include <stdint.h>

#define DRIVE_PDO_ENTRIES 3u
#define DRIVE_PDO_INVALID UINT32_C(0x80000000) /* bit 31 of the COB-ID */
#define DRIVE_PDO_NO_RTR  UINT32_C(0x40000000) /* bit 30, of TPDOs */

struct drive_pdo {
    uint16_t communication;              /* 0x14xx or 0x18xx; the mapping is 0x200 further */
    uint16_t cob;                        /* without the node id */
    uint8_t type;                        /* transmission type */
    uint8_t count;                       /* mapped objects; 0: the PDO shall be off */
    uint8_t inhibit_ms;                  /* TPDO; 0: the drive's own */
    bool event_timer;                    /* RPDO: the drive watches for it (0x2004 sub 10) */
    uint32_t entries[DRIVE_PDO_ENTRIES]; /* index << 16 | sub << 8 | bits */
    uint8_t fact; /* enum drive_fact: known of a drive that has taken all of it */
};

/* Kinds of operation on a drive's dictionary. */
enum drive_op_kind {
    DRIVE_OP_NMT_PRE_OPERATIONAL, /* process data off while parameters change */
    DRIVE_OP_READ,                /* `masked` bits must be those of `value`; learns `fact` */
    DRIVE_OP_WRITE,               /* refused: fine when it reads back so already */
    DRIVE_OP_PREPARE,             /* a write that may be refused: a later one tells */
};

struct drive_op {
    enum drive_op_kind kind;
    uint16_t index;
    uint8_t sub;
    uint8_t size;   /* bytes of a write */
    bool optional;  /* a drive without the object is fine */
    uint8_t fact;   /* enum drive_fact: what a read teaches */
    uint32_t value; /* to write, to expect */
    uint32_t mask;  /* what counts when it is read */
};

/* The write number `item` (0, 1, ...) for a drive; false after the last one. setpoint_timeout_ms is
 * for the event timer. */
bool drive_pdo_op(const struct drive_pdo *pdo, uint8_t node, uint16_t setpoint_timeout_ms,
                  uint8_t item, struct drive_op *op);

#endif
