/* SPDX-License-Identifier: MIT */
/* sdo_client_private: what the two files of the SDO client share. Nothing else includes this. */
#ifndef CANOPEN_SDO_CLIENT_PRIVATE_H
#define CANOPEN_SDO_CLIENT_PRIVATE_H

#include "canopen/sdo_client.h"

#define SDO_BYTES       8u
#define SEGMENT_BYTES   7u
#define EXPEDITED_BYTES 4u

/* Bits of first bytes. */
#define TOGGLE       0x10u
#define LAST_SEGMENT 0x01u
#define SIZE_GIVEN   0x01u
#define EXPEDITED    0x02u
#define ABORT        0x80u

/* An empty request with this first byte. */
void sdo_client_ask(const struct sdo_client *client, uint8_t command, struct can_msg *out);

#endif
