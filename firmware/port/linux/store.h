/* SPDX-License-Identifier: MIT */
/* store: the store of port.h as memory of the process, or as a file that is mapped there and outlives it; and
 * the ring of streamed jobs. */
#ifndef PORT_LINUX_STORE_H
#define PORT_LINUX_STORE_H

#include <stdint.h>

/* Once, before the functions port_store_... are called. `file` NULL: memory that ends with the process. Returns 0, or
 * PORT_ERR_SYSTEM, and one line on stderr has the reason: the file cannot be opened or has another size, or another
 * controller uses it. */
int store_open(const char *file);

/* Once, before port_stream_memory is called: the bytes of the ring of streamed jobs, at most STORE_RING_MAX. */
#define STORE_RING_MAX (16u * 1024u * 1024u)
void store_ring(uint32_t bytes);

#endif
