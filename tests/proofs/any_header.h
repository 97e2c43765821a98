/* SPDX-License-Identifier: MIT */
/* The header of a program before its sizes and counts are checked. Include it after core/program.c and proof.h.
 * Included by cbmc_compact.c and cbmc_record.c; never executed, touches nothing. */
#ifndef HODOGRAPH_PROOFS_ANY_HEADER_H
#define HODOGRAPH_PROOFS_ANY_HEADER_H

/* Any counts and any size of the image, with so many path axes and these flags. */
static struct program_header any_header(uint32_t axis_count, uint16_t flags)
{
    struct program_header h;
    h.flags = flags;
    h.axis_count = (uint16_t)axis_count;
    h.header_size = (uint16_t)program_header_size(axis_count);
    h.image_size = nondet_uint32();
    h.segment_count = nondet_uint32();
    h.piece_count = nondet_uint32();
    h.event_count = nondet_uint32();
    return h;
}

#endif
