/* SPDX-License-Identifier: MIT */
#include "app/drives/drive_polling.h"

#include <string.h>

#include "port/port.h"

#define FOLLOWING_ERROR 0x60F4u
#define DIGITAL_INPUTS  0x60FDu
#define OBJECTS         2u

void drive_polling_init(struct drive_polling *look)
{
    memset(look, 0, sizeof *look);
    sdo_client_init(&look->client, DRIVE_POLLING_SDO_TIMEOUT_US);
}

int drive_polling_receive(struct drive_polling *look, const struct can_msg *in, struct can_msg *out)
{
    return sdo_client_receive(&look->client, in, out);
}

/* A refusal or a silence leaves the last value: supervision is not the task of this module. */
static void take_value(const struct drive_polling *look, struct machine *machine)
{
    port_lock();
    struct axis *axis = machine_axis(machine, look->client.node);
    if (axis != NULL && look->client.index == FOLLOWING_ERROR) {
        axis->following_error_counts = (int32_t)sdo_client_signed(&look->client);
    } else if (axis != NULL) {
        axis->digital_inputs = (uint32_t)sdo_client_unsigned(&look->client);
    }
    port_unlock();
}

static bool inputs_polled(const struct drive_properties *facts)
{
    return facts->known[DRIVE_INPUTS] && !facts->known[DRIVE_INPUTS_MAPPED];
}

/* The configuration belongs to the mainline, so it is read without the lock. */
static int look_at_next(struct drive_polling *look, const struct machine *machine,
                        const struct drive_properties *facts, struct can_msg *out)
{
    const uint8_t count = machine->config.axis_count;
    look->turn = (uint8_t)((look->turn + 1u) % (count * OBJECTS));
    look->pause_us = DRIVE_POLLING_US / count;
    const uint8_t axis = (uint8_t)(look->turn % count);
    const bool inputs = look->turn >= count;
    if (inputs && !inputs_polled(&facts[axis])) {
        look->pause_us = 0;
        return 0;
    }
    const uint16_t index = inputs ? DIGITAL_INPUTS : FOLLOWING_ERROR;
    const int sent =
        sdo_client_read_number(&look->client, machine->config.node[axis], index, 0, out);
    return sent == 0 ? 1 : 0;
}

int drive_polling_process(struct drive_polling *look, struct machine *machine,
                          const struct drive_properties *facts, bool allowed, uint32_t elapsed_us,
                          struct can_msg *out)
{
    if (!allowed) {
        look->client.status = SDO_CLIENT_IDLE;
        return 0;
    }
    if (look->client.status == SDO_CLIENT_BUSY) {
        return sdo_client_process(&look->client, elapsed_us, out);
    }
    if (look->client.status == SDO_CLIENT_DONE) {
        take_value(look, machine);
    }
    look->client.status = SDO_CLIENT_IDLE;
    look->pause_us -= elapsed_us < look->pause_us ? elapsed_us : look->pause_us;
    return look->pause_us > 0u ? 0 : look_at_next(look, machine, facts, out);
}
