/* SPDX-License-Identifier: MIT */
#include "app/od_program.h"

#include <string.h>

#include "canopen/sdo_abort.h"
#include "port/port.h"

static bool moving(struct controller *controller)
{
    port_lock();
    const bool result = machine_moving(&controller->machine);
    port_unlock();
    return result;
}

uint32_t od_program_begin(void *context, const struct od_entry *entry, uint32_t size)
{
    struct controller *controller = context;
    (void)entry;
    if (moving(controller)) {
        controller->refusal = MACHINE_MOVING;
        return SDO_ABORT_STATE;
    }
    return program_slot_begin(&controller->slot, size) == 0 ? SDO_OK : SDO_ABORT_MEMORY;
}

uint32_t od_program_write(void *context, const struct od_entry *entry, uint32_t offset,
                          const uint8_t *data, uint32_t size)
{
    struct controller *controller = context;
    (void)entry;
    return program_slot_write(&controller->slot, offset, data, size) == 0 ? SDO_OK
                                                                          : SDO_ABORT_MEMORY;
}

/* One SDO channel serves commands and upload, so nothing can have been started since the beginning.
 */
uint32_t od_program_end(void *context, const struct od_entry *entry, uint32_t size)
{
    struct controller *controller = context;
    (void)entry;
    const int result = program_slot_finish(&controller->slot, size, &controller->config);
    return result == 0 ? SDO_OK : SDO_ABORT_VALUE;
}

void od_program_abort(void *context, const struct od_entry *entry)
{
    struct controller *controller = context;
    (void)entry;
    program_slot_abandon(&controller->slot);
}

uint32_t od_program_size(void *context, const struct od_entry *entry, uint32_t *size)
{
    const struct controller *controller = context;
    (void)entry;
    if (!controller->slot.present) {
        return SDO_ABORT_NO_DATA;
    }
    *size = controller->slot.program.header.image_size;
    return SDO_OK;
}

uint32_t od_program_read(void *context, const struct od_entry *entry, uint32_t offset,
                         uint8_t *data, uint32_t size)
{
    const struct controller *controller = context;
    (void)entry;
    memcpy(data, controller->slot.program.image + offset, size);
    return SDO_OK;
}
