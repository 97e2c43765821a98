/* SPDX-License-Identifier: MIT */
#include "canopen/cob.h"
#include "canopen/sdo_abort.h"
#include "canopen/sdo_server_private.h"

void sdo_server_frame(const struct sdo_server *s, uint8_t command, struct can_msg *out)
{
    cob_frame(out, COB_SDO_ANSWER + s->node, SDO_BYTES);
    out->data[0] = command;
}

void sdo_server_frame_with_object(const struct sdo_server *s, uint8_t command, struct can_msg *out)
{
    sdo_server_frame(s, command, out);
    cob_put(out->data + 1, s->index, 2);
    out->data[3] = s->sub;
}

int sdo_server_fail(struct sdo_server *s, uint32_t code, struct can_msg *out)
{
    sdo_server_drop(s);
    sdo_server_frame_with_object(s, SDO_ABORT_COMMAND_BYTE, out);
    cob_put(out->data + 4, code, 4);
    return 1;
}
