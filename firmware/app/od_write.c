/* SPDX-License-Identifier: MIT */
#include "app/od_write.h"

#include "app/commands.h"
#include "canopen/cob.h"
#include "canopen/heartbeat.h"
#include "canopen/sdo_abort.h"
#include "port/port.h"

#define SIGNATURE_SAVE UINT32_C(0x65766173) /* "save", CiA 301 7.5.2.13 */
#define SIGNATURE_LOAD UINT32_C(0x64616F6C) /* "load", 7.5.2.14 */

/* Test and use in one critical section: a fault may come between any two. False: not possible now. */
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

/* Objects 0x1010 and 0x1011. */
static uint32_t keep(struct controller *controller, uint16_t index, uint64_t signature)
{
    const bool save = index == 0x1010u;
    if (signature != (save ? SIGNATURE_SAVE : SIGNATURE_LOAD)) {
        return SDO_ABORT_TRANSFER;
    }
    if (!configurable(controller)) {
        return SDO_ABORT_STATE;
    }
    const int result =
        save ? parameter_store_save(&controller->store, &controller->od, controller->config.crc32,
                                    controller_configured(controller))
             : parameter_store_forget(&controller->store);
    return result == 0 ? SDO_OK : SDO_ABORT_HARDWARE;
}

/* Object 0x2050 sub 2: the host expects exactly this configuration. */
static uint32_t confirm(struct controller *controller, uint64_t crc32)
{
    if (crc32 != controller->config.crc32) {
        return SDO_ABORT_VALUE;
    }
    if (!controller_configured(controller)) {
        controller->configured =
            (struct configured){.known = true, .restored = false, .crc32 = (uint32_t)crc32};
    }
    return SDO_OK;
}

/* The dictionary has the new value while the configuration is read from it, and the old one again when it is refused. */
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

/* Writing the value that is there changes nothing. */
static uint32_t configure(struct controller *controller, const struct od_entry *entry,
                          uint64_t value)
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

bool od_urgent_hook(const struct od_entry *entry, uint8_t value)
{
    const bool stops = value == (uint8_t)COMMAND_STOP || value == (uint8_t)COMMAND_HOLD ||
                       value == (uint8_t)COMMAND_QUICK_STOP;
    return entry->index == 0x2001u && stops;
}

uint32_t od_write_hook(void *context, const struct od_entry *entry, const uint8_t *value,
                       uint32_t size)
{
    struct controller *controller = context;
    const uint64_t number = size <= 8u ? cob_get(value, size) : 0u;
    if (entry->index == 0x2001) {
        const enum machine_refusal refusal = commands_execute(controller, (enum command)number);
        return refusal == MACHINE_ACCEPTED ? SDO_OK : SDO_ABORT_STATE;
    }
    if (entry->index == 0x1010 || entry->index == 0x1011) {
        return keep(controller, entry->index, number);
    }
    if (entry->index == 0x2050) {
        return confirm(controller, number);
    }
    if (entry->index == 0x1003) {
        return number == 0u ? SDO_OK : SDO_ABORT_VALUE;
    }
    if (entry->index == 0x1016) {
        const uint8_t count = controller->values.consumer_heartbeat_time_count;
        return heartbeat_entry_taken(controller->values.consumer_heartbeat_time, count,
                                     (uint8_t)(entry->sub - 1u), (uint32_t)number)
                   ? SDO_ABORT_INCOMPATIBLE
                   : SDO_OK;
    }
    if (config_contains(entry->index)) {
        return configure(controller, entry, number);
    }
    return SDO_OK;
}

void od_written_hook(void *context, const struct od_entry *entry)
{
    struct controller *controller = context;
    if (entry->index == 0x2010) {
        port_lock();
        machine_override(&controller->machine, controller->values.override.percent);
        port_unlock();
    } else if (entry->index == 0x1016) {
        drive_monitor_begin(&controller->watch, &controller->config,
                            controller->values.consumer_heartbeat_time);
    } else if (entry->index == 0x1003) {
        emcy_producer_forget(&controller->emcy);
    }
}
