/* SPDX-License-Identifier: MIT */
/* hodograph-controller: the same main for a process and for a microcontroller. Started by the shell on Linux, by the
 * start-up code of the port on a board. Owns the struct controller; its loop is the main loop. All I/O is that of the
 * port. */
#include "app/controller.h"
#include "port/port.h"

enum { STATUS_MACHINE = 1, STATUS_NOT_STOPPED = 6 };

static struct controller controller;

int main(int argc, char **argv)
{
    const int status = port_begin(argc, argv);
    if (status != 0) {
        return status;
    }
    controller_init(&controller, port_node_id());
    if (controller_start(&controller) != 0) {
        port_log(PORT_WARNING, "cannot start the interrupts of node", port_node_id());
        (void)port_end();
        return STATUS_MACHINE;
    }
    while (!port_stop_requested()) {
        port_wait(CONTROLLER_POLL_US);
        controller_poll(&controller);
    }
    const bool stopped = controller_shut_down(&controller);
    const int failed = port_end();
    if (failed != 0) {
        return failed;
    }
    return stopped ? 0 : STATUS_NOT_STOPPED;
}
