/* SPDX-License-Identifier: MIT */
/* end_signals: SIGTERM and SIGINT as a descriptor that can be polled. Used by hub/main, injector/main and node/main.
 * Main thread. Opens the descriptor, and blocks both signals in the calling thread and in all threads that are made
 * later. */
#ifndef PORT_LINUX_END_SIGNALS_H
#define PORT_LINUX_END_SIGNALS_H

/* From now on the two signals make a file descriptor readable, so that no handler interrupts other code. Call it before
 * the first thread is made. Returns the descriptor, which the caller has to close, or -1 with errno set. */
int end_signals_open(void);

#endif
