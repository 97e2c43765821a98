/* SPDX-License-Identifier: MIT */
/* Implements node/drive_pdos.h (see there): the PDOs of a simulated drive. Called by node/drive_node and node/drive_od.
 * All in one context. Changes its struct, the dictionary and the servo, and sends frames through its port; no other
 * I/O. */
#include "node/drive_pdos.h"

enum { FIRST_RPDO = 0x1400, FIRST_TPDO = 0x1800 };

static void send(const struct drive_pdos *pdos, const struct can_msg *frame)
{
    pdos->port.send(pdos->port.context, frame);
}

/* Fields that servo_refresh_cyclic brings up to date, and the switches, which each period does. */
static bool is_cyclic(const struct od_drive *v, const void *field)
{
    return field == &v->statusword || field == &v->position_actual_value ||
           field == &v->motor_voltage || field == &v->digital_inputs;
}

static bool maps_target(const struct od_drive *v, const struct pdo_map *map)
{
    bool found = false;
    for (int k = 0; k < map->count; k++) {
        found = found || map->fields[k].value == (const uint8_t *)&v->target_position;
    }
    return found;
}

static bool maps_more_than_cyclic(const struct od_drive *v, const struct pdo_map *map)
{
    bool found = false;
    for (int k = 0; k < map->count; k++) {
        found = found || !is_cyclic(v, map->fields[k].value);
    }
    return found;
}

/* Evaluates which values the mapping contains. */
static void evaluate_mapping(struct drive_pdos *pdos)
{
    const struct od_drive *values = pdos->servo->values;
    pdos->moved = true;
    pdos->want_all = false;
    pdos->target_rpdos = 0;
    pdos->rpdo_count = 0;
    pdos->tpdo_count = 0;
    for (uint8_t i = 0; i < DRIVE_PDOS; i++) {
        const struct pdo_map *rpdo = &pdos->rpdos[i];
        const struct pdo_map *tpdo = &pdos->tpdos[i];
        pdos->rpdo_count = rpdo->valid ? (uint8_t)(i + 1u) : pdos->rpdo_count;
        pdos->tpdo_count = tpdo->valid ? (uint8_t)(i + 1u) : pdos->tpdo_count;
        if (maps_target(values, rpdo)) {
            pdos->target_rpdos |= (uint8_t)(1u << i);
        }
        pdos->want_all = pdos->want_all || (tpdo->valid && maps_more_than_cyclic(values, tpdo));
    }
}

void drive_pdos_init(struct drive_pdos *pdos, struct od *od, struct servo *servo,
                     struct drive_node_port port)
{
    pdos->servo = servo;
    pdos->port = port;
    for (uint16_t i = 0; i < DRIVE_PDOS; i++) {
        pdo_map_init(&pdos->rpdos[i], od, (uint16_t)(FIRST_RPDO + i));
        pdo_map_init(&pdos->tpdos[i], od, (uint16_t)(FIRST_TPDO + i));
    }
    evaluate_mapping(pdos);
}

void drive_pdos_restart(struct drive_pdos *pdos)
{
    for (int i = 0; i < DRIVE_PDOS; i++) {
        pdo_map_restart(&pdos->rpdos[i]);
        pdo_map_restart(&pdos->tpdos[i]);
    }
}

uint32_t drive_pdos_write(const struct drive_pdos *pdos, const struct od_entry *entry,
                          const uint8_t *value, uint32_t size)
{
    uint32_t code = 0;
    for (int i = 0; i < DRIVE_PDOS && code == 0; i++) {
        code = pdo_map_write(&pdos->rpdos[i], entry, value, size);
        code = code == 0 ? pdo_map_write(&pdos->tpdos[i], entry, value, size) : code;
    }
    return code;
}

void drive_pdos_written(struct drive_pdos *pdos, const struct od_entry *entry)
{
    for (int i = 0; i < DRIVE_PDOS; i++) {
        (void)pdo_map_written(&pdos->rpdos[i], entry);
        (void)pdo_map_written(&pdos->tpdos[i], entry);
    }
    evaluate_mapping(pdos);
}

/* Values of RPDO number `i` are in their fields now. */
static void note_applied(const struct drive_pdos *pdos, int i)
{
    if ((pdos->target_rpdos >> i & 1u) != 0u) {
        pdos->servo->setpoint_fresh = true;
    }
}

bool drive_pdos_receive(struct drive_pdos *pdos, const struct can_msg *in)
{
    struct servo *servo = pdos->servo;
    bool ours = false;
    for (int i = 0; i < pdos->rpdo_count; i++) {
        struct pdo_map *map = &pdos->rpdos[i];
        const enum pdo_map_result result = pdo_map_receive(map, in);
        ours = ours || result != PDO_MAP_NOT;
        if (result == PDO_MAP_SHORT) {
            drive_errors_rpdo_short(&servo->errors, i, map, in);
            continue;
        }
        if (result == PDO_MAP_TAKEN) {
            pdos->received |= (uint8_t)(1u << i);
        }
        if (result == PDO_MAP_TAKEN && servo->errors.short_rpdos != 0u) {
            drive_errors_rpdo_good(&servo->errors, i);
        }
        if (result == PDO_MAP_TAKEN && !map->pending) {
            note_applied(pdos, i);
            servo_control(servo, servo->values->controlword);
        }
    }
    return ours;
}

void drive_pdos_latch(struct drive_pdos *pdos)
{
    for (int i = 0; i < pdos->rpdo_count; i++) {
        if (pdo_map_apply(&pdos->rpdos[i])) {
            note_applied(pdos, i);
        }
    }
    servo_control(pdos->servo, pdos->servo->values->controlword);
}

void drive_pdos_report(struct drive_pdos *pdos)
{
    struct can_msg frame;
    if (pdos->want_all) {
        servo_refresh(pdos->servo);
    } else {
        servo_refresh_cyclic(pdos->servo);
    }
    for (int i = 0; i < pdos->tpdo_count; i++) {
        if (pdo_map_sync(&pdos->tpdos[i], &frame) != 0) {
            send(pdos, &frame);
        }
    }
}

static void process_events(struct drive_pdos *pdos, uint32_t elapsed_us)
{
    struct can_msg frame;
    for (int i = 0; i < pdos->tpdo_count; i++) {
        if (!pdo_map_event_driven(&pdos->tpdos[i])) {
            continue;
        }
        servo_refresh(pdos->servo);
        if (pdo_map_process(&pdos->tpdos[i], elapsed_us, &frame) != 0) {
            send(pdos, &frame);
        }
    }
}

void drive_pdos_process(struct drive_pdos *pdos, uint32_t elapsed_us)
{
    process_events(pdos, elapsed_us);
    const uint8_t received = pdos->received;
    pdos->received = 0;
    for (int i = 0; i < pdos->rpdo_count; i++) {
        const uint32_t without_us = (received >> i & 1u) != 0u ? 0u : elapsed_us;
        if (pdo_map_overdue(&pdos->rpdos[i], without_us)) {
            servo_disconnect(pdos->servo, EMCY_RPDO_TIMEOUT);
        }
    }
}
