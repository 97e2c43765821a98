/* SPDX-License-Identifier: MIT */
/* cob: identifiers of the predefined connection set (CiA 301, 7.3.3) and little-endian access to
 * frame bytes.
 *
 * Used by firmware/app, firmware/canopen and sim/node. Any context; the functions write only their arguments. */
#ifndef CANOPEN_COB_H
#define CANOPEN_COB_H

#include <stdint.h>

#include "can/can_frame.h"

/* Add the node id (1 ... 127) to those with "+ node". */
#define COB_NMT          0x000u
#define COB_SYNC         0x080u
#define COB_EMCY         0x080u /* + node */
#define COB_TPDO1        0x180u /* + node */
#define COB_RPDO1        0x200u /* + node */
#define COB_TPDO2        0x280u /* + node */
#define COB_RPDO2        0x300u /* + node */
#define COB_TPDO3        0x380u /* + node */
#define COB_RPDO3        0x400u /* + node */
#define COB_TPDO4        0x480u /* + node */
#define COB_RPDO4        0x500u /* + node */
#define COB_SDO_RESPONSE 0x580u /* + node: server to client */
#define COB_SDO_REQUEST  0x600u /* + node: client to server */
#define COB_HEARTBEAT    0x700u /* + node */

/* Node numbers that CiA 301 allows. */
#define NODE_ID_MIN 1u
#define NODE_ID_MAX 127u

/* Sets *out to an empty frame: identifier, length and zero bytes. */
void cob_frame(struct can_msg *out, uint32_t id, uint8_t len);

/* The `size` (1 ... 8) bytes at `from`, least significant first, without sign extension. */
uint64_t cob_get(const uint8_t *from, uint32_t size);

/* Stores the low `size` (0 ... 8) bytes of `value` at `to`, least significant first. */
void cob_put(uint8_t *to, uint64_t value, uint32_t size);

/* The same for process data, in the tick. Written out, so that compilers make one load or store of each where the core
 * has unaligned ones. */
static inline uint16_t cob_get16(const uint8_t *from)
{
    return (uint16_t)(from[0] | (uint32_t)from[1] << 8);
}

static inline uint32_t cob_get32(const uint8_t *from)
{
    return from[0] | (uint32_t)from[1] << 8 | (uint32_t)from[2] << 16 | (uint32_t)from[3] << 24;
}

static inline void cob_put16(uint8_t *to, uint16_t value)
{
    to[0] = (uint8_t)value;
    to[1] = (uint8_t)(value >> 8);
}

static inline void cob_put32(uint8_t *to, uint32_t value)
{
    to[0] = (uint8_t)value;
    to[1] = (uint8_t)(value >> 8);
    to[2] = (uint8_t)(value >> 16);
    to[3] = (uint8_t)(value >> 24);
}

/* Two's complement reading of the low `size` (1 ... 8) bytes of `value`. */
int64_t cob_signed(uint64_t value, uint32_t size);

#endif
