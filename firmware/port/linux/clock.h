/* SPDX-License-Identifier: MIT */
/* clock: small conversions for the Linux port. */
#ifndef PORT_LINUX_CLOCK_H
#define PORT_LINUX_CLOCK_H

#include <stdint.h>
#include <time.h>

#define CLOCK_NS_PER_S 1000000000u

static inline struct timespec clock_timespec(uint64_t ns)
{
    struct timespec time;
    time.tv_sec = (time_t)(ns / CLOCK_NS_PER_S);
    time.tv_nsec = (long)(ns % CLOCK_NS_PER_S);
    return time;
}

#endif
