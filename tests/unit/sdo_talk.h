/* SPDX-License-Identifier: MIT */
/* sdo_talk: a client made of raw frames, for tests of the SDO server: one node, one small dictionary. Used by the tests
 * of SDO (test_sdo_*.c) and by fuzz_sdo_server.c. One thread; no I/O. */
#ifndef SDO_TALK_H
#define SDO_TALK_H

#include <stdbool.h>
#include <stdint.h>

#include "canopen/sdo_server.h"
#include "small_od.h"

#define TALK_NODE       5u
#define TALK_TIMEOUT_US 100000u
#define TALK_BLOCK      16u

struct sdo_talk {
    struct small_od small;
    struct sdo_server server;
    struct can_msg answer; /* the last one */
};

void sdo_talk_init(struct sdo_talk *talk);

/* Sends a request; true when there was an answer (checked for identifier and length). */
bool sdo_talk_send(struct sdo_talk *talk, const uint8_t request[8]);

/* The same with the usual parts: command byte, object, four bytes of data. */
bool sdo_talk_ask(struct sdo_talk *talk, uint8_t command, uint16_t index, uint8_t sub,
                  uint32_t data);

/* A segment (segmented or block): first byte and up to seven bytes. */
bool sdo_talk_segment(struct sdo_talk *talk, uint8_t first, const uint8_t *data, uint32_t size);

/* Whether a transfer is under way. */
bool sdo_talk_busy(const struct sdo_talk *talk);

/* The abort code of the last answer, 0 when it is not an abort. */
uint32_t sdo_talk_abort_code(const struct sdo_talk *talk);

#endif
