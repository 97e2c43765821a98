/* SPDX-License-Identifier: MIT */
/* end_signals: SIGTERM and SIGINT as a descriptor that can be polled. Used by the programs of sim/. Main thread. */
#ifndef PORT_LINUX_END_SIGNALS_H
#define PORT_LINUX_END_SIGNALS_H

/* From now on the two signals make a file descriptor readable, so that no handler runs in the middle of anything.
 * Call it before the first thread is made. Returns the descriptor, the caller's to close, or -1 with errno set. */
int end_signals_open(void);

#endif
