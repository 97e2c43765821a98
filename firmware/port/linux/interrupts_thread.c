/* SPDX-License-Identifier: MIT */
/* Implements port/linux/interrupts_thread.h (see there): how the thread of the interrupts is made. Used by
 * port/linux/interrupts. Main loop. Starts a thread, sets its scheduler, locks the memory of the process, and writes
 * notes by port_log. */
#define _GNU_SOURCE
#include "port/linux/interrupts_thread.h"

#include <errno.h>
#include <sched.h>
#include <stddef.h>
#include <sys/mman.h>

#include "port/port.h"

#define PRIORITY 60 /* above the kernel's threaded interrupts (50) */

static int create(pthread_t *thread, void *(*run)(void *unused), int policy, int priority)
{
    pthread_attr_t attributes;
    const struct sched_param parameters = {.sched_priority = priority};
    (void)pthread_attr_init(&attributes);
    (void)pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
    (void)pthread_attr_setschedpolicy(&attributes, policy);
    (void)pthread_attr_setschedparam(&attributes, &parameters);
    const int error = pthread_create(thread, &attributes, run, NULL);
    (void)pthread_attr_destroy(&attributes);
    return error;
}

int interrupts_thread_real_time(pthread_t *thread, void *(*run)(void *unused), bool *permitted)
{
    *permitted = true;
    if (mlockall(MCL_CURRENT) != 0) {
        *permitted = false;
        port_log(PORT_NOTE, "memory is not locked, page faults can delay ticks: errno", errno);
    }
    const int error = create(thread, run, SCHED_FIFO, PRIORITY);
    if (error != EPERM) {
        return error;
    }
    *permitted = false;
    port_log(PORT_NOTE, "no permission for SCHED_FIFO, ticks come as the scheduler likes: errno",
             error);
    return create(thread, run, SCHED_OTHER, 0);
}

int interrupts_thread_batch(pthread_t *thread, void *(*run)(void *unused))
{
    const struct sched_param none = {.sched_priority = 0};
    const int error = pthread_create(thread, NULL, run, NULL);
    /* glibc refuses SCHED_BATCH as a thread attribute */
    if (error == 0) {
        (void)pthread_setschedparam(*thread, SCHED_BATCH, &none);
    }
    return error;
}
