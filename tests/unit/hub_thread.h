/* SPDX-License-Identifier: MIT */
/* hub_thread: a hub that runs in a thread of the test. Used by the tests of sim/hub and by test_drives.c. Starts a
 * thread, which makes sockets. */
#ifndef HUB_THREAD_H
#define HUB_THREAD_H

#include "hub/hub.h"

#define HUB_THREAD_BUSES 2u

/* Paths of its buses. */
extern char hub_thread_paths[HUB_THREAD_BUSES][64];

/* Only to be read when the thread has ended. */
extern struct hub hub_thread_hub;

void hub_thread_begin(struct hub_options options);

/* Ends it; harmless when it has ended. */
void hub_thread_end(void);

#endif
