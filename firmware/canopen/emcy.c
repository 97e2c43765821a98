/* SPDX-License-Identifier: MIT */
/* Implements canopen/emcy.h (see there): emergency messages, error register 0x1001 and history 0x1003. Used by
 * firmware/app and sim/node. No I/O: the caller sends. */
#include "canopen/emcy.h"

#include <assert.h>
#include <stddef.h>
#include <string.h>

#include "canopen/cob.h"

#define EMCY_BYTES 8u
#define QUEUE_SIZE (sizeof((struct emcy_producer *)0)->queue / sizeof(struct emcy))

void emcy_producer_init(struct emcy_producer *producer, uint8_t node, uint8_t *error_register,
                        uint32_t *history, uint8_t *history_count, uint8_t history_size)
{
    assert(history_size >= 1);
    memset(producer, 0, sizeof *producer);
    producer->error_register = error_register;
    producer->history = history;
    producer->history_count = history_count;
    producer->history_size = history_size;
    producer->node = node;
    *error_register = 0;
    emcy_producer_forget(producer);
}

/* Makes room for the newest: drops the oldest of the same code, which has the same information, else the oldest of
 * all. */
static void make_room(struct emcy_producer *producer, uint16_t code)
{
    uint8_t replaced = 0;
    for (uint8_t i = (uint8_t)QUEUE_SIZE; i-- > 0u;) {
        replaced = producer->queue[i].code == code ? i : replaced;
    }
    producer->queued--;
    memmove(&producer->queue[replaced], &producer->queue[replaced + 1u],
            (size_t)(producer->queued - replaced) * sizeof producer->queue[0]);
}

static void queue(struct emcy_producer *producer, uint16_t code, const uint8_t *detail)
{
    if (producer->queued == QUEUE_SIZE) {
        make_room(producer, code);
    }
    struct emcy *emcy = &producer->queue[producer->queued];
    emcy->code = code;
    emcy->error_register = *producer->error_register;
    memset(emcy->detail, 0, sizeof emcy->detail);
    if (detail != NULL) {
        memcpy(emcy->detail, detail, sizeof emcy->detail);
    }
    producer->queued++;
}

static void remember(struct emcy_producer *producer, uint16_t code, const uint8_t *detail)
{
    uint32_t more = detail == NULL ? 0 : (uint32_t)cob_get(detail, 2);

    for (uint8_t i = (uint8_t)(producer->history_size - 1u); i > 0; i--) {
        producer->history[i] = producer->history[i - 1];
    }
    producer->history[0] = code | (more << 16);
    if (*producer->history_count < producer->history_size) {
        (*producer->history_count)++;
    }
}

void emcy_producer_raise(struct emcy_producer *producer, uint16_t code, uint8_t bits,
                         const uint8_t detail[EMCY_DETAIL_SIZE])
{
    *producer->error_register = (uint8_t)(*producer->error_register | bits | EMCY_REGISTER_GENERIC);
    remember(producer, code, detail);
    queue(producer, code, detail);
}

void emcy_producer_clear(struct emcy_producer *producer, uint8_t bits)
{
    uint8_t before = *producer->error_register;
    uint8_t left = (uint8_t)(before & (uint8_t)~bits);

    if ((left & (uint8_t)~EMCY_REGISTER_GENERIC) == 0) {
        left = 0;
    }
    *producer->error_register = left;
    if (before != 0 && left == 0) {
        queue(producer, EMCY_NO_ERROR, NULL);
    }
}

void emcy_producer_forget(struct emcy_producer *producer)
{
    memset(producer->history, 0, producer->history_size * sizeof *producer->history);
    *producer->history_count = 0;
}

bool emcy_producer_process(struct emcy_producer *producer, struct can_msg *out)
{
    const struct emcy *first = &producer->queue[0];

    if (producer->queued == 0) {
        return false;
    }
    cob_frame(out, COB_EMCY + producer->node, EMCY_BYTES);
    cob_put(out->data, first->code, 2);
    out->data[2] = first->error_register;
    memcpy(out->data + 3, first->detail, EMCY_DETAIL_SIZE);
    producer->queued--;
    memmove(&producer->queue[0], &producer->queue[1], producer->queued * sizeof *first);
    return true;
}

uint8_t emcy_decode(const struct can_msg *in, struct emcy *emcy)
{
    if (in->id <= COB_EMCY || in->id > COB_EMCY + NODE_ID_MAX || in->len != EMCY_BYTES) {
        return 0;
    }
    emcy->code = (uint16_t)cob_get(in->data, 2);
    emcy->error_register = in->data[2];
    memcpy(emcy->detail, in->data + 3, EMCY_DETAIL_SIZE);
    return (uint8_t)(in->id - COB_EMCY);
}

struct error_text {
    uint16_t code;
    uint16_t mask; /* bits that must agree: the whole code, or its class */
    const char *text;
};

/* Single codes before the classes that contain them. */
static const struct error_text texts[] = {
    {EMCY_NO_ERROR, 0xFF00, "no error"},
    {EMCY_OVERLOAD, 0xFFFF, "continuous over-current (overload)"},
    {EMCY_DC_UNDERVOLTAGE, 0xFFFF, "DC link under-voltage"},
    {EMCY_POSITION_SENSOR, 0xFFFF, "position sensor"},
    {EMCY_POSITION_SENSOR_1, 0xFFFF, "position sensor"},
    {EMCY_CAN_OVERRUN, 0xFFFF, "CAN overrun: frames lost"},
    {EMCY_CAN_PASSIVE, 0xFFFF, "CAN in error passive mode"},
    {EMCY_HEARTBEAT, 0xFFFF, "heartbeat of another node lost"},
    {EMCY_BUS_OFF_RECOVERED, 0xFFFF, "recovered from bus off"},
    {EMCY_PDO_LENGTH, 0xFFFF, "PDO not processed: too short"},
    {EMCY_SYNC_LENGTH, 0xFFFF, "SYNC of unexpected length"},
    {EMCY_RPDO_TIMEOUT, 0xFFFF, "expected PDO did not come"},
    {EMCY_FOLLOWING_ERROR, 0xFFFF, "following error"},
    {EMCY_POSITION_LIMIT, 0xFFFF, "position limit"},
    {EMCY_SYNC_LOST, 0xFFFF, "SYNC lost"},
    {0x1000, 0xF000, "generic error"},
    {0x2000, 0xF000, "current"},
    {0x3000, 0xF000, "voltage"},
    {0x4000, 0xF000, "temperature"},
    {0x5000, 0xF000, "device hardware"},
    {0x6000, 0xF000, "device software"},
    {0x7000, 0xF000, "additional modules"},
    {0x8100, 0xFF00, "communication"},
    {0x8000, 0xF000, "monitoring"},
    {0x9000, 0xF000, "external error"},
    {0xF000, 0xF000, "manufacturer specific or additional functions"},
};

const char *emcy_text(uint16_t code)
{
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        if ((code & texts[i].mask) == texts[i].code) {
            return texts[i].text;
        }
    }
    return "unknown error code";
}
