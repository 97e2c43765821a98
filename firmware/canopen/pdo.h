/* SPDX-License-Identifier: MIT */
/* pdo: the fixed process data of the bus (docs/reference/protocol.md, section 2).
 * 
 * `drive` is always the node id of the drive, on both sides. Decoding returns the drive's node id, or 0 when the frame
 * is not this PDO of a node, or PDO_ERR_SHORT when it is but has fewer bytes than the mapping (CiA 301: such a PDO is
 * not processed); longer ones are accepted, extra bytes ignored. Both directions are here, though the controller needs
 * one of each: the simulated drives of tests use the other, so that both sides share one definition. Used by
 * firmware/app, and by the simulated drives of the tests. Pure functions, any context. */
#ifndef CANOPEN_PDO_H
#define CANOPEN_PDO_H

#include <stdint.h>

#include "can/can_frame.h"
#include "canopen/cob.h"

#define PDO_ERR_SHORT (-1)

/* RPDO1 of a drive: 0x6040, 0x607A. */
struct pdo_setpoint {
    int32_t target_counts;
    uint16_t controlword;
};

/* TPDO1 of a drive: 0x6041, 0x6064. */
struct pdo_actual {
    int32_t position_counts;
    uint16_t statusword;
};

void pdo_encode_setpoint(uint8_t drive, const struct pdo_setpoint *setpoint, struct can_msg *out);
int pdo_decode_setpoint(const struct can_msg *in, struct pdo_setpoint *setpoint);

/* The same in steps, for a frame that is kept from tick to tick: first identifier and length (with zeros), then in each
 * tick only the values that have changed. */
void pdo_begin_setpoint(uint8_t drive, struct can_msg *out);
static inline void pdo_put_controlword(struct can_msg *out, uint16_t controlword)
{
    cob_put16(out->data, controlword);
}
static inline void pdo_put_target(struct can_msg *out, int32_t target_counts)
{
    cob_put32(out->data + 2, (uint32_t)target_counts);
}

/* RPDO1 with a third object, 0x60B2: the torque offset, per mille of the rated torque; added to the
 * frame of pdo_begin_setpoint or pdo_encode_setpoint. pdo_decode_setpoint takes both lengths. */
void pdo_add_torque(struct can_msg *out, int16_t torque_permille);
int pdo_decode_torque(const struct can_msg *in, int16_t *torque_permille);

/* RPDO2 of a drive: 0x60B1, the velocity offset. */
void pdo_encode_velocity(uint8_t drive, int32_t velocity_counts_s, struct can_msg *out);
int pdo_decode_velocity(const struct can_msg *in, int32_t *velocity_counts_s);

void pdo_encode_actual(uint8_t drive, const struct pdo_actual *actual, struct can_msg *out);
int pdo_decode_actual(const struct can_msg *in, struct pdo_actual *actual);

/* TPDO2 of a simulated drive: 0x2100, the motor voltage. */
void pdo_encode_volts(uint8_t drive, int16_t volts_mv, struct can_msg *out);
int pdo_decode_volts(const struct can_msg *in, int16_t *volts_mv);

/* TPDO3 of a drive: 0x60FD, the digital inputs. */
void pdo_encode_inputs(uint8_t drive, uint32_t inputs, struct can_msg *out);
int pdo_decode_inputs(const struct can_msg *in, uint32_t *inputs);

/* RPDO1 of an I/O module (CiA 401): 0x6200 subs 1, 2 (digital outputs 0 ... 7, 8 ... 15), 0x6411 subs 1, 2 ...
 * (analogue outputs): as many of them as are mapped, 8 bytes at most. */
struct pdo_outputs {
    uint16_t digital;
    const int16_t *analogue;
    uint32_t digital_bytes; /* 0 ... 2 */
    uint32_t analogue_count;
};
void pdo_encode_outputs(uint8_t module, const struct pdo_outputs *outputs, struct can_msg *out);

#endif
