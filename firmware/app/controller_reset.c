/* SPDX-License-Identifier: MIT */
#include "app/controller_reset.h"

#include <string.h>

#include "port/port.h"

#define FIRST_MANUFACTURER_OBJECT 0x2000u

#define LAST_OBJECT 0xFFFFu

/* The whole configuration anew from the objects; the drives have to hear of it. */
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
    controller->reported_serial--; /* a fault that is still there is told again */
}

void controller_reset_values(struct controller *controller)
{
    controller->values = od_controller_defaults;
    const bool restored =
        parameter_store_restore(&controller->store, &controller->od, 0, LAST_OBJECT);
    controller->configured = (struct configured){.known = restored && controller->store.confirmed,
                                                 .restored = restored,
                                                 .crc32 = controller->store.config_crc32};
    od_controller_set_node(&controller->values, controller->node);
    forget_errors(controller);
}

static void reset_node(void *self)
{
    struct controller *controller = self;
    controller_reset_values(controller);
    take_configuration(controller);
}

static void reset_communication(void *self)
{
    struct controller *controller = self;
    const struct od_table *table = controller->od.table;
    for (uint16_t i = 0; i < table->entry_count; i++) {
        const struct od_entry *entry = &table->entries[i];
        if (entry->index < FIRST_MANUFACTURER_OBJECT && entry->size > 0u) {
            memcpy(controller->od.storage + entry->offset,
                   (const uint8_t *)&od_controller_defaults + entry->offset, entry->size);
        }
    }
    (void)parameter_store_restore(&controller->store, &controller->od, 0,
                                  FIRST_MANUFACTURER_OBJECT - 1u);
    od_controller_set_node(&controller->values, controller->node);
    forget_errors(controller);
    take_configuration(controller);
}

const struct nmt_hooks controller_reset_hooks = {
    .reset_node = reset_node,
    .reset_communication = reset_communication,
};
