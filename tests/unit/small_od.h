/* SPDX-License-Identifier: MIT */
/* small_od: a small object dictionary with recording hooks, for the tests of od and SDO. Used by sdo_talk and
 * test_od.c. One thread; no I/O. */
#ifndef SMALL_OD_H
#define SMALL_OD_H

#include <stdbool.h>
#include <stdint.h>

#include "canopen/od.h"

#define SMALL_DOMAIN_MAX 4096u
#define SMALL_URGENT     5u /* of 0x2000 */

struct small_values {
    uint32_t device_type;
    char name[9]; /* "Small OD" */
    uint8_t limited;
    int16_t with_sign;
    uint16_t secret;
    uint32_t word;
    uint8_t count;
    uint64_t wide;
    int64_t wide_constant;
    char text[21];
    uint8_t flag;
    uint8_t octets[5];
    uint32_t computed;
};

struct small_od {
    struct od od;
    struct small_values values;
    uint32_t veto;          /* answer of the write hook */
    uint32_t read_refusal;  /* answer of the read hook */
    uint32_t begin_refusal; /* answers of the DOMAIN hooks */
    uint32_t write_refusal;
    uint32_t end_refusal;
    int written;
    int begun, ended, aborted;
    bool open;
    uint32_t announced;
    uint32_t domain_size;
    uint8_t domain[SMALL_DOMAIN_MAX];
};

void small_od_init(struct small_od *small);

#endif
