/* SPDX-License-Identifier: MIT */
/* store: the store of port.h as memory of the process, or as a mapped file that outlives the process; and the memory of
 * the ring of streamed jobs. Used by port_linux.c: main thread, at the start of the process. */
#ifndef PORT_LINUX_STORE_H
#define PORT_LINUX_STORE_H

#include <stdint.h>

/* Once, before the functions port_store_... are called. `file` NULL: memory that ends with the process. Returns 0, or
 * PORT_ERR_SYSTEM with the reason in one line on stderr: the file cannot be opened or has another size, or another
 * controller uses it. */
int store_open(const char *file);

/* Once, before port_stream_memory is called: the bytes of the ring of streamed jobs, at most STORE_RING_MAX. */
#define STORE_RING_MAX (16u * 1024u * 1024u)
void store_ring(uint32_t bytes);

#endif
