/* SPDX-License-Identifier: MIT */
/* Implements app/controller.h (see there): the wiring of machine, tick, protocol objects and port. Used by app/main.c.
 * Main loop. Starts the port, sends frames, and changes the one controller. */
#include "app/controller.h"

#include <stddef.h>
#include <string.h>

#include "app/commands.h"
#include "app/objects.h"
#include "app/report.h"
#include "canopen/cob.h"
#include "port/port.h"

#define SDO_TIMEOUT_US     2000000u  /* between two requests of a transfer, then it is aborted */
#define SDO_BLOCK_SEGMENTS 127u      /* of a block of a block transfer; CiA 301: at most 127 */
#define LAST_OBJECT        0xFFFFu   /* greatest index: parameters of all objects */
#define OFF_TIME_US        1000000u  /* at a shutdown, for all drives to switch off */
#define STOP_BOUND_MOST_US 60000000u /* greatest stop time bound that a shutdown waits for */

/* ---- Values at power-on and at a reset ---- */

/* At power-on, and at the NMT services reset node and reset communication (CiA 301, 7.3.2.2), all objects, or those
 * below 0x2000, get their stored values (0x1010) or else their defaults. The program stays: it is no parameter. The
 * resets come while the machine is configurable only. */

/* Reads the whole configuration from the objects again; the drives have to be configured by it. */
static void take_configuration(struct controller *controller)
{
    config_read(&controller->config, &controller->od);
    port_lock();
    machine_configure(&controller->machine, &controller->config, true);
    machine_override(&controller->machine, controller->values.override.percent);
    port_tick_period(controller->config.period_us);
    port_unlock();
}

static void forget_errors(struct controller *controller)
{
    struct od_controller *values = &controller->values;
    emcy_producer_init(&controller->emcy, controller->node, &values->error_register,
                       values->predefined_error_field, &values->predefined_error_field_count,
                       (uint8_t)(sizeof values->predefined_error_field /
                                 sizeof values->predefined_error_field[0]));
    controller->reported_serial--; /* a fault that is still there is reported again */
}

/* All values to the stored ones or their defaults, for this node; no errors. */
static void reset_values(struct controller *controller)
{
    controller->values = od_controller_defaults;
    const bool restored =
        parameter_store_restore(&controller->store, &controller->od, 0, LAST_OBJECT);
    controller->configured = (struct configured){.known = restored && controller->store.confirmed,
                                                 .restored = restored,
                                                 .crc32 = controller->store.config_crc32};
    controller->quiet_us = 0;
    controller->quiet_due = !restored;
    od_controller_set_node(&controller->values, controller->node);
    forget_errors(controller);
}

static void reset_node(void *self)
{
    struct controller *controller = self;
    reset_values(controller);
    controller->stream.optional_stop = controller->values.stream.optional_stop != 0u;
    take_configuration(controller);
}

static void reset_communication(void *self)
{
    struct controller *controller = self;
    od_reset_communication(&controller->od, &od_controller_defaults);
    (void)parameter_store_restore(&controller->store, &controller->od, 0,
                                  OD_FIRST_MANUFACTURER - 1u);
    od_controller_set_node(&controller->values, controller->node);
    forget_errors(controller);
    take_configuration(controller);
}

static const struct nmt_hooks reset_hooks = {
    .reset_node = reset_node,
    .reset_communication = reset_communication,
};

/* ---- Power-on ---- */

/* The node number is itself a parameter that is restored; a new one holds from the next power-on. */
static void init_values(struct controller *controller, uint8_t port_node)
{
    od_init(&controller->od, &od_controller_table, &controller->values, &objects_hooks, controller);
    parameter_store_find(&controller->store, &controller->od);
    controller->node = port_node;
    reset_values(controller);
    if (controller->values.node_number != 0u) {
        controller->node = controller->values.node_number;
        reset_values(controller);
    }
}

/* Called during the check of a chunk, while the motion continues: the main loop runs, and the chunk before this one
 * may be due. */
static void beat_in_stream(void *self)
{
    struct controller *controller = self;
    controller_beat(controller);
    port_lock();
    machine_note_main_loop(&controller->machine);
    commands_execute_urgent(&controller->machine, controller->urgent);
    controller->urgent = 0;
    port_unlock();
    stream_process(&controller->stream, &controller->machine);
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
    controller->slot.user.attend = controller_beat;
    controller->slot.user.self = controller;
    stream_init(&controller->stream);
    controller->stream.attend = beat_in_stream;
    controller->stream.self = controller;
    drive_boot_init(&controller->boot);
    drive_polling_init(&controller->polling);
    homing_init(&controller->homing);
    drive_monitor_begin(&controller->monitor, &controller->config,
                        controller->values.consumer_heartbeat_time);
    sdo_server_init(&controller->server, &controller->od, controller->node, SDO_TIMEOUT_US,
                    SDO_BLOCK_SEGMENTS);
    nmt_slave_init(&controller->nmt, controller->node, &reset_hooks, controller);
    heartbeat_producer_init(&controller->heartbeat, controller->node);
}

/* ---- Interrupts ---- */

/* TPDO3, or a frame with its identifier. */
static void take_inputs(struct machine *machine, int node, uint32_t inputs)
{
    struct axis *axis = node > 0 ? machine_axis(machine, (uint8_t)node) : NULL;
    if (axis != NULL) {
        axis->digital_inputs = inputs;
    }
}

/* A drive that boots has lost its zero. Noted here, because the queue may lose the frame. */
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

/* The frame is queued as well, and answered in its order; executing the command twice has no effect. */
static void note_urgent(struct controller *controller, const struct can_msg *message)
{
    if (controller->checks_chunk && command_urgent_request(message, controller->node)) {
        controller->urgent |= (uint16_t)(1u << message->data[4]);
    }
}

static void receive_other(struct controller *controller, const struct can_msg *message)
{
    uint32_t inputs;
    note_urgent(controller, message);
    take_boot_up(&controller->machine, message);
    const int node = pdo_decode_inputs(message, &inputs);
    if (node != 0) {
        take_inputs(&controller->machine, node, inputs);
    } else if (frame_queue_put(&controller->queue, message)) {
        port_wake();
    }
}

/* Receive: process data at once, all other frames wait for the main loop. */
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
    if (machine_on_path(&controller->machine) &&
        motion_wants_records(&controller->machine.motion)) {
        port_wake();
    }
}

int controller_start(struct controller *controller)
{
    const struct can_match filters[] = {
        {COB_NMT, CAN_ID_MAX},      {COB_EMCY, 0x780u},
        {COB_TPDO1, 0x780u},        {COB_TPDO3, 0x780u},
        {COB_SDO_RESPONSE, 0x780u}, {(uint16_t)(COB_SDO_REQUEST + controller->node), CAN_ID_MAX},
        {COB_HEARTBEAT, 0x780u},
    };
    const struct port_handlers handlers = {
        .self = controller, .receive = on_receive, .tick = on_tick};
    controller->polled_us = port_time_us();
    const int result = port_can_accept(filters, sizeof filters / sizeof filters[0]);
    return result != 0 ? result : port_start(&handlers, controller->config.period_us);
}

/* ---- Main loop: one round of all protocol objects ---- */

/* The node is its own NMT master: it enters OPERATIONAL by itself, and executes resets from outside
 * while its drives are off. */
static bool nmt_command_allowed(struct controller *controller, const struct can_msg *in)
{
    const bool reset = in->len >= 2u && (in->data[0] == (uint8_t)NMT_RESET_NODE ||
                                         in->data[0] == (uint8_t)NMT_RESET_COMMUNICATION);
    port_lock();
    const bool idle = machine_configurable(&controller->machine);
    port_unlock();
    return reset && idle;
}

static void take_nmt(struct controller *controller, const struct can_msg *in)
{
    if (!nmt_command_allowed(controller, in) || !nmt_slave_receive(&controller->nmt, in)) {
        return;
    }
    sdo_server_reset(&controller->server);
    port_lock();
    if (controller->machine.state == MACHINE_OFF) {
        machine_enter_boot(&controller->machine);
    }
    port_unlock();
}

/* Only one of the three has a request under way. */
static void take_answer(struct controller *controller, const struct can_msg *in)
{
    struct can_msg out;
    if (drive_boot_receive(&controller->boot, in, &out) ||
        homing_receive(&controller->homing, in, &out) ||
        drive_polling_receive(&controller->polling, in, &out)) {
        controller_send(&out);
    }
}

static void take_frame(struct controller *controller, const struct can_msg *in)
{
    struct can_msg out;
    if (in->id == 0u) {
        take_nmt(controller, in);
    } else if (sdo_server_wants(&controller->server, in)) {
        if (sdo_server_receive(&controller->server, in, &out)) {
            controller_send(&out);
        }
    } else {
        take_answer(controller, in);
        drive_monitor_receive(&controller->monitor, &controller->machine, in);
    }
}

static bool next_frame(struct controller *controller, struct can_msg *in)
{
    port_lock();
    machine_note_main_loop(&controller->machine);
    const bool got = frame_queue_take(&controller->queue, in);
    port_unlock();
    return got;
}

static void poll_nmt(struct controller *controller)
{
    struct can_msg out;
    if (nmt_slave_process(&controller->nmt, &out)) {
        controller_send(&out);
        controller_start_itself(controller);
        if (controller->quiet_due) { /* at once: before a drive monitors the heartbeats */
            controller_heartbeat(controller, controller->values.producer_heartbeat_time * 1000u);
        }
    }
}

static void poll_server(struct controller *controller, uint32_t elapsed_us)
{
    struct can_msg out;
    bool due = sdo_server_process(&controller->server, elapsed_us, &out);
    while (due) {
        controller_send(&out);
        due = sdo_server_process(&controller->server, 0, &out);
    }
}

static bool boot_requested(struct machine *machine)
{
    port_lock();
    const bool due = machine->boot_due;
    machine->boot_due = false;
    port_unlock();
    return due;
}

/* For a drive that is about to be started: its mapped offsets, and its inputs, because TPDO3 reports changes only. */
static void note_properties(struct controller *controller, const struct can_msg *command)
{
    if (command->id != COB_NMT || command->data[0] != (uint8_t)NMT_START) {
        return;
    }
    port_lock();
    struct axis *axis = machine_axis(&controller->machine, command->data[1]);
    if (axis != NULL) {
        const uint32_t i = (uint32_t)(axis - controller->machine.axes);
        const struct drive_properties *properties = &controller->boot.properties[i];
        axis->digital_inputs = properties->value[DRIVE_INPUTS];
        axis->torque_mapped = properties->known[DRIVE_TORQUE_MAPPED];
        axis->velocity_mapped = properties->known[DRIVE_VELOCITY_MAPPED];
        if (properties->known[DRIVE_POSITION]) {
            axis_reconnected(axis, (int32_t)properties->value[DRIVE_POSITION],
                             MACHINE_KEPT_UNITS * config_counts_per_unit(&controller->config, i));
        } else {
            axis->homed = false;
        }
    }
    port_unlock();
}

static void note_missing_heartbeats(struct controller *controller)
{
    port_lock();
    const uint8_t node = controller->machine.unresponsive_node;
    port_unlock();
    drive_boot_unresponsive(&controller->boot, node);
}

static void poll_boot(struct controller *controller, uint32_t elapsed_us)
{
    if (boot_requested(&controller->machine)) {
        port_tick_urgent(false);
        drive_boot_begin(&controller->boot, &controller->config);
        drive_monitor_begin(&controller->monitor, &controller->config,
                            controller->values.consumer_heartbeat_time);
    }
    struct can_msg out;
    bool due = drive_boot_process(&controller->boot, elapsed_us, &out);
    while (due) {
        note_properties(controller, &out);
        controller_send(&out);
        due = drive_boot_process(&controller->boot, 0, &out);
    }
    if (drive_boot_finished(&controller->boot)) {
        port_tick_urgent(!controller->boot.simulated);
        port_lock();
        if (!controller->machine.boot_due) {
            machine_drives_configured(&controller->machine, controller->boot.simulated);
        }
        port_unlock();
    }
    note_missing_heartbeats(controller);
}

static void poll_homing(struct controller *controller, uint32_t elapsed_us)
{
    struct can_msg out;
    if (homing_process(&controller->homing, &controller->machine, elapsed_us, &out)) {
        controller_send(&out);
    }
}

/* During shutdown nothing is requested: a response after the end would be taken for one to the next client. */
static void poll_drives(struct controller *controller, uint32_t elapsed_us)
{
    port_lock();
    const bool found = controller->machine.state != MACHINE_BOOT;
    port_unlock();
    struct can_msg out;
    const bool allowed = found && !controller->ending && !homing_busy(&controller->homing);
    if (drive_polling_process(&controller->polling, &controller->machine,
                              controller->boot.properties, allowed, elapsed_us, &out)) {
        controller_send(&out);
    }
}

static uint32_t counted_us(uint32_t elapsed_us)
{
    return elapsed_us < CONTROLLER_ELAPSED_MAX_US ? elapsed_us : CONTROLLER_ELAPSED_MAX_US;
}

void controller_poll(struct controller *controller)
{
    struct can_msg in;
    while (next_frame(controller, &in)) {
        take_frame(controller, &in);
    }
    const uint32_t now_us = port_time_us();
    const uint32_t elapsed_us = counted_us(now_us - controller->polled_us);
    controller->polled_us = now_us;
    poll_nmt(controller);
    controller_heartbeat(controller, elapsed_us);
    poll_server(controller, elapsed_us);
    poll_boot(controller, elapsed_us);
    poll_homing(controller, elapsed_us);
    poll_drives(controller, elapsed_us);
    drive_monitor_process(&controller->monitor, &controller->machine, elapsed_us);
    stream_process(&controller->stream, &controller->machine);
    report_changes(controller);
}

/* ---- Shutdown: stop along the path, switch off, leave the drives pre-operational ---- */

static bool at_rest(const struct machine *machine)
{
    return !machine_moving(machine);
}

static bool switched_off(const struct machine *machine)
{
    if (machine->state == MACHINE_BOOT) {
        return true;
    }
    for (uint8_t i = 0; i < machine->config.axis_count; ++i) {
        const struct axis *axis = &machine->axes[i];
        if (!axis_has_stopped(axis)) {
            return false;
        }
    }
    return true;
}

static bool reached_now(struct controller *controller, bool (*reached)(const struct machine *))
{
    port_lock();
    const bool done = reached(&controller->machine);
    port_unlock();
    return done;
}

/* Runs the main loop until the condition is reached, the time is over, or (if that counts here) the stop has been
 * requested a second time. */
static bool wait_until(struct controller *controller, bool (*reached)(const struct machine *),
                       uint32_t time_us, bool until_insisted)
{
    const uint32_t began_us = port_time_us();
    for (;;) {
        const bool done = reached_now(controller, reached);
        const bool insisted = until_insisted && port_stop_insisted();
        if (done || insisted || port_time_us() - began_us > time_us) {
            return done;
        }
        port_wait(CONTROLLER_POLL_US);
        controller_poll(controller);
    }
}

static void leave_pre_operational(const struct controller *controller)
{
    for (uint8_t i = 0; i < drive_configuration_nodes(&controller->config); ++i) {
        struct can_msg command;
        nmt_master_command(NMT_ENTER_PRE_OPERATIONAL,
                           drive_configuration_node(&controller->config, i), &command);
        controller_send(&command);
    }
}

/* The time limit of the machine for a quick stop. */
static uint32_t quick_time_us(const struct controller *controller)
{
    return (MACHINE_QUICK_TICKS + AXIS_STANDSTILL_SYNCS) * controller->config.period_us;
}

/* The machine itself ends a stop at its deadline: 1.2 times its bound, near the end of a program 1.2 times twice the
 * bound at most; then the axes settle and arrive. This longer limit is for a machine without ticks. */
static uint32_t path_time_us(const struct controller *controller)
{
    const struct program_slot *slot = &controller->slot;
    const uint32_t reported_us = stream_is_open(&controller->stream)
                                     ? stream_hold_worst_us(&controller->stream)
                                 : slot->present ? slot->program.header.hold_worst_us
                                                 : 0u;
    const uint32_t bound_us = reported_us < STOP_BOUND_MOST_US ? reported_us : STOP_BOUND_MOST_US;
    return 3u * bound_us + (MACHINE_SETTLE_TICKS + MACHINE_ARRIVE_TICKS + AXIS_STANDSTILL_SYNCS) *
                               controller->config.period_us;
}

/* If the path stop does not end in time, or the stop has been requested a second time, the drives stop by their own
 * ramps. */
static bool come_to_standstill(struct controller *controller)
{
    (void)commands_execute(controller, COMMAND_STOP);
    if (wait_until(controller, at_rest, path_time_us(controller), true)) {
        return true;
    }
    (void)commands_execute(controller, COMMAND_QUICK_STOP);
    return wait_until(controller, at_rest, quick_time_us(controller), false);
}

bool controller_shut_down(struct controller *controller)
{
    controller->ending = true;
    const bool stopped = come_to_standstill(controller);
    (void)commands_execute(controller, COMMAND_DISABLE);
    (void)wait_until(controller, at_rest, quick_time_us(controller), false);
    const bool off = wait_until(controller, switched_off, OFF_TIME_US, false);
    leave_pre_operational(controller);
    return stopped && off;
}
