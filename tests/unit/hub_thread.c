/* SPDX-License-Identifier: MIT */
/* Implements hub_thread.h (see there): a hub that runs in a thread of the test. Part of the C tests; starts a
 * thread, and opens sockets in /tmp. */
#define _GNU_SOURCE
#include "hub_thread.h"

#include <pthread.h>
#include <stdio.h>
#include <unistd.h>

#include "unity.h"

char hub_thread_paths[HUB_THREAD_BUSES][64];
struct hub hub_thread_hub;

static pthread_t thread;
static int pipe_fds[2];
static bool running;

static void *run(void *unused)
{
    (void)unused;
    while (hub_step(&hub_thread_hub, pipe_fds[0])) {
    }
    return NULL;
}

void hub_thread_begin(struct hub_options options)
{
    const char *paths[HUB_THREAD_BUSES];
    size_t failed = 0;
    for (unsigned i = 0; i < HUB_THREAD_BUSES; ++i) {
        (void)snprintf(hub_thread_paths[i], sizeof hub_thread_paths[i],
                       "/tmp/hodograph-test-hub-%ld-%u", (long)getpid(), i);
        (void)unlink(hub_thread_paths[i]);
        paths[i] = hub_thread_paths[i];
    }
    TEST_ASSERT_EQUAL(0, pipe(pipe_fds));
    TEST_ASSERT_EQUAL(0, hub_open(&hub_thread_hub, paths, HUB_THREAD_BUSES, options, &failed));
    TEST_ASSERT_EQUAL(0, pthread_create(&thread, NULL, run, NULL));
    running = true;
}

void hub_thread_end(void)
{
    if (!running) {
        return;
    }
    running = false;
    TEST_ASSERT_EQUAL(1, write(pipe_fds[1], "", 1));
    TEST_ASSERT_EQUAL(0, pthread_join(thread, NULL));
    hub_close(&hub_thread_hub);
    for (unsigned i = 0; i < HUB_THREAD_BUSES; ++i) {
        (void)unlink(hub_thread_paths[i]);
    }
    (void)close(pipe_fds[0]);
    (void)close(pipe_fds[1]);
}
