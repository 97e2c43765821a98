/* SPDX-License-Identifier: MIT */
/* drive_pdos: the PDOs of a simulated drive: four in each direction, remappable (canopen/pdo_map.h). Received values
 * act on the servo: a controlword at once or at SYNC, a target from the next period on. Called by node/drive_node and
 * node/drive_od. All in one context. Changes its struct, the dictionary and the servo, and sends frames through its
 * port; no other I/O.
 */
#ifndef NODE_DRIVE_PDOS_H
#define NODE_DRIVE_PDOS_H

#include <stdbool.h>
#include <stdint.h>

#include "can/can_frame.h"
#include "canopen/pdo_map.h"
#include "node/servo.h"

#define DRIVE_PDOS 4 /* in each direction */

/* Where the frames of a drive go. */
struct drive_node_port {
    void (*send)(void *context, const struct can_msg *frame);
    void *context;
};

/* Read `rpdos`; clear `moved`; all other fields are private. */
struct drive_pdos {
    struct pdo_map rpdos[DRIVE_PDOS];
    struct pdo_map tpdos[DRIVE_PDOS];
    struct servo *servo; /* borrowed */
    struct drive_node_port port;
    bool moved;           /* identifiers of RPDOs changed: for the owner's filters, who clears it */
    bool want_all;        /* a TPDO maps values that are not updated at each SYNC */
    uint8_t target_rpdos; /* a bit for each RPDO that maps the target 0x607A */
    uint8_t received;     /* a bit for each RPDO that came since the last drive_pdos_process */
    uint8_t rpdo_count;   /* PDOs in use: those above are off */
    uint8_t tpdo_count;
};

/* Takes parameters and mapping from the object dictionary; again after it got its defaults. */
void drive_pdos_init(struct drive_pdos *pdos, struct od *od, struct servo *servo,
                     struct drive_node_port port);

/* The NMT state changes: deadlines and counters restart. */
void drive_pdos_restart(struct drive_pdos *pdos);

/* For the hooks of the dictionary, 0x1400 ... 0x1BFF: checks a write (SDO_OK or an abort code); applies a write that
 * has been stored. */
uint32_t drive_pdos_write(const struct drive_pdos *pdos, const struct od_entry *entry,
                          const uint8_t *value, uint32_t size);
void drive_pdos_written(struct drive_pdos *pdos, const struct od_entry *entry);

/* A frame. Returns whether it was an RPDO. */
bool drive_pdos_receive(struct drive_pdos *pdos, const struct can_msg *in);

/* At SYNC, in this order: sends the synchronous TPDOs; applies the received values of the synchronous RPDOs. */
void drive_pdos_report(struct drive_pdos *pdos);
void drive_pdos_latch(struct drive_pdos *pdos);

/* Wall time passes: event-driven TPDOs, deadlines of RPDOs. For an RPDO that came since the last call it counts from
 * this call on, so that a deadline is never early. */
void drive_pdos_process(struct drive_pdos *pdos, uint32_t elapsed_us);

#endif
