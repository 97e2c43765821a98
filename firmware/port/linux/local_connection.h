/* SPDX-License-Identifier: MIT */
/* local_connection: opens a connection to the hub of a local bus (local_bus.h). Used by can_socket_open and clock. Any
 * thread; local_connection_open waits for the welcome of the hub. Opens a socket, sends a message and receives one. */
#ifndef PORT_LINUX_LOCAL_CONNECTION_H
#define PORT_LINUX_LOCAL_CONNECTION_H

#include <stdbool.h>

#include "port/linux/local_bus.h"

/* Whether this names a local bus: a path, which has a '/' in it. Network interfaces have none. */
bool local_connection_named(const char *bus);

/* Connects to the hub at this path, sends `hello` and waits for its welcome. Returns a descriptor that does not block,
 * which the caller has to close, or a negative errno: -ENOENT or -ECONNREFUSED if no process serves the path, -EPROTO
 * if that process is not a hub of this version. */
int local_connection_open(const char *path, const struct local_bus_control *hello,
                          struct local_bus_control *welcome);

#endif
