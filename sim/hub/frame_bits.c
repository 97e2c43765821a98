/* SPDX-License-Identifier: MIT */
/* Implements hub/frame_bits.h (see there): the number of bits of a CAN frame, stuff bits included. Used by
 * sim/hub/hub. Pure. */
#include "hub/frame_bits.h"

#include <stdint.h>

/* CRC delimiter, ACK slot and delimiter, 7 bits end of frame, 3 bits intermission: never stuffed. */
enum { UNSTUFFED_BITS = 13, CRC_BITS = 15, CRC_POLYNOMIAL = 0x4599, STUFF_RUN = 5 };

/* What a transmitter keeps from bit to bit. */
struct bits {
    unsigned count; /* bits and stuff bits */
    unsigned run;   /* equal bits at the end */
    unsigned last;
    unsigned crc;
};

static void put(struct bits *bits, unsigned bit)
{
    bits->run = bits->count > 0u && bit == bits->last ? bits->run + 1u : 1u;
    bits->last = bit;
    bits->count++;
    if (bits->run == (unsigned)STUFF_RUN) {
        bits->last = bit ^ 1u;
        bits->run = 1;
        bits->count++;
    }
}

static void put_value(struct bits *bits, uint32_t value, unsigned width)
{
    while (width-- > 0u) {
        const unsigned bit = (value >> width) & 1u;
        const unsigned out = ((bits->crc >> 14) ^ bit) & 1u;
        bits->crc = ((bits->crc << 1) & 0x7FFFu) ^ (out != 0u ? (unsigned)CRC_POLYNOMIAL : 0u);
        put(bits, bit);
    }
}

/* Start bit to data length code. */
static void put_header(struct bits *bits, const struct can_frame *frame)
{
    const uint32_t remote = (frame->can_id & CAN_RTR_FLAG) != 0u ? 1u : 0u;
    put_value(bits, 0, 1);
    if ((frame->can_id & CAN_EFF_FLAG) != 0u) {
        put_value(bits, (frame->can_id & CAN_EFF_MASK) >> 18, 11);
        put_value(bits, 3, 2); /* SRR, IDE */
        put_value(bits, frame->can_id & 0x3FFFFu, 18);
        put_value(bits, remote << 2, 3); /* RTR, two reserved bits */
    } else {
        put_value(bits, frame->can_id & CAN_SFF_MASK, 11);
        put_value(bits, remote << 2, 3); /* RTR, IDE, a reserved bit */
    }
    put_value(bits, frame->can_dlc, 4);
}

unsigned frame_bits(const struct can_frame *frame)
{
    struct bits bits = {0, 0, 0, 0};
    if ((frame->can_id & CAN_ERR_FLAG) != 0u) {
        return 0;
    }
    put_header(&bits, frame);
    for (unsigned i = 0; i < frame->can_dlc && (frame->can_id & CAN_RTR_FLAG) == 0u; ++i) {
        put_value(&bits, frame->data[i], 8);
    }
    const unsigned crc = bits.crc;
    for (unsigned width = CRC_BITS; width-- > 0u;) {
        put(&bits, (crc >> width) & 1u);
    }
    return bits.count + UNSTUFFED_BITS;
}
