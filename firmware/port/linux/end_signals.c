/* SPDX-License-Identifier: MIT */
/* Implements port/linux/end_signals.h (see there): SIGTERM and SIGINT as something to wait for. Used by hub/main,
 * injector/main and node/main. Main thread. It blocks both signals in the calling thread and in all threads that are
 * made later. Opens the descriptor. */
#define _GNU_SOURCE
#include "port/linux/end_signals.h"

#include <signal.h>
#include <stddef.h>
#include <sys/signalfd.h>

int end_signals_open(void)
{
    sigset_t set;
    (void)sigemptyset(&set);
    (void)sigaddset(&set, SIGTERM);
    (void)sigaddset(&set, SIGINT);
    (void)sigprocmask(SIG_BLOCK, &set, NULL);
    return signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK);
}
