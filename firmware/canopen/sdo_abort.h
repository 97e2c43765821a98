/* SPDX-License-Identifier: MIT */
/* sdo_abort: the abort codes of SDO transfers (CiA 301, table 22) that this project sends or explains, with their
 * texts.
 *
 * Used by firmware/app, firmware/canopen and sim/node: hooks and handlers of the dictionaries return such a code. 0
 * means success. Constants, and one pure function for any context.
 */
#ifndef CANOPEN_SDO_ABORT_H
#define CANOPEN_SDO_ABORT_H

#include <stdint.h>

#define SDO_OK                 UINT32_C(0)
#define SDO_ABORT_TOGGLE       UINT32_C(0x05030000) /* toggle bit not alternated */
#define SDO_ABORT_TIMEOUT      UINT32_C(0x05040000) /* protocol timed out */
#define SDO_ABORT_COMMAND      UINT32_C(0x05040001) /* unknown or unexpected command specifier */
#define SDO_ABORT_BLOCK_SIZE   UINT32_C(0x05040002) /* block size not 1 ... 127 */
#define SDO_ABORT_SEQUENCE     UINT32_C(0x05040003) /* sequence number out of range */
#define SDO_ABORT_CRC          UINT32_C(0x05040004) /* CRC of a block transfer differs */
#define SDO_ABORT_MEMORY       UINT32_C(0x05040005) /* out of memory */
#define SDO_ABORT_ACCESS       UINT32_C(0x06010000) /* unsupported access to an object */
#define SDO_ABORT_WRITE_ONLY   UINT32_C(0x06010001) /* attempt to read a write-only object */
#define SDO_ABORT_READ_ONLY    UINT32_C(0x06010002) /* attempt to write a read-only object */
#define SDO_ABORT_NO_OBJECT    UINT32_C(0x06020000) /* object does not exist */
#define SDO_ABORT_NOT_MAPPABLE UINT32_C(0x06040041) /* object cannot be mapped to the PDO */
#define SDO_ABORT_PDO_LENGTH   UINT32_C(0x06040042) /* mapped objects exceed the PDO's length */
#define SDO_ABORT_INCOMPATIBLE UINT32_C(0x06040043) /* general parameter incompatibility */
#define SDO_ABORT_HARDWARE     UINT32_C(0x06060000) /* access failed because of a hardware error */
#define SDO_ABORT_SIZE         UINT32_C(0x06070010) /* length of the value does not match */
#define SDO_ABORT_TOO_LONG     UINT32_C(0x06070012) /* value too long */
#define SDO_ABORT_TOO_SHORT    UINT32_C(0x06070013) /* value too short */
#define SDO_ABORT_NO_SUB       UINT32_C(0x06090011) /* sub-index does not exist */
#define SDO_ABORT_VALUE        UINT32_C(0x06090030) /* value not allowed */
#define SDO_ABORT_TOO_HIGH     UINT32_C(0x06090031) /* value above the upper limit */
#define SDO_ABORT_TOO_LOW      UINT32_C(0x06090032) /* value below the lower limit */
#define SDO_ABORT_GENERAL      UINT32_C(0x08000000) /* general error */
#define SDO_ABORT_TRANSFER     UINT32_C(0x08000020) /* data cannot be transferred or stored */
#define SDO_ABORT_LOCAL        UINT32_C(0x08000021) /* ... because of local control */
#define SDO_ABORT_STATE        UINT32_C(0x08000022) /* ... in the present device state */
#define SDO_ABORT_NO_DATA      UINT32_C(0x08000024) /* no data available */

/* One English phrase for a code, never NULL ("unknown abort code" for others). */
const char *sdo_abort_text(uint32_t code);

#endif
