/* SPDX-License-Identifier: MIT */
/*
 * emcy: emergency messages (CiA 301, 7.2.7), error register 0x1001 and error history 0x1003. The controller and each
 * simulated drive have a producer. The controller reads messages of drives with emcy_decode. Used by firmware/app and
 * sim/node. No I/O: the caller sends.
 *
 * All functions of one producer in one context: the main loop of the controller, the period of a simulated drive. The
 * functions without a producer are pure, any context.
 */
#ifndef CANOPEN_EMCY_H
#define CANOPEN_EMCY_H

#include <stdbool.h>
#include <stdint.h>

#include "can/can_frame.h"

/* Bits of the error register 0x1001 (CiA 301, 7.5.2.2): kinds of error that are present. */
#define EMCY_REGISTER_GENERIC       0x01u /* set while any error is */
#define EMCY_REGISTER_CURRENT       0x02u
#define EMCY_REGISTER_VOLTAGE       0x04u
#define EMCY_REGISTER_TEMPERATURE   0x08u
#define EMCY_REGISTER_COMMUNICATION 0x10u
#define EMCY_REGISTER_PROFILE       0x20u /* of the device profile, here CiA 402 */
#define EMCY_REGISTER_MANUFACTURER  0x80u

/* Error codes that the project uses (CiA 301 table 26, CiA 402-2). */
#define EMCY_NO_ERROR          0x0000u /* the last error has ended */
#define EMCY_GENERIC           0x1000u /* no more exact code is known */
#define EMCY_OVERLOAD          0x2310u /* continuous over current (I2t) */
#define EMCY_DC_UNDERVOLTAGE   0x3220u /* supply of the power stage too low */
#define EMCY_SOFTWARE          0x6100u /* internal software */
#define EMCY_POSITION_SENSOR   0x7300u /* encoder */
#define EMCY_POSITION_SENSOR_1 0x7305u /* incremental sensor 1 */
#define EMCY_COMMUNICATION     0x8100u /* any other error of the bus */
#define EMCY_CAN_OVERRUN       0x8110u /* received frames were lost */
#define EMCY_CAN_PASSIVE       0x8120u /* many bus errors: error passive */
#define EMCY_HEARTBEAT         0x8130u /* life guard or heartbeat error */
#define EMCY_BUS_OFF_RECOVERED 0x8140u /* back on the bus after bus-off */
#define EMCY_PDO_LENGTH        0x8210u /* PDO not processed: too short */
#define EMCY_SYNC_LENGTH       0x8240u /* SYNC of another length than 0x1019 requires */
#define EMCY_RPDO_TIMEOUT      0x8250u /* no RPDO within its event timer */
#define EMCY_FOLLOWING_ERROR   0x8611u /* out of the window 0x6065 for too long */
#define EMCY_POSITION_LIMIT    0x8612u /* reference limit */
#define EMCY_SYNC_LOST         0x8700u /* SYNC controller (CiA 402) */
#define EMCY_MANUFACTURER      0xFF00u /* and above: the maker's own; here app/machine/fault.h */

#define EMCY_HISTORY_MAX 8u
#define EMCY_DETAIL_SIZE 5u

struct emcy {
    uint16_t code;
    uint8_t error_register;
    uint8_t detail[EMCY_DETAIL_SIZE]; /* manufacturer specific */
};

/* Producer. The values of 0x1001 and 0x1003 belong to the object dictionary; the producer writes them. A few messages
 * wait in a queue until the caller sends them. If it is full, the newest message replaces the oldest of the same code,
 * or else the oldest of all. The replaced message is not sent, but stays in the history. */
struct emcy_producer {
    uint8_t *error_register; /* 0x1001 */
    /* 0x1003 sub 1 ...: newest first; low half code, high half first detail bytes */
    uint32_t *history;
    uint8_t *history_count; /* 0x1003 sub 0 */
    uint8_t history_size;
    uint8_t node;
    uint8_t queued;
    struct emcy queue[4];
};

/* All three pointers must stay valid; what they point to is cleared. `history_size` at least 1. */
void emcy_producer_init(struct emcy_producer *producer, uint8_t node, uint8_t *error_register,
                        uint32_t *history, uint8_t *history_count, uint8_t history_size);

/* A new error: sets `bits` (and the generic bit) in the error register, enters the history, queues a message. `detail`
 * may be NULL (zeros). */
void emcy_producer_raise(struct emcy_producer *producer, uint16_t code, uint8_t bits,
                         const uint8_t detail[EMCY_DETAIL_SIZE]);

/* The errors of `bits` have ended: clears these bits. With the last error it also clears the generic bit and queues "no
 * error" (0x0000). */
void emcy_producer_clear(struct emcy_producer *producer, uint8_t bits);

/* The client wrote 0 to 0x1003 sub 0 (CiA 301: other values are refused with SDO_ABORT_VALUE). */
void emcy_producer_forget(struct emcy_producer *producer);

/* Takes the next message of the queue: true, and *out is to be sent. False: the queue is empty. */
bool emcy_producer_process(struct emcy_producer *producer, struct can_msg *out);

/* Consumer: node (1 ... 127) and content of an EMCY frame, or 0 when `in` is none. Pure, any context. */
uint8_t emcy_decode(const struct can_msg *in, struct emcy *emcy);

/* One English phrase for an error code, by its class when the code is not known; never NULL. Pure.
 */
const char *emcy_text(uint16_t code);

#endif
