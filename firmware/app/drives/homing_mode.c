/* SPDX-License-Identifier: MIT */
/* Implements app/drives/homing_mode.h (see there): brings a drive into a mode of operation by SDO. Used by
 * app/drives/homing. No I/O; changes its struct only. */
#include "app/drives/homing_mode.h"

#include <string.h>

#define MODE_OF_OPERATION         0x6060u
#define MODE_OF_OPERATION_DISPLAY 0x6061u

void homing_mode_init(struct homing_mode *mode)
{
    memset(mode, 0, sizeof *mode);
    sdo_client_init(&mode->client, HOMING_MODE_SDO_TIMEOUT_US);
}

void homing_mode_begin(struct homing_mode *mode)
{
    mode->checking = false;
    mode->reads = 0;
    mode->pause_us = 0;
    mode->client.status = SDO_CLIENT_IDLE;
}

static bool request_next(struct homing_mode *mode, uint8_t node, uint8_t wanted,
                         struct can_msg *out)
{
    struct sdo_client *client = &mode->client;
    const int begun =
        mode->checking
            ? sdo_client_read_number(client, node, MODE_OF_OPERATION_DISPLAY, 0, out)
            : sdo_client_write_number(client, node, MODE_OF_OPERATION, 0, wanted, 1, out);
    return begun == 0;
}

/* The mode has been written, or read. */
static enum homing_mode_result judge(struct homing_mode *mode, uint8_t wanted)
{
    const bool read = mode->checking;
    mode->client.status = SDO_CLIENT_IDLE;
    mode->checking = true;
    if (!read) {
        return HOMING_MODE_PENDING;
    }
    mode->detail = (uint8_t)sdo_client_unsigned(&mode->client);
    if (mode->detail == wanted) {
        return HOMING_MODE_SET;
    }
    mode->pause_us = HOMING_MODE_READ_AGAIN_US;
    return ++mode->reads == HOMING_MODE_READS ? HOMING_MODE_REFUSED : HOMING_MODE_PENDING;
}

static bool waits(struct homing_mode *mode, uint32_t elapsed_us)
{
    mode->pause_us -= elapsed_us < mode->pause_us ? elapsed_us : mode->pause_us;
    return mode->pause_us > 0u;
}

bool homing_mode_process(struct homing_mode *mode, uint8_t node, uint8_t wanted,
                         uint32_t elapsed_us, struct can_msg *out, enum homing_mode_result *result)
{
    *result = HOMING_MODE_PENDING;
    switch (mode->client.status) {
    case SDO_CLIENT_BUSY:
        return sdo_client_process(&mode->client, elapsed_us, out);
    case SDO_CLIENT_DONE:
        *result = judge(mode, wanted);
        break;
    case SDO_CLIENT_REFUSED:
    case SDO_CLIENT_FAILED:
        mode->detail = mode->client.abort_code;
        *result = HOMING_MODE_REFUSED;
        break;
    case SDO_CLIENT_IDLE:
    default:
        break;
    }
    if (*result != HOMING_MODE_PENDING || waits(mode, elapsed_us)) {
        return false;
    }
    return request_next(mode, node, wanted, out);
}
