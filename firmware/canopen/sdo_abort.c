/* SPDX-License-Identifier: MIT */
/* Implements canopen/sdo_abort.h (see there): the abort codes of SDO transfers that this project sends or explains.
 * Used by firmware/app, firmware/canopen and sim/node: hooks and handlers of the dictionaries return such a code. 0
 * means success. Constants, and one pure function for any context. */
#include "canopen/sdo_abort.h"

#include <stddef.h>

struct abort_text {
    uint32_t code;
    const char *text;
};

static const struct abort_text texts[] = {
    {SDO_OK, "no error"},
    {SDO_ABORT_TOGGLE, "toggle bit not alternated"},
    {SDO_ABORT_TIMEOUT, "SDO protocol timed out"},
    {SDO_ABORT_COMMAND, "command specifier not valid or unknown"},
    {SDO_ABORT_BLOCK_SIZE, "invalid block size"},
    {SDO_ABORT_SEQUENCE, "invalid sequence number"},
    {SDO_ABORT_CRC, "CRC error"},
    {SDO_ABORT_MEMORY, "out of memory"},
    {SDO_ABORT_ACCESS, "unsupported access to an object"},
    {SDO_ABORT_WRITE_ONLY, "object is write-only"},
    {SDO_ABORT_READ_ONLY, "object is read-only"},
    {SDO_ABORT_NO_OBJECT, "object does not exist"},
    {SDO_ABORT_NOT_MAPPABLE, "object cannot be mapped to the PDO"},
    {SDO_ABORT_PDO_LENGTH, "mapped objects exceed the PDO's length"},
    {SDO_ABORT_INCOMPATIBLE, "parameters are incompatible"},
    {SDO_ABORT_HARDWARE, "access failed because of a hardware error"},
    {SDO_ABORT_SIZE, "length of the value does not match"},
    {SDO_ABORT_TOO_LONG, "value too long"},
    {SDO_ABORT_TOO_SHORT, "value too short"},
    {SDO_ABORT_NO_SUB, "sub-index does not exist"},
    {SDO_ABORT_VALUE, "value not allowed"},
    {SDO_ABORT_TOO_HIGH, "value too high"},
    {SDO_ABORT_TOO_LOW, "value too low"},
    {SDO_ABORT_GENERAL, "general error"},
    {SDO_ABORT_TRANSFER, "data cannot be transferred or stored"},
    {SDO_ABORT_LOCAL, "data cannot be stored because of local control"},
    {SDO_ABORT_STATE, "not possible in the present device state"},
    {SDO_ABORT_NO_DATA, "no data available"},
};

const char *sdo_abort_text(uint32_t code)
{
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        if (texts[i].code == code) {
            return texts[i].text;
        }
    }
    return "unknown abort code";
}
