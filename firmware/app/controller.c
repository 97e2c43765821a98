/* SPDX-License-Identifier: MIT */
#include "app/controller.h"

#include <string.h>

#include "app/controller_reset.h"
#include "app/objects.h"
#include "canopen/cob.h"
#include "port/port.h"

#define SDO_TIMEOUT_US     2000000u
#define SDO_BLOCK_SEGMENTS 127u
#define SEND_TRIES         40u
#define SEND_PAUSE_US      500u

/* The node number is itself a parameter that is restored; a new one holds from the next power-on. */
static void init_values(struct controller *controller, uint8_t port_node)
{
    od_init(&controller->od, &od_controller_table, &controller->values, &objects_hooks, controller);
    parameter_store_find(&controller->store, &controller->od);
    controller->node = port_node;
    controller_reset_values(controller);
    if (controller->values.node_number != 0u) {
        controller->node = controller->values.node_number;
        controller_reset_values(controller);
    }
}

bool controller_configured(const struct controller *controller)
{
    return controller->configured.known && controller->configured.crc32 == controller->config.crc32;
}

void controller_init(struct controller *controller, uint8_t node)
{
    memset(controller, 0, sizeof *controller);
    init_values(controller, node);
    config_read(&controller->config, &controller->od);
    machine_init(&controller->machine, &controller->config);
    tick_init(&controller->tick, &controller->machine);
    frame_queue_init(&controller->queue);
    program_slot_init(&controller->slot);
    program_slot_recover(&controller->slot);
    controller->slot.attend = controller_beat;
    controller->slot.self = controller;
    drive_boot_init(&controller->boot);
    drive_polling_init(&controller->look);
    homing_init(&controller->homing);
    drive_monitor_begin(&controller->watch, &controller->config,
                        controller->values.consumer_heartbeat_time);
    sdo_server_init(&controller->server, &controller->od, controller->node, SDO_TIMEOUT_US,
                    SDO_BLOCK_SEGMENTS);
    nmt_slave_init(&controller->nmt, controller->node, &controller_reset_hooks, controller);
    heartbeat_producer_init(&controller->heartbeat, controller->node);
}

/* TPDO3, or what looks like one. */
static void take_inputs(struct machine *machine, int node, uint32_t inputs)
{
    struct axis *axis = node > 0 ? machine_axis(machine, (uint8_t)node) : NULL;
    if (axis != NULL) {
        axis->digital_inputs = inputs;
    }
}

/* A drive that boots has lost its zero; said here, since a frame that the queue has no room for is lost. */
static void take_boot_up(struct machine *machine, const struct can_msg *message)
{
    const bool boot_up = (message->id & ~NODE_ID_MAX) == COB_HEARTBEAT && message->len == 1u &&
                         (message->data[0] & 0x7Fu) == (uint8_t)NMT_INITIALISING;
    struct axis *axis =
        boot_up ? machine_axis(machine, (uint8_t)(message->id & NODE_ID_MAX)) : NULL;
    if (axis != NULL) {
        axis->homed = false;
    }
}

static void receive_other(struct controller *controller, const struct can_msg *message)
{
    uint32_t inputs;
    take_boot_up(&controller->machine, message);
    const int node = pdo_decode_inputs(message, &inputs);
    if (node != 0) {
        take_inputs(&controller->machine, node, inputs);
    } else if (frame_queue_put(&controller->queue, message)) {
        port_wake();
    }
}

/* Receive: process data at once, the rest waits for the mainline. */
static void on_receive(void *self, const struct can_msg *message, uint32_t now_us)
{
    struct controller *controller = self;
    struct pdo_actual actual;
    const int node = pdo_decode_actual(message, &actual);
    if (node == 0) {
        receive_other(controller, message);
    } else if (node > 0 && machine_receive(&controller->machine, (uint8_t)node, &actual, now_us)) {
        port_tick_ready();
    }
}

static void on_tick(void *self, uint32_t now_us, uint32_t late_ns)
{
    struct controller *controller = self;
    tick_run(&controller->tick, now_us, late_ns);
}

int controller_start(struct controller *controller)
{
    const struct can_match filters[] = {
        {COB_NMT, CAN_ID_MAX},    {COB_EMCY, 0x780u},
        {COB_TPDO1, 0x780u},      {COB_TPDO3, 0x780u},
        {COB_SDO_ANSWER, 0x780u}, {(uint16_t)(COB_SDO_ASK + controller->node), CAN_ID_MAX},
        {COB_HEARTBEAT, 0x780u},
    };
    const struct port_handlers handlers = {
        .self = controller, .receive = on_receive, .tick = on_tick};
    controller->polled_us = port_time_us();
    const int result = port_can_accept(filters, sizeof filters / sizeof filters[0]);
    return result != 0 ? result : port_start(&handlers, controller->config.period_us);
}

void controller_send(const struct can_msg *message)
{
    for (unsigned i = 0; i < SEND_TRIES && port_can_send(message) != 0; ++i) {
        port_wait(SEND_PAUSE_US);
    }
}
