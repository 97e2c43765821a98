/* SPDX-License-Identifier: MIT */
/* Implements faults/fault_log.h (see there): what was injected when, one JSON object a line. Used by sim/injector/main
 * and sim/node/drives. Any thread; writes to `out` only. */
#include "faults/fault_log.h"

#include <inttypes.h>

static void log_begin(FILE *out, const struct fault_event *event)
{
    (void)fprintf(out,
                  "{\"t_ns\":%" PRIu64 ",\"tick\":%" PRId64 ",\"line\":%" PRIu32 ",\"kind\":\"%s\"",
                  event->t_ns, event->tick, event->rule->line, fault_kind_name(event->rule->kind));
}

void fault_log_frame(FILE *out, const struct fault_event *event, enum fault_side from,
                     const struct can_msg *frame)
{
    log_begin(out, event);
    (void)fprintf(out, ",\"from\":\"%s\",\"id\":%" PRIu32 ",\"data\":\"",
                  from == FAULT_SIDE_CONTROLLER ? "controller" : "drives", frame->id);
    for (unsigned i = 0; i < frame->len; i++) {
        (void)fprintf(out, "%02x", frame->data[i]);
    }
    (void)fputs("\"}\n", out);
}

void fault_log_state(FILE *out, const struct fault_event *event, bool on)
{
    log_begin(out, event);
    if (event->rule->node != 0u) {
        (void)fprintf(out, ",\"node\":%u", event->rule->node);
    }
    (void)fprintf(out, ",\"on\":%s}\n", on ? "true" : "false");
}
