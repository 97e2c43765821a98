/* SPDX-License-Identifier: MIT */
#define _GNU_SOURCE
#include "port/linux/interrupts.h"

#include <errno.h>
#include <poll.h>
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <string.h>
#include <sys/mman.h>

#include "port/linux/clock.h"
#include "port/linux/schedule.h"

#define PRIORITY         60         /* above the kernel's threaded interrupts (50) */
#define LONGEST_SLEEP_NS 100000000u /* how late a wish to end may be noticed */

static struct {
    pthread_mutex_t lock; /* port_lock(); guards schedule too */
    pthread_t thread;
    bool started;
    volatile sig_atomic_t ending;
    volatile sig_atomic_t error;
    struct can_socket *socket;
    struct port_handlers handlers;
    struct schedule schedule;
    bool lock_step;
} self;

void port_lock(void)
{
    (void)pthread_mutex_lock(&self.lock);
}

void port_unlock(void)
{
    (void)pthread_mutex_unlock(&self.lock);
}

void port_tick_period(uint32_t period_us)
{
    self.schedule.period_ns = (uint64_t)period_us * 1000u;
}

void port_tick_await(uint32_t guard_us)
{
    schedule_await(&self.schedule, (uint64_t)guard_us * 1000u);
}

void port_tick_ready(void)
{
    schedule_ready(&self.schedule, clock_ns());
}

static void run_tick(uint64_t now_ns)
{
    port_lock();
    const uint64_t late_ns = schedule_start(&self.schedule, now_ns);
    self.handlers.tick(self.handlers.self, late_ns < UINT32_MAX ? (uint32_t)late_ns : UINT32_MAX);
    schedule_finish(&self.schedule, now_ns);
    port_unlock();
}

static void hand_over(const struct can_msg *messages, int count)
{
    port_lock();
    for (int i = 0; i < count; ++i) {
        self.handlers.receive(self.handlers.self, &messages[i]);
    }
    port_unlock();
}

/* Only one batch: a flood of frames must not keep a due tick waiting. */
static void receive_waiting(void)
{
    struct can_msg messages[CAN_SOCKET_BATCH];
    int more = 0;
    const int count = can_socket_receive(self.socket, messages, &more);
    if (count < 0) {
        self.error = count;
    } else if (count > 0) {
        hand_over(messages, count);
    }
}

static void sleep_until(uint64_t due_ns)
{
    struct pollfd waited = {.fd = self.socket->fd, .events = POLLIN, .revents = 0};
    const uint64_t now_ns = clock_ns();
    uint64_t wait_ns = due_ns > now_ns ? due_ns - now_ns : 0u;
    if (wait_ns > LONGEST_SLEEP_NS) {
        wait_ns = LONGEST_SLEEP_NS;
    }
    const struct timespec timeout = clock_timespec(wait_ns);
    if (ppoll(&waited, 1, &timeout, NULL) > 0) {
        receive_waiting();
    }
}

static void *run(void *unused)
{
    (void)unused;
    while (!self.ending && self.error == 0) {
        sleep_until(self.schedule.due_ns);
        const uint64_t now_ns = clock_ns();
        if (now_ns >= self.schedule.due_ns) {
            run_tick(now_ns);
        }
    }
    port_wake();
    return NULL;
}

static int make_lock(void)
{
    pthread_mutexattr_t attributes;
    int error = pthread_mutexattr_init(&attributes);
    if (error != 0) {
        return error;
    }
    (void)pthread_mutexattr_setprotocol(&attributes, PTHREAD_PRIO_INHERIT);
    error = pthread_mutex_init(&self.lock, &attributes);
    if (error == ENOTSUP) {
        error = pthread_mutex_init(&self.lock, NULL);
    }
    (void)pthread_mutexattr_destroy(&attributes);
    return error;
}

int interrupts_begin(struct can_socket *socket, bool lock_step)
{
    memset(&self, 0, sizeof self);
    self.socket = socket;
    self.lock_step = lock_step;
    return make_lock() == 0 ? 0 : PORT_ERR_SYSTEM;
}

static int create_thread(bool real_time)
{
    pthread_attr_t attributes;
    (void)pthread_attr_init(&attributes);
    if (real_time) {
        const struct sched_param priority = {.sched_priority = PRIORITY};
        (void)pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
        (void)pthread_attr_setschedpolicy(&attributes, SCHED_FIFO);
        (void)pthread_attr_setschedparam(&attributes, &priority);
    }
    const int error = pthread_create(&self.thread, &attributes, run, NULL);
    (void)pthread_attr_destroy(&attributes);
    return error;
}

int interrupts_start(const struct port_handlers *handlers, uint32_t period_us)
{
    self.handlers = *handlers;
    schedule_begin(&self.schedule, clock_ns(), (uint64_t)period_us * 1000u, self.lock_step);
    if (!self.lock_step && mlockall(MCL_CURRENT) != 0) {
        port_log(PORT_NOTE, "memory is not locked, page faults can delay ticks: errno", errno);
    }
    int error = create_thread(!self.lock_step);
    if (error != 0 && !self.lock_step) {
        port_log(PORT_NOTE,
                 "no permission for SCHED_FIFO, ticks come as the scheduler likes: errno", error);
        error = create_thread(false);
    }
    self.started = error == 0;
    return error == 0 ? 0 : PORT_ERR_SYSTEM;
}

void interrupts_end(void)
{
    self.ending = 1;
    if (self.started) {
        (void)pthread_join(self.thread, NULL);
        self.started = false;
    }
}

int interrupts_error(void)
{
    return (int)self.error;
}
