/* SPDX-License-Identifier: MIT */
#include "app/drives/drive_pdo.h"

#include "app/drives/drive_properties.h"

#define MAPPING             0x200u /* from communication to mapping parameter */
#define FIRST_TPDO          0x1800u
#define SUB_COB             1u
#define SUB_TYPE            2u
#define SUB_INHIBIT         3u
#define SUB_EVENT_TIMER     5u
#define INHIBIT_UNITS_IN_MS 10u

enum { ITEM_DISABLE, ITEM_TYPE, ITEM_UNMAP, ITEM_ENTRIES };

/* What follows the entries. */
enum { AFTER_COUNT, AFTER_INHIBIT, AFTER_EVENT_TIMER, AFTER_ENABLE, AFTER_ALL };

static void write_number(struct drive_op *op, uint32_t index, uint32_t sub, uint8_t size,
                         uint32_t value)
{
    *op = (struct drive_op){.kind = DRIVE_OP_WRITE,
                            .index = (uint16_t)index,
                            .sub = (uint8_t)sub,
                            .size = size,
                            .fact = DRIVE_NO_FACT,
                            .value = value,
                            .mask = UINT32_MAX};
}

static uint32_t cob_of(const struct drive_pdo *pdo, uint8_t node)
{
    const uint32_t flags = pdo->communication >= FIRST_TPDO ? DRIVE_PDO_NO_RTR : 0u;
    return flags | (pdo->cob + (uint32_t)node);
}

/* A PDO that shall be off only has to be invalid; what it would map does not matter. */
static bool turn_off(const struct drive_pdo *pdo, uint8_t node, uint8_t item, struct drive_op *op)
{
    write_number(op, pdo->communication, SUB_COB, 4, DRIVE_PDO_INVALID | cob_of(pdo, node));
    op->mask = DRIVE_PDO_INVALID;
    op->optional = true;
    return item == ITEM_DISABLE;
}

/* Times that a drive lacks leave a PDO that works. */
static void write_time(struct drive_op *op, const struct drive_pdo *pdo, uint32_t sub,
                       uint32_t value)
{
    write_number(op, pdo->communication, sub, 2, value);
    op->optional = true;
    op->kind = value != 0u ? DRIVE_OP_WRITE : DRIVE_OP_PREPARE;
}

static bool after_entries(const struct drive_pdo *pdo, uint8_t node, uint16_t setpoint_timeout_ms,
                          uint32_t item, struct drive_op *op)
{
    switch (item) {
    case AFTER_COUNT:
        write_number(op, pdo->communication + MAPPING, 0, 1, pdo->count);
        return true;
    case AFTER_INHIBIT:
        write_time(op, pdo, SUB_INHIBIT, pdo->inhibit_ms * INHIBIT_UNITS_IN_MS);
        return true;
    case AFTER_EVENT_TIMER:
        write_time(op, pdo, SUB_EVENT_TIMER, pdo->event_timer ? setpoint_timeout_ms : 0u);
        return true;
    case AFTER_ENABLE:
        write_number(op, pdo->communication, SUB_COB, 4, cob_of(pdo, node));
        op->mask = ~DRIVE_PDO_NO_RTR;
        return true;
    case AFTER_ALL:
    default:
        return false;
    }
}

bool drive_pdo_op(const struct drive_pdo *pdo, uint8_t node, uint16_t setpoint_timeout_ms,
                  uint8_t item, struct drive_op *op)
{
    if (pdo->count == 0u) {
        return turn_off(pdo, node, item, op);
    }
    switch (item) {
    case ITEM_DISABLE:
        write_number(op, pdo->communication, SUB_COB, 4, DRIVE_PDO_INVALID | cob_of(pdo, node));
        op->kind = DRIVE_OP_PREPARE;
        return true;
    case ITEM_TYPE:
        write_number(op, pdo->communication, SUB_TYPE, 1, pdo->type);
        return true;
    case ITEM_UNMAP:
        write_number(op, pdo->communication + MAPPING, 0, 1, 0);
        op->kind = DRIVE_OP_PREPARE;
        return true;
    default:
        break;
    }
    uint32_t entry = item - (uint32_t)ITEM_ENTRIES;
    if (entry < pdo->count) {
        write_number(op, pdo->communication + MAPPING, entry + 1u, 4, pdo->entries[entry]);
        return true;
    }
    entry -= pdo->count;
    if (pdo->inhibit_ms == 0u && entry >= AFTER_INHIBIT) {
        entry++;
    }
    return after_entries(pdo, node, setpoint_timeout_ms, entry, op);
}
