/* SPDX-License-Identifier: MIT */
/* interrupts_thread: creates the thread for the interrupts: under SCHED_FIFO for real time, or as a batch thread for
 * the fast pace. Used by port/linux/interrupts. Main loop. Starts a thread, sets its scheduler, locks the memory of the
 * process, and writes notes by port_log. */
#ifndef PORT_LINUX_INTERRUPTS_THREAD_H
#define PORT_LINUX_INTERRUPTS_THREAD_H

#include <pthread.h>
#include <stdbool.h>

/* Starts `run` under SCHED_FIFO, with memory locked; where that is not permitted prints one line and starts it as an
 * ordinary thread. 0 or an errno. */
int interrupts_thread_real_time(pthread_t *thread, void *(*run)(void *unused), bool *permitted);

/* Starts `run` under SCHED_BATCH: it does not interrupt the simulated drives when the first of them has answered, but
 * is woken once for all answers. 0 or an errno. */
int interrupts_thread_batch(pthread_t *thread, void *(*run)(void *unused));

#endif
