/* SPDX-License-Identifier: MIT */
/* store: the store of port.h as memory of the process, or as a file that is mapped there and outlives it. */
#ifndef PORT_LINUX_STORE_H
#define PORT_LINUX_STORE_H

/* Once, before the functions port_store_... are called. `file` NULL: memory that ends with the process. Returns 0, or
 * PORT_ERR_SYSTEM, and one line on stderr says why: the file cannot be opened or has another size, or another controller
 * uses it. */
int store_open(const char *file);

#endif
