/* SPDX-License-Identifier: MIT */
/* Implements app/objects.h (see there): the behaviour of the controller's object dictionary (controller.eds). Used by
 * app/controller.c. Main loop. Writes change the controller, the machine under the lock, the period of the tick and the
 * stored parameters. */
#include "app/objects.h"

#include <stddef.h>

#include "app/commands.h"
#include "app/objects_axis.h"
#include "app/objects_outputs.h"
#include "app/objects_program.h"
#include "app/objects_stream.h"
#include "canopen/cob.h"
#include "canopen/heartbeat.h"
#include "canopen/sdo_abort.h"
#include "port/port.h"

#define SIGNATURE_SAVE UINT32_C(0x65766173) /* "save", CiA 301 7.5.2.13 */
#define SIGNATURE_LOAD UINT32_C(0x64616F6C) /* "load", 7.5.2.14 */

/* ---- Readers: the machine ---- */

static uint64_t object_read_state(struct controller *controller, const struct od_entry *entry)
{
    (void)entry;
    return (uint64_t)controller->machine.state;
}

/* In BOOT, node and detail name the drive that the others wait for. */
static uint64_t object_read_fault(struct controller *controller, const struct od_entry *entry)
{
    const struct machine *machine = &controller->machine;
    const bool booting = machine->state == MACHINE_BOOT;
    switch (entry->sub) {
    case 1:
        return machine->fault.code;
    case 2:
        return booting ? controller->boot.trouble.node : machine->fault.node;
    case 3:
        return booting ? controller->boot.trouble.abort_code : machine->fault.detail;
    default:
        return (uint64_t)controller->refusal;
    }
}

static uint64_t object_read_statistics(struct controller *controller, const struct od_entry *entry)
{
    const struct statistics *statistics = &controller->machine.statistics;
    switch (entry->sub) {
    case 1:
        return statistics->syncs;
    case 2:
        return statistics->program_tick;
    case 3:
        return statistics->deadline_misses;
    case 4:
        return statistics->worst_late_ns / 1000u;
    case 5:
        return statistics->worst_tick_ns;
    case 6:
        return statistics->missed_tpdos;
    default:
        return statistics->frames_not_sent;
    }
}

static uint64_t object_read_motion(struct controller *controller, const struct od_entry *entry)
{
    const struct motion *motion = &controller->machine.motion;
    switch (entry->sub) {
    case 1:
        return (uint64_t)motion->point.arc_length_q40_mm;
    case 2:
        return (uint64_t)(int64_t)motion_feed_um_s(motion);
    default:
        return motion_time_q32_s(motion);
    }
}

static uint64_t object_read_override(struct controller *controller, const struct od_entry *entry)
{
    const struct machine *machine = &controller->machine;
    const struct feed_override *feed = &machine->motion.feed;
    switch (entry->sub) {
    case 1:
        return machine->override_percent;
    case 2:
        return machine_on_path(machine) ? feed_override_actual_q30(feed) : 0u;
    default:
        return machine_on_path(machine) && feed_override_saturated(feed) ? 1u : 0u;
    }
}

static uint64_t object_read_boot(struct controller *controller, const struct od_entry *entry)
{
    const struct drive_boot *boot = &controller->boot;
    switch (entry->sub) {
    case 1:
        return boot->trouble.node;
    case 2:
        return boot->trouble.object;
    case 3:
        return boot->trouble.abort_code;
    default:
        return boot->trouble.value;
    }
}

static uint64_t object_read_timing(struct controller *controller, const struct od_entry *entry)
{
    (void)controller;
    (void)entry;
    return (uint64_t)port_timing();
}

static uint64_t object_read_memory(struct controller *controller, const struct od_entry *entry)
{
    return program_slot_memory(controller->config.kernel, entry->sub);
}

static uint64_t object_read_unhomed(struct controller *controller, const struct od_entry *entry)
{
    (void)entry;
    return controller->machine.unhomed_axes;
}

static uint64_t object_read_stop_commands(struct controller *controller,
                                          const struct od_entry *entry)
{
    (void)entry;
    return controller->machine.stop_commands;
}

/* ---- Commands ---- */

static uint32_t object_write_command(struct controller *controller, const struct od_entry *entry,
                                     uint64_t number)
{
    (void)entry;
    const enum machine_refusal refusal = commands_execute(controller, (enum command)number);
    return refusal == MACHINE_ACCEPTED ? SDO_OK : SDO_ABORT_STATE;
}

/* Object 0x2056: one write names the motion and starts it, so that no other client comes in between. */
static uint32_t object_write_start(struct controller *controller, const struct od_entry *entry,
                                   uint64_t number)
{
    const enum command command = entry->sub == 2u ? COMMAND_START_FROM : COMMAND_START;
    const enum start_name name = entry->sub == 3u ? START_JOB : START_PROGRAM;
    const enum machine_refusal refusal =
        commands_start(controller, command, name, (uint32_t)number);
    return refusal == MACHINE_ACCEPTED ? SDO_OK : SDO_ABORT_STATE;
}

/* Hold, stop and quick stop wait for no transfer of another client. */
static bool object_urgent_command(uint8_t value)
{
    return command_is_urgent(value);
}

static void object_written_override(struct controller *controller)
{
    port_lock();
    machine_override(&controller->machine, controller->values.override.percent);
    port_unlock();
}

/* ---- Configuration and stored parameters ---- */

/* Values of object 0x2050 sub 3. */
enum { NOT_CONFIGURED = 0, CONFIRMED = 1, RESTORED = 2 };

static uint64_t object_read_configuration(struct controller *controller,
                                          const struct od_entry *entry)
{
    const bool known = controller_configured(controller);
    const int state = controller->configured.restored ? RESTORED : CONFIRMED;
    switch (entry->sub) {
    case 1:
        return controller->config.crc32;
    case 2:
        return known ? controller->configured.crc32 : 0u;
    case 3:
        return (uint64_t)(known ? state : NOT_CONFIGURED);
    case 4:
        return (uint64_t)controller->store.state;
    case 5:
        return controller->store.config_crc32;
    default:
        return controller->slot.present ? controller->slot.config_crc32 : 0u;
    }
}

/* Test and change in one critical section: otherwise a fault could come in between. False: not possible now. */
static bool apply(struct controller *controller, const struct config *config, bool drives)
{
    port_lock();
    const bool possible = machine_configurable(&controller->machine);
    if (possible) {
        machine_configure(&controller->machine, config, drives);
        port_tick_period(config->period_us);
    }
    port_unlock();
    return possible;
}

static bool configurable(const struct controller *controller)
{
    port_lock();
    const bool possible = machine_configurable(&controller->machine);
    port_unlock();
    return possible;
}

/* CiA 301: 1 means that the device stores, or restores, on command. */
static uint64_t object_read_on_command(struct controller *controller, const struct od_entry *entry)
{
    (void)controller;
    (void)entry;
    return 1;
}

/* Whether parameters may be stored or forgotten now, by `signature`. */
static uint32_t check_signature(const struct controller *controller, uint64_t number,
                                uint32_t signature)
{
    if (number != signature) {
        return SDO_ABORT_TRANSFER;
    }
    return configurable(controller) ? SDO_OK : SDO_ABORT_STATE;
}

static uint32_t object_write_store(struct controller *controller, const struct od_entry *entry,
                                   uint64_t number)
{
    (void)entry;
    const uint32_t code = check_signature(controller, number, SIGNATURE_SAVE);
    if (code != SDO_OK) {
        return code;
    }
    const int result =
        parameter_store_save(&controller->store, &controller->od, controller->config.crc32,
                             controller_configured(controller));
    return result == 0 ? SDO_OK : SDO_ABORT_HARDWARE;
}

static uint32_t object_write_restore(struct controller *controller, const struct od_entry *entry,
                                     uint64_t number)
{
    (void)entry;
    const uint32_t code = check_signature(controller, number, SIGNATURE_LOAD);
    if (code != SDO_OK) {
        return code;
    }
    return parameter_store_forget(&controller->store) == 0 ? SDO_OK : SDO_ABORT_HARDWARE;
}

/* Object 0x2050 sub 2: the host expects exactly this configuration. */
static uint32_t object_write_confirmation(struct controller *controller,
                                          const struct od_entry *entry, uint64_t crc32)
{
    (void)entry;
    if (crc32 != controller->config.crc32) {
        return SDO_ABORT_VALUE;
    }
    if (!controller_configured(controller)) {
        controller->configured =
            (struct configured){.known = true, .restored = false, .crc32 = (uint32_t)crc32};
    }
    return SDO_OK;
}

/* The dictionary has the new value while the configuration is read from it, and the old one again after a refusal. */
static uint32_t reconfigure(struct controller *controller, const struct od_entry *entry,
                            uint64_t value)
{
    const uint64_t before = od_number(&controller->od, entry);
    struct config config;
    od_set_number(&controller->od, entry, value);
    config_read(&config, &controller->od);
    if (!apply(controller, &config, config_concerns_drives(entry->index, entry->sub))) {
        od_set_number(&controller->od, entry, before);
        return SDO_ABORT_STATE;
    }
    controller->config = config;
    return SDO_OK;
}

/* Objects of the configuration (config_contains). Writing the present value changes nothing. */
static uint32_t object_write_configuration(struct controller *controller,
                                           const struct od_entry *entry, uint64_t value)
{
    uint8_t present[8] = {0};
    cob_put(present, od_number(&controller->od, entry), entry->size);
    if (!configurable(controller)) {
        return SDO_ABORT_STATE;
    }
    if (!config_value_allowed(entry->index, entry->sub, value)) {
        return SDO_ABORT_VALUE;
    }
    return cob_get(present, entry->size) == value ? SDO_OK : reconfigure(controller, entry, value);
}

/* ---- Communication ---- */

/* CiA 301: only 0 may be written, which clears the history. */
static uint32_t object_write_history(struct controller *controller, const struct od_entry *entry,
                                     uint64_t number)
{
    (void)controller;
    (void)entry;
    return number == 0u ? SDO_OK : SDO_ABORT_VALUE;
}

static void object_written_history(struct controller *controller)
{
    emcy_producer_forget(&controller->emcy);
}

static uint32_t object_write_consumer(struct controller *controller, const struct od_entry *entry,
                                      uint64_t number)
{
    const uint8_t count = controller->values.consumer_heartbeat_time_count;
    const bool taken = heartbeat_entry_taken(controller->values.consumer_heartbeat_time, count,
                                             (uint8_t)(entry->sub - 1u), (uint32_t)number);
    return taken ? SDO_ABORT_INCOMPATIBLE : SDO_OK;
}

static void object_written_consumer(struct controller *controller)
{
    drive_monitor_begin(&controller->monitor, &controller->config,
                        controller->values.consumer_heartbeat_time);
}

/* ---- The table ---- */

/* Entries that have handlers: those of the indices first ... last with the sub-indices sub_first ... sub_last. A
 * handler that is NULL is not needed: the field holds the value, any value may be written. */
struct object {
    uint16_t first;
    uint16_t last;
    uint8_t sub_first;
    uint8_t sub_last;
    bool locked; /* `read` reads values that interrupts write */

    /* The present value, two's complement in 64 bits. */
    uint64_t (*read)(struct controller *controller, const struct od_entry *entry);

    /* A number is to be written: SDO_OK, or why not. */
    uint32_t (*write)(struct controller *controller, const struct od_entry *entry, uint64_t number);

    /* It is in its field. */
    void (*written)(struct controller *controller);

    /* Whether the value is written although another client has a transfer under way. */
    bool (*urgent)(uint8_t value);
};

/* Values that only the main loop writes; values that interrupts write as well. */
#define OWN    false
#define SHARED true

static const struct object objects[] = {
    /* indices, sub-indices, read, write, written, urgent */
    {0x1003, 0x1003, 0, 0, OWN, NULL, object_write_history, object_written_history, NULL},
    {0x1010, 0x1010, 1, 1, OWN, object_read_on_command, object_write_store, NULL, NULL},
    {0x1011, 0x1011, 1, 1, OWN, object_read_on_command, object_write_restore, NULL, NULL},
    {0x1016, 0x1016, 1, 6, OWN, NULL, object_write_consumer, object_written_consumer, NULL},
    {0x1400, 0x1405, 1, 1, SHARED, object_read_actual_cob_id, NULL, NULL, NULL},
    {0x1800, 0x1805, 1, 1, SHARED, object_read_setpoint_cob_id, NULL, NULL, NULL},
    {0x1806, 0x180B, 1, 1, SHARED, object_read_velocity_cob_id, NULL, NULL, NULL},
    {0x1A00, 0x1A05, 0, 0, SHARED, object_read_setpoint_count, NULL, NULL, NULL},
    {0x1A00, 0x1A05, 3, 3, SHARED, object_read_setpoint_torque, NULL, NULL, NULL},
    {0x1A06, 0x1A0B, 0, 0, SHARED, object_read_velocity_count, NULL, NULL, NULL},
    {0x1A06, 0x1A0B, 1, 1, SHARED, object_read_velocity_mapped, NULL, NULL, NULL},
    {0x180C, 0x180C, 1, 1, SHARED, object_read_outputs_cob_id, NULL, NULL, NULL},
    {0x1A0C, 0x1A0C, 0, 5, SHARED, object_read_outputs_mapping, NULL, NULL, NULL},
    {0x2000, 0x2000, 2, 32, OWN, object_read_program, NULL, NULL, NULL},
    {0x2001, 0x2001, 0, 0, OWN, NULL, object_write_command, NULL, object_urgent_command},
    {0x2002, 0x2002, 0, 0, SHARED, object_read_state, NULL, NULL, NULL},
    {0x2003, 0x2003, 1, 4, SHARED, object_read_fault, NULL, NULL, NULL},
    {0x2008, 0x2008, 1, 7, SHARED, object_read_statistics, NULL, NULL, NULL},
    {0x2009, 0x2009, 1, 3, SHARED, object_read_motion, NULL, NULL, NULL},
    {0x200A, 0x200A, 1, 6, SHARED, object_read_statusword, NULL, NULL, NULL},
    {0x200B, 0x200B, 1, 6, SHARED, object_read_position, NULL, NULL, NULL},
    {0x200C, 0x200C, 1, 6, SHARED, object_read_error_code, NULL, NULL, NULL},
    {0x200D, 0x200D, 1, 6, SHARED, object_read_target, NULL, NULL, NULL},
    {0x200E, 0x200E, 1, 6, SHARED, object_read_controlword, NULL, NULL, NULL},
    {0x2010, 0x2010, 1, 3, SHARED, object_read_override, NULL, object_written_override, NULL},
    {0x2017, 0x2017, 1, 6, SHARED, object_read_homed, NULL, NULL, NULL},
    {0x201B, 0x201B, 1, 6, SHARED, object_read_inputs, NULL, NULL, NULL},
    {0x201C, 0x201C, 1, 6, SHARED, object_read_following_error, NULL, NULL, NULL},
    {0x2024, 0x2024, 1, 6, SHARED, object_read_missed, NULL, NULL, NULL},
    {0x2025, 0x2025, 1, 4, OWN, object_read_boot, NULL, NULL, NULL},
    {0x2026, 0x2026, 1, 6, SHARED, object_read_drive_state, NULL, NULL, NULL},
    {0x2027, 0x202A, 1, 6, OWN, object_read_identity, NULL, NULL, NULL},
    {0x202B, 0x202B, 1, 6, SHARED, object_read_torque_offset, NULL, NULL, NULL},
    {0x202C, 0x202C, 1, 6, SHARED, object_read_velocity_offset, NULL, NULL, NULL},
    {0x2036, 0x2036, 1, 5, SHARED, object_read_outputs, NULL, NULL, NULL},
    {0x2040, 0x2040, 0, 0, OWN, object_read_timing, NULL, NULL, NULL},
    {0x2041, 0x2041, 1, 5, OWN, object_read_memory, NULL, NULL, NULL},
    {0x2050, 0x2050, 1, 6, OWN, object_read_configuration, object_write_confirmation, NULL, NULL},
    {0x2055, 0x2055, 2, 2, SHARED, object_read_unhomed, NULL, NULL, NULL},
    {0x2056, 0x2056, 1, 3, OWN, NULL, object_write_start, NULL, NULL},
    {0x2057, 0x2057, 1, 1, SHARED, object_read_stop_commands, NULL, NULL, NULL},
    {0x2058, 0x2058, 1, 5, SHARED, object_read_rest_outputs, object_write_rest_outputs, NULL, NULL},
    {0x2058, 0x2058, 6, 6, OWN, NULL, NULL, object_written_outputs_stay, NULL},
    {0x2058, 0x2058, 7, 7, SHARED, object_read_rest_outputs, object_write_rest_outputs, NULL, NULL},
    {0x2060, 0x2060, 2, 14, SHARED, object_read_stream, NULL, NULL, NULL},
    {0x2060, 0x2060, 15, 15, OWN, NULL, object_write_stream_close, NULL, NULL},
    {0x2060, 0x2060, 16, 16, OWN, object_read_stream, object_write_optional_stop, NULL, NULL},
};

static bool contains(const struct object *object, const struct od_entry *entry)
{
    return entry->index >= object->first && entry->index <= object->last &&
           entry->sub >= object->sub_first && entry->sub <= object->sub_last;
}

/* The handlers of an entry. */
static const struct object *find(const struct od_entry *entry)
{
    static const struct object configuration = {.write = object_write_configuration};
    static const struct object none = {.read = NULL};
    for (size_t i = 0; i < sizeof objects / sizeof objects[0]; ++i) {
        if (contains(&objects[i], entry)) {
            return &objects[i];
        }
    }
    return config_contains(entry->index) ? &configuration : &none;
}

/* ---- Hooks of the dictionary ---- */

static uint32_t objects_read(void *context, const struct od_entry *entry)
{
    struct controller *controller = context;
    const struct object *object = find(entry);
    if (object->read == NULL) {
        return SDO_OK;
    }
    if (object->locked) {
        port_lock();
    }
    const uint64_t number = object->read(controller, entry);
    if (object->locked) {
        port_unlock();
    }
    od_set_number(&controller->od, entry, number);
    return SDO_OK;
}

static uint32_t objects_write(void *context, const struct od_entry *entry, const uint8_t *value,
                              uint32_t size)
{
    struct controller *controller = context;
    const struct object *object = find(entry);
    const uint64_t number = size <= 8u ? cob_get(value, size) : 0u;
    return object->write != NULL ? object->write(controller, entry, number) : SDO_OK;
}

static bool objects_urgent(const struct od_entry *entry, uint8_t value)
{
    const struct object *object = find(entry);
    return object->urgent != NULL && object->urgent(value);
}

static void objects_written(void *context, const struct od_entry *entry)
{
    const struct object *object = find(entry);
    if (object->written != NULL) {
        object->written(context);
    }
}

/* ---- DOMAINs: the image of the program, and a chunk ---- */

static bool is_chunk(const struct od_entry *entry)
{
    return entry->index == OBJECT_STREAM;
}

static uint32_t domain_begin(void *context, const struct od_entry *entry, uint32_t size)
{
    return is_chunk(entry) ? object_chunk_begin(context, size)
                           : object_program_begin(context, entry, size);
}

static uint32_t domain_write(void *context, const struct od_entry *entry, uint32_t offset,
                             const uint8_t *data, uint32_t size)
{
    return is_chunk(entry) ? object_chunk_write(context, offset, data, size)
                           : object_program_write(context, entry, offset, data, size);
}

static uint32_t domain_end(void *context, const struct od_entry *entry, uint32_t size)
{
    return is_chunk(entry) ? object_chunk_end(context, size)
                           : object_program_end(context, entry, size);
}

static void domain_abort(void *context, const struct od_entry *entry)
{
    if (is_chunk(entry)) {
        object_chunk_abort(context);
    } else {
        object_program_abort(context, entry);
    }
}

const struct od_hooks objects_hooks = {
    .read = objects_read,
    .write = objects_write,
    .urgent = objects_urgent,
    .written = objects_written,
    .domain_begin = domain_begin,
    .domain_write = domain_write,
    .domain_end = domain_end,
    .domain_abort = domain_abort,
    .domain_size = object_program_size,
    .domain_read = object_program_read,
};
