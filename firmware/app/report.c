/* SPDX-License-Identifier: MIT */
/* Implements app/report.h (see there): emergency messages, the NMT state after errors, lines on the console. Used by
 * app/controller.c. Main loop; takes the port's lock to read the machine. Sends emergency messages, changes the NMT
 * state and what it has reported, and prints by port_log. */
#include "app/report.h"

#include "canopen/cia402.h"
#include "canopen/sdo_abort.h"
#include "port/port.h"

static void tell_fault(struct controller *controller, const struct fault *fault)
{
    const uint8_t detail[EMCY_DETAIL_SIZE] = {
        fault->node, (uint8_t)fault->detail, (uint8_t)(fault->detail >> 8),
        (uint8_t)(fault->detail >> 16), (uint8_t)(fault->detail >> 24)};
    emcy_producer_raise(&controller->emcy, fault->code, EMCY_REGISTER_PROFILE, detail);
    port_log(PORT_WARNING, "fault at node", fault->node);
    port_log(PORT_WARNING, fault_text(fault->code), (int32_t)fault->detail);
    if (fault->code == FAULT_NOT_SENT && fault->node == 0u) {
        nmt_slave_error(&controller->nmt, controller->values.error_behaviour[0]);
    }
}

/* Faults are raised in interrupts; the main loop reports them. */
static void report_fault(struct controller *controller)
{
    port_lock();
    const struct fault fault = controller->machine.fault;
    const uint32_t serial = controller->machine.fault_serial;
    port_unlock();
    if (serial == controller->reported_serial) {
        return;
    }
    controller->reported_serial = serial;
    if (fault.code != EMCY_NO_ERROR) {
        tell_fault(controller, &fault);
    } else {
        emcy_producer_clear(&controller->emcy, EMCY_REGISTER_PROFILE);
        controller_start_itself(controller);
    }
}

static void note_state(struct controller *controller)
{
    static const char *const names[] = {"state boot",   "state off",       "state enabling",
                                        "state ready",  "state running",   "state stopping",
                                        "state fault",  "state holding",   "state held",
                                        "state homing", "state quick stop"};
    port_lock();
    const enum machine_state state = controller->machine.state;
    port_unlock();
    if (state != controller->noted_state) {
        controller->noted_state = state;
        port_log(PORT_NOTE, names[state], (int32_t)state);
    }
}

/* The internal limit of a drive (statusword bit 11) is a warning: it still follows, though not as fast as commanded. */
static void note_limits(struct controller *controller)
{
    for (uint8_t i = 0; i < controller->config.axis_count; ++i) {
        port_lock();
        const struct axis *axis = &controller->machine.axes[i];
        const bool limited = (axis->statusword & CIA402_STATUS_LIMIT) != 0u;
        const uint8_t node = axis->node;
        port_unlock();
        if (limited && !controller->limit_noted[i]) {
            port_log(PORT_WARNING, "internal limit active at node", node);
        }
        controller->limit_noted[i] = limited;
    }
}

/* Why the drives are not ready yet: object 0x2025 in words. */
static void note_trouble(struct controller *controller)
{
    const struct drive_trouble *trouble = &controller->boot.trouble;
    struct drive_trouble *noted = &controller->noted_trouble;
    const bool same = trouble->node == noted->node && trouble->object == noted->object &&
                      trouble->abort_code == noted->abort_code;
    *noted = *trouble;
    if (same || trouble->node == 0u) {
        return;
    }
    port_log(PORT_NOTE, "drives not ready because of node", trouble->node);
    port_log(PORT_NOTE,
             trouble->abort_code == SDO_OK ? "it answered with another value"
                                           : sdo_abort_text(trouble->abort_code),
             (int32_t)trouble->value);
}

static void note_drives(struct controller *controller)
{
    for (uint8_t i = 0; i < controller->config.axis_count; ++i) {
        port_lock();
        const struct axis *axis = &controller->machine.axes[i];
        const enum cia402_state state = axis->state;
        const uint8_t node = axis->node;
        port_unlock();
        if (state != controller->noted_drive[i]) {
            controller->noted_drive[i] = state;
            port_log(PORT_NOTE, cia402_state_name(state), node);
        }
    }
}

static bool bus_takes_frames(const struct controller *controller)
{
    port_lock();
    const bool takes = controller->machine.unsent_ticks == 0u;
    port_unlock();
    return takes;
}

/* Emergency messages that the port refuses now are sent later. */
static void send_emergencies(struct controller *controller)
{
    struct can_msg out;
    while (bus_takes_frames(controller) && emcy_producer_process(&controller->emcy, &out)) {
        controller_send(&out);
    }
}

void report_changes(struct controller *controller)
{
    report_fault(controller);
    send_emergencies(controller);
    note_state(controller);
    note_trouble(controller);
    note_drives(controller);
    note_limits(controller);
}
