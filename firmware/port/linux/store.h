/* SPDX-License-Identifier: MIT */
/* store: the program store and the parameter store of port.h as memory of the process, or as a mapped file that
 * outlives the process; and the memory of ring and coefficient cache of streamed jobs. Opens, maps and writes the file.
 * Used by port_linux.c: main thread, at the start of the process. Later the main loop writes by ram_store_put
 * (port/common/ram_store.h), which waits for the disk at each commit record of the parameter store. */
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
