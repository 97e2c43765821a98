/* SPDX-License-Identifier: MIT */
/* clock: the monotonic clock of the Linux port, in 64 bits. Users define _GNU_SOURCE first. */
#ifndef PORT_LINUX_CLOCK_H
#define PORT_LINUX_CLOCK_H

#include <stdint.h>
#include <time.h>

#define CLOCK_NS_PER_S 1000000000u

/* Monotonic. */
static inline uint64_t clock_ns(void)
{
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * CLOCK_NS_PER_S + (uint64_t)now.tv_nsec;
}

static inline struct timespec clock_timespec(uint64_t ns)
{
    struct timespec time;
    time.tv_sec = (time_t)(ns / CLOCK_NS_PER_S);
    time.tv_nsec = (long)(ns % CLOCK_NS_PER_S);
    return time;
}

#endif
