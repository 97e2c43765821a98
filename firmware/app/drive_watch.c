/* SPDX-License-Identifier: MIT */
#include "app/drive_watch.h"

#include <stddef.h>

#include "canopen/emcy.h"
#include "port/port.h"

void drive_watch_begin(struct drive_watch *watch, const struct config *config)
{
    watch->count = config->axis_count;
    for (uint8_t i = 0; i < watch->count; ++i) {
        heartbeat_consumer_init(&watch->consumers[i], config->node[i], DRIVE_WATCH_HEARTBEAT_MS);
    }
}

/* Drives that are off may come and go: they are found again. With power on it is a fault. */
static void gone(struct machine *machine, uint16_t code, uint8_t node)
{
    port_lock();
    const bool boots = machine->state == MACHINE_BOOT;
    if (machine->state == MACHINE_OFF || (boots && machine->configured)) {
        machine_enter_boot(machine);
    } else if (!boots) {
        machine_raise(machine, code, node, 0);
    }
    port_unlock();
}

/* A drive that still answers SYNCs is alive, whatever became of its heartbeat on a busy host. When
 * it stops answering too, the supervision in the tick finds out. */
static bool answers(struct machine *machine, uint8_t node)
{
    port_lock();
    const struct axis *axis = machine_axis(machine, node);
    const bool result = axis != NULL && axis->present && axis->missed_in_row <= AXIS_MISSED_MAX;
    port_unlock();
    return result;
}

static void take_event(struct machine *machine, const struct heartbeat_consumer *consumer,
                       enum heartbeat_event event)
{
    if (event == HEARTBEAT_BOOTED) {
        gone(machine, FAULT_REBOOTED, consumer->node);
    } else if (event == HEARTBEAT_LOST && !answers(machine, consumer->node)) {
        gone(machine, EMCY_HEARTBEAT, consumer->node);
    }
}

/* The statusword may have told of the fault before: then the code comes later. */
static void take_emergency(struct machine *machine, uint8_t node, uint16_t code)
{
    port_lock();
    struct axis *axis = machine_axis(machine, node);
    if (axis != NULL) {
        axis->error_code = code;
        if (machine->fault.node == node && machine->fault.code == EMCY_GENERIC &&
            code != EMCY_NO_ERROR) {
            machine->fault.code = code;
        }
    }
    port_unlock();
}

void drive_watch_receive(struct drive_watch *watch, struct machine *machine,
                         const struct can_msg *in)
{
    struct emcy emcy;
    const uint8_t node = emcy_decode(in, &emcy);
    if (node != 0u) {
        take_emergency(machine, node, emcy.code);
        return;
    }
    for (uint8_t i = 0; i < watch->count; ++i) {
        struct heartbeat_consumer *consumer = &watch->consumers[i];
        take_event(machine, consumer, heartbeat_consumer_receive(consumer, in));
    }
}

void drive_watch_process(struct drive_watch *watch, struct machine *machine, uint32_t elapsed_us)
{
    for (uint8_t i = 0; i < watch->count; ++i) {
        struct heartbeat_consumer *consumer = &watch->consumers[i];
        take_event(machine, consumer, heartbeat_consumer_process(consumer, elapsed_us));
    }
}
