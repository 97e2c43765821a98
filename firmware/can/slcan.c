/* SPDX-License-Identifier: MIT */
/* Implements can/slcan.h (see there): CAN frames as lines of text, as LAWICEL's adapters and their many descendants
 * have them. Used by sim/gateway and port/mps2. Pure, any context. */
#include "can/slcan.h"

#include <string.h>

#define STAMP_DIGITS 4u /* of a time stamp, optional after the data */
#define HEAD_SIZE    5u /* t, identifier, length */

static char digit(uint32_t value)
{
    return "0123456789ABCDEF"[value & 0xFu];
}

uint32_t slcan_encode(const struct can_msg *message, char line[SLCAN_LINE_MAX])
{
    char *at = line;
    *at++ = 't';
    for (int shift = 8; shift >= 0; shift -= 4) {
        *at++ = digit(message->id >> shift);
    }
    *at++ = digit(message->len);
    for (uint32_t i = 0; i < message->len; ++i) {
        *at++ = digit((uint32_t)message->data[i] >> 4);
        *at++ = digit(message->data[i]);
    }
    *at++ = '\r';
    return (uint32_t)(at - line);
}

/* 16 and more: not a digit. */
static uint32_t value_of(char character)
{
    if (character >= '0' && character <= '9') {
        return (uint32_t)(character - '0');
    }
    const char small = (char)(character | 0x20);
    return small >= 'a' && small <= 'f' ? (uint32_t)(small - 'a') + 10u : 16u;
}

static bool number(const char *text, uint32_t digits, uint32_t *value)
{
    *value = 0;
    for (uint32_t i = 0; i < digits; ++i) {
        const uint32_t next = value_of(text[i]);
        if (next > 15u) {
            return false;
        }
        *value = 16u * *value + next;
    }
    return true;
}

static bool frame_of(const char *line, uint32_t length, struct can_msg *message)
{
    uint32_t len = 0;
    memset(message, 0, sizeof *message);
    if (length < HEAD_SIZE || !number(line + 1, 3, &message->id) || !number(line + 4, 1, &len) ||
        message->id > CAN_ID_MAX || len > CAN_DATA_MAX ||
        (length != HEAD_SIZE + 2u * len && length != HEAD_SIZE + 2u * len + STAMP_DIGITS)) {
        return false;
    }
    message->len = (uint8_t)len;
    for (uint32_t i = 0; i < len; ++i) {
        uint32_t byte = 0;
        if (!number(line + HEAD_SIZE + 2u * i, 2, &byte)) {
            return false;
        }
        message->data[i] = (uint8_t)byte;
    }
    return true;
}

/* An adapter answers with \r, refuses with a bell; neither belongs to the line that follows. */
bool slcan_decode(struct slcan_decoder *decoder, char character, struct can_msg *message)
{
    if (character != '\r' && character != '\n' && character != '\a') {
        if (decoder->length < sizeof decoder->line) {
            decoder->line[decoder->length] = character;
            decoder->length++;
        } else {
            decoder->length = sizeof decoder->line + 1u;
        }
        return false;
    }
    const uint32_t length = decoder->length;
    decoder->length = 0;
    decoder->closed =
        decoder->closed || (length == 1u && decoder->line[0] == 'C' && character == '\r');
    if (length == 0u || decoder->line[0] != 't') {
        return false;
    }
    const bool good = character != '\a' && length <= sizeof decoder->line &&
                      frame_of(decoder->line, length, message);
    decoder->refused += good ? 0u : 1u;
    return good;
}
