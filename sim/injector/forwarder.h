/* SPDX-License-Identifier: MIT */
/* forwarder: passes every frame between the controller's bus and the drives', and injects the faults of the fault rules
 * (docs/reference/protocol.md section 4).
 *
 * Rules act on a frame in the order of the file. A frame that changes places with the next one of its direction waits
 * for it for 20 ms at most. While a side is off the bus no frame passes, frames that were held or delayed are lost, and
 * a flood reaches the other side only. The same frames give the same faults, except delays and durations in ms, which
 * follow the wall clock.
 *
 * Used by injector/main. No I/O, no heap. All functions in one thread.
 */
#ifndef INJECTOR_FORWARDER_H
#define INJECTOR_FORWARDER_H

#include "faults/fault_rules.h"
#include "faults/fault_trigger.h"
#include "injector/delay_queue.h"

struct forwarder_port {
    /* Sends a frame to one side. */
    void (*send)(void *context, enum fault_side to, const struct can_msg *frame);
    /* Reports that a rule has acted on `frame`, given as it came. NULL: a rule without a frame begins or ends, by
     * `on`. */
    void (*note)(void *context, const struct fault_trigger *trigger, enum fault_side from,
                 const struct can_msg *frame, bool on);
    void *context;
};

/* A frame that waits to change places. */
struct forwarder_held {
    struct can_msg frame;
    uint64_t since_ns;
    bool waits;
};

struct forwarder {
    struct fault_trigger triggers[FAULT_RULES_MAX]; /* the bus-level rules only */
    bool acts[FAULT_RULES_MAX];                     /* flood, bus-off: as last noted */
    uint32_t count;
    struct fault_ticks ticks;
    uint64_t now_ns; /* of the last call */
    struct delay_queue delayed;
    struct forwarder_held held[2]; /* by the side it came from */
    struct forwarder_port port;
};

/* `rules` are borrowed; those for the drives are ignored. */
void forwarder_init(struct forwarder *forwarder, const struct fault_rules *rules,
                    struct forwarder_port port);

/* A frame from FAULT_SIDE_CONTROLLER or FAULT_SIDE_DRIVES. `now_ns` never decreases. */
void forwarder_receive(struct forwarder *forwarder, enum fault_side from,
                       const struct can_msg *frame, uint64_t now_ns);

/* When forwarder_process has something to do; UINT64_MAX: never. */
uint64_t forwarder_due_ns(const struct forwarder *forwarder);

/* Sends what has waited long enough. */
void forwarder_process(struct forwarder *forwarder, uint64_t now_ns);

#endif
