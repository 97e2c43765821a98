/* SPDX-License-Identifier: MIT */
/* Implements canopen/pdo.h (see there): the fixed process data of the bus. Used by firmware/app, and by the simulated
 * drives of the tests. Pure functions, any context. */
#include "canopen/pdo.h"

#include "canopen/cob.h"

#define WORD_AND_POSITION_BYTES 6u
#define WITH_TORQUE_BYTES       8u
#define VOLTS_BYTES             2u
#define VELOCITY_BYTES          4u
#define INPUTS_BYTES            4u

/* Node id, 0 or PDO_ERR_SHORT, as pdo.h has it. */
static int node_of(const struct can_msg *in, uint32_t cob, uint8_t bytes)
{
    if (in->id <= cob || in->id > cob + NODE_ID_MAX) {
        return 0;
    }
    return in->len < bytes ? PDO_ERR_SHORT : (int)(in->id - cob);
}

static int32_t get_position(const struct can_msg *in)
{
    return (int32_t)cob_get32(in->data + 2);
}

void pdo_begin_setpoint(uint8_t drive, struct can_msg *out)
{
    cob_frame(out, COB_RPDO1 + drive, WORD_AND_POSITION_BYTES);
}

void pdo_encode_setpoint(uint8_t drive, const struct pdo_setpoint *setpoint, struct can_msg *out)
{
    pdo_begin_setpoint(drive, out);
    pdo_put_controlword(out, setpoint->controlword);
    pdo_put_target(out, setpoint->target_counts);
}

int pdo_decode_setpoint(const struct can_msg *in, struct pdo_setpoint *setpoint)
{
    int drive = node_of(in, COB_RPDO1, WORD_AND_POSITION_BYTES);

    if (drive > 0) {
        setpoint->controlword = cob_get16(in->data);
        setpoint->target_counts = get_position(in);
    }
    return drive;
}

void pdo_add_torque(struct can_msg *out, int16_t torque_permille)
{
    out->len = WITH_TORQUE_BYTES;
    cob_put16(out->data + WORD_AND_POSITION_BYTES, (uint16_t)torque_permille);
}

int pdo_decode_torque(const struct can_msg *in, int16_t *torque_permille)
{
    int drive = node_of(in, COB_RPDO1, WITH_TORQUE_BYTES);

    if (drive > 0) {
        *torque_permille = (int16_t)cob_signed(cob_get(in->data + WORD_AND_POSITION_BYTES, 2), 2);
    }
    return drive;
}

void pdo_encode_velocity(uint8_t drive, int32_t velocity_counts_s, struct can_msg *out)
{
    cob_frame(out, COB_RPDO2 + drive, VELOCITY_BYTES);
    cob_put32(out->data, (uint32_t)velocity_counts_s);
}

int pdo_decode_velocity(const struct can_msg *in, int32_t *velocity_counts_s)
{
    int drive = node_of(in, COB_RPDO2, VELOCITY_BYTES);

    if (drive > 0) {
        *velocity_counts_s = (int32_t)cob_signed(cob_get(in->data, VELOCITY_BYTES), VELOCITY_BYTES);
    }
    return drive;
}

void pdo_encode_inputs(uint8_t drive, uint32_t inputs, struct can_msg *out)
{
    cob_frame(out, COB_TPDO3 + drive, INPUTS_BYTES);
    cob_put(out->data, inputs, INPUTS_BYTES);
}

int pdo_decode_inputs(const struct can_msg *in, uint32_t *inputs)
{
    int drive = node_of(in, COB_TPDO3, INPUTS_BYTES);

    if (drive > 0) {
        *inputs = (uint32_t)cob_get(in->data, INPUTS_BYTES);
    }
    return drive;
}

void pdo_encode_actual(uint8_t drive, const struct pdo_actual *actual, struct can_msg *out)
{
    cob_frame(out, COB_TPDO1 + drive, WORD_AND_POSITION_BYTES);
    cob_put16(out->data, actual->statusword);
    cob_put32(out->data + 2, (uint32_t)actual->position_counts);
}

int pdo_decode_actual(const struct can_msg *in, struct pdo_actual *actual)
{
    int drive = node_of(in, COB_TPDO1, WORD_AND_POSITION_BYTES);

    if (drive > 0) {
        actual->statusword = cob_get16(in->data);
        actual->position_counts = get_position(in);
    }
    return drive;
}

void pdo_encode_volts(uint8_t drive, int16_t volts_mv, struct can_msg *out)
{
    cob_frame(out, COB_TPDO2 + drive, VOLTS_BYTES);
    cob_put(out->data, (uint16_t)volts_mv, 2);
}

int pdo_decode_volts(const struct can_msg *in, int16_t *volts_mv)
{
    int drive = node_of(in, COB_TPDO2, VOLTS_BYTES);

    if (drive > 0) {
        *volts_mv = (int16_t)cob_signed(cob_get(in->data, 2), 2);
    }
    return drive;
}

void pdo_encode_outputs(uint8_t module, const struct pdo_outputs *outputs, struct can_msg *out)
{
    out->id = (uint16_t)(COB_RPDO1 + module);
    out->len = (uint8_t)(outputs->digital_bytes + 2u * outputs->analogue_count);
    for (uint32_t i = 0; i < outputs->digital_bytes; ++i) {
        out->data[i] = (uint8_t)(outputs->digital >> (8u * i));
    }
    for (uint32_t i = 0; i < outputs->analogue_count; ++i) {
        cob_put16(out->data + outputs->digital_bytes + 2u * i, (uint16_t)outputs->analogue[i]);
    }
}
