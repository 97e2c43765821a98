/* SPDX-License-Identifier: MIT */
/* io_module: a simulated I/O module (CiA 401) with 16 digital and 3 analogue outputs, for one bus. Used by node/drives.
 * Changes the module, and sends frames through its port; no other I/O.
 *
 * Synchronous RPDOs act at the next SYNC, others at once. Outputs take their error values (0x6206, 0x6207, 0x6443,
 * 0x6444) when the heartbeat of the master is lost and when the node is STOPPED; at power-on and at a reset they are
 * off. All functions in one context.
 */
#ifndef NODE_IO_MODULE_H
#define NODE_IO_MODULE_H

#include <stdbool.h>
#include <stdint.h>

#include "can/can_frame.h"
#include "canopen/heartbeat.h"
#include "canopen/nmt.h"
#include "canopen/od.h"
#include "canopen/pdo_map.h"
#include "canopen/sdo_server.h"
#include "node/drive_pdos.h"
#include "od_module.h"

#define IO_MODULE_RPDOS 4

/* Private, except `values` (the object dictionary: 0x6200 and 0x6411 are the outputs), `id`, and `rpdos` for filters.
 * Has pointers to itself: not to be copied. */
struct io_module {
    struct od_module values;
    struct od od;
    struct nmt_slave nmt;
    struct sdo_server sdo;
    struct heartbeat_producer heartbeat;
    struct heartbeat_consumer master;
    struct pdo_map rpdos[IO_MODULE_RPDOS];
    struct drive_node_port port;
    bool master_seen; /* a heartbeat of the master, since the last io_module_process */
    bool moved;       /* RPDOs have other identifiers: filters have to be set again */
    uint8_t id;       /* 0: there is no module */
};

/* id: 1 ... 127. The boot-up frame leaves with the first io_module_process. */
void io_module_init(struct io_module *module, uint8_t id, struct drive_node_port port);

/* A frame from the bus; ignores those for other nodes. */
void io_module_receive(struct io_module *module, const struct can_msg *in);

/* Lets wall time pass. Call it at least every 20 ms. */
void io_module_process(struct io_module *module, uint32_t elapsed_us);

#endif
