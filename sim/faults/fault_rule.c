/* SPDX-License-Identifier: MIT */
#include "faults/fault_rule.h"

#include <assert.h>

static const char *const names[FAULT_KINDS] = {
    [FAULT_KIND_DROP] = "drop",
    [FAULT_KIND_DUPLICATE] = "duplicate",
    [FAULT_KIND_DELAY] = "delay",
    [FAULT_KIND_REORDER] = "reorder",
    [FAULT_KIND_CORRUPT] = "corrupt",
    [FAULT_KIND_SHORT] = "short",
    [FAULT_KIND_FLOOD] = "flood",
    [FAULT_KIND_BUS_OFF] = "bus-off",
    [FAULT_KIND_STOP] = "stop",
    [FAULT_KIND_RESTART] = "restart",
    [FAULT_KIND_HEARTBEAT_STOP] = "heartbeat-stop",
    [FAULT_KIND_ENCODER_FREEZE] = "encoder-freeze",
    [FAULT_KIND_ENCODER_JUMP] = "encoder-jump",
    [FAULT_KIND_ENCODER_FAULT] = "encoder-fault",
    [FAULT_KIND_SATURATE] = "saturate",
    [FAULT_KIND_LOAD] = "load",
    [FAULT_KIND_LIMIT_SWITCH] = "limit-switch",
    [FAULT_KIND_FAULT] = "fault",
};

const char *fault_kind_name(enum fault_kind kind)
{
    assert(kind < FAULT_KINDS);
    return names[kind];
}

bool fault_kind_is_drives(enum fault_kind kind)
{
    return kind >= FAULT_KIND_STOP;
}
