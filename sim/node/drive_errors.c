/* SPDX-License-Identifier: MIT */
/* Implements node/drive_errors.h: reports errors of a simulated drive. Used by node/servo, node/drive_pdos and
 * node/drive_node. All in one context. Changes its struct and the values of the dictionary; no I/O, since
 * node/drive_node sends the EMCY. */
#include "node/drive_errors.h"

enum { HISTORY = 8 };

void drive_errors_init(struct drive_errors *errors, uint8_t id, struct od_drive *values)
{
    errors->values = values;
    emcy_producer_init(&errors->emcy, id, &values->error_register, values->predefined_error_field,
                       &values->predefined_error_field_count, HISTORY);
}

/* Bits of 0x1001 for an error code, by its class (CiA 301 table 26). */
static uint8_t register_bits(uint16_t code)
{
    switch (code >> 12) {
    case 2:
        return EMCY_REGISTER_CURRENT;
    case 3:
        return EMCY_REGISTER_VOLTAGE;
    case 4:
        return EMCY_REGISTER_TEMPERATURE;
    case 7:
        return EMCY_REGISTER_PROFILE;
    case 8:
        return code < 0x8300u || code == EMCY_SYNC_LOST ? EMCY_REGISTER_COMMUNICATION
                                                        : EMCY_REGISTER_PROFILE;
    case 15:
        return EMCY_REGISTER_MANUFACTURER;
    default:
        return EMCY_REGISTER_GENERIC;
    }
}

void drive_errors_report(struct drive_errors *errors, uint16_t code, uint8_t detail)
{
    const uint8_t details[EMCY_DETAIL_SIZE] = {detail, 0, 0, 0, 0};
    errors->values->error_code = code;
    emcy_producer_raise(&errors->emcy, code, register_bits(code), details);
}

void drive_errors_rpdo_short(struct drive_errors *errors, int i, const struct pdo_map *map,
                             const struct can_msg *in)
{
    const bool reported = errors->short_rpdos != 0u;
    errors->short_rpdos |= (uint8_t)(1u << i);
    if (reported) {
        return;
    }
    const uint8_t detail[EMCY_DETAIL_SIZE] = {(uint8_t)(map->index & 0xFFu),
                                              (uint8_t)(map->index >> 8), in->len, map->length, 0};
    emcy_producer_raise(&errors->emcy, EMCY_PDO_LENGTH, EMCY_REGISTER_COMMUNICATION, detail);
}

void drive_errors_rpdo_good(struct drive_errors *errors, int i)
{
    errors->short_rpdos &= (uint8_t)~(1u << i);
    if (errors->short_rpdos == 0u && errors->values->error_code == EMCY_NO_ERROR) {
        emcy_producer_clear(&errors->emcy, EMCY_REGISTER_COMMUNICATION);
    }
}

void drive_errors_clear(struct drive_errors *errors)
{
    errors->values->error_code = EMCY_NO_ERROR;
    errors->short_rpdos = 0;
    emcy_producer_clear(&errors->emcy, 0xFF);
}
