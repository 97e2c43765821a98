/* SPDX-License-Identifier: MIT */
/* Implements app/drives/drive_polling.h: reads values of the drives that are in no PDO. Called by app/controller.c.
 * Main loop; takes the port's lock where it writes to the axes. No I/O: the caller sends. */
#include "app/drives/drive_polling.h"

#include <string.h>

#include "port/port.h"

#define FOLLOWING_ERROR 0x60F4u
#define DIGITAL_INPUTS  0x60FDu
#define OBJECTS         2u

void drive_polling_init(struct drive_polling *polling)
{
    memset(polling, 0, sizeof *polling);
    sdo_client_init(&polling->client, DRIVE_POLLING_SDO_TIMEOUT_US);
}

bool drive_polling_receive(struct drive_polling *polling, const struct can_msg *in,
                           struct can_msg *out)
{
    return sdo_client_receive(&polling->client, in, out);
}

/* A refused or unanswered read keeps the last value. Supervision is the task of other modules. */
static void take_value(const struct drive_polling *polling, struct machine *machine)
{
    port_lock();
    struct axis *axis = machine_axis(machine, polling->client.node);
    if (axis != NULL && polling->client.index == FOLLOWING_ERROR) {
        axis->following_error_counts = (int32_t)sdo_client_signed(&polling->client);
    } else if (axis != NULL) {
        axis->digital_inputs = (uint32_t)sdo_client_unsigned(&polling->client);
    }
    port_unlock();
}

static bool inputs_polled(const struct drive_properties *properties)
{
    return properties->known[DRIVE_INPUTS] && !properties->known[DRIVE_INPUTS_MAPPED];
}

/* How many objects are read in turn: each is to be read once in DRIVE_POLLING_US. */
static uint32_t objects_polled(const struct drive_properties *properties, uint8_t axis_count)
{
    uint32_t objects = axis_count;
    for (uint8_t i = 0; i < axis_count; ++i) {
        objects += inputs_polled(&properties[i]) ? 1u : 0u;
    }
    return objects;
}

/* The configuration belongs to the main loop, so it is read without the lock. */
static bool request_next(struct drive_polling *polling, const struct machine *machine,
                         const struct drive_properties *properties, struct can_msg *out)
{
    const uint8_t count = machine->config.axis_count;
    polling->poll_index = (uint8_t)((polling->poll_index + 1u) % (count * OBJECTS));
    polling->pause_us = DRIVE_POLLING_US / objects_polled(properties, count);
    const uint8_t axis = (uint8_t)(polling->poll_index % count);
    const bool inputs = polling->poll_index >= count;
    if (inputs && !inputs_polled(&properties[axis])) {
        polling->pause_us = 0;
        return false;
    }
    const uint16_t index = inputs ? DIGITAL_INPUTS : FOLLOWING_ERROR;
    const int begun =
        sdo_client_read_number(&polling->client, machine->config.node[axis], index, 0, out);
    return begun == 0;
}

bool drive_polling_process(struct drive_polling *polling, struct machine *machine,
                           const struct drive_properties *properties, bool allowed,
                           uint32_t elapsed_us, struct can_msg *out)
{
    if (!allowed) {
        polling->client.status = SDO_CLIENT_IDLE;
        return false;
    }
    if (polling->client.status == SDO_CLIENT_BUSY) {
        return sdo_client_process(&polling->client, elapsed_us, out);
    }
    if (polling->client.status == SDO_CLIENT_DONE) {
        take_value(polling, machine);
    }
    polling->client.status = SDO_CLIENT_IDLE;
    polling->pause_us -= elapsed_us < polling->pause_us ? elapsed_us : polling->pause_us;
    return polling->pause_us == 0u && request_next(polling, machine, properties, out);
}
