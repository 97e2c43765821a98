/* SPDX-License-Identifier: MIT */
/* Implements port/linux/interrupts.h (see there): the thread that stands for both interrupts of a board, and what the
 * main loop shares with it. Used by port_linux.c. Main loop, except interrupts_in_tick (any context). Starts and ends
 * the thread, receives frames from the socket, and calls the handlers of the application. */
#define _GNU_SOURCE
#include "port/linux/interrupts.h"

#include <errno.h>
#include <pthread.h>
#include <string.h>
#include <time.h>

#include "port/linux/clock.h"
#include "port/linux/interrupts_thread.h"
#include "port/linux/schedule.h"

#define LONGEST_SLEEP_NS 100000000u /* the most until a request to end is noticed */
#define BATCHES_MAX      8u

static struct {
    pthread_mutex_t lock; /* port_lock(); guards schedule too */
    pthread_t thread;
    bool running; /* port_start() was called */
    bool started; /* there is a thread */
    bool ending;  /* these two by atomic access: C99 has none, gcc and clang have builtins */
    int error;
    struct can_socket *socket;
    struct port_handlers handlers;
    struct schedule schedule;
    uint64_t now_ns; /* of the present interrupt */
    bool lock_step;
    bool real_time; /* ticks come in time, as far as the machine permits */
    clockid_t main_loop_clock;
    uint32_t main_loop_sleeps; /* atomic too */
} self;

static __thread bool in_tick;

bool interrupts_in_tick(void)
{
    return in_tick;
}

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

void port_tick_urgent(bool urgent)
{
    port_lock();
    self.schedule.urgent = urgent;
    port_unlock();
}

void port_tick_await(uint32_t guard_us, bool hurry)
{
    schedule_await(&self.schedule, (uint64_t)guard_us * 1000u, hurry);
}

void port_tick_ready(void)
{
    schedule_ready(&self.schedule, self.now_ns);
}

static uint32_t now_us(void)
{
    return (uint32_t)(self.now_ns / 1000u);
}

static void run_tick(void)
{
    port_lock();
    const uint64_t late_ns = schedule_start(&self.schedule, self.now_ns);
    in_tick = true;
    self.handlers.tick(self.handlers.self, now_us(),
                       late_ns < UINT32_MAX ? (uint32_t)late_ns : UINT32_MAX);
    in_tick = false;
    schedule_finish(&self.schedule, self.schedule.hurry ? self.now_ns : clock_ns());
    port_unlock();
}

/* In virtual time each frame is received at the instant at which it came, however late it is taken. */
static void hand_over(const struct can_msg *messages, int count)
{
    port_lock();
    for (int i = 0; i < count; ++i) {
        if (clock_is_virtual()) {
            self.now_ns = self.socket->stamps_ns[i];
        }
        self.handlers.receive(self.handlers.self, &messages[i], now_us());
    }
    port_unlock();
}

/* Takes all received frames before a due tick, so that no answer in the socket counts as missing. But a flood of frames
 * must not delay the tick for ever. */
static void receive_waiting(void)
{
    struct can_msg messages[CAN_SOCKET_BATCH];
    int more = 1;
    for (unsigned i = 0; i < BATCHES_MAX && more != 0; ++i) {
        const int count = can_socket_receive(self.socket, messages, &more);
        if (count < 0) {
            __atomic_store_n(&self.error, count, __ATOMIC_RELEASE);
        } else if (count > 0) {
            hand_over(messages, count);
        }
    }
}

/* In virtual time answers of drives are taken when the next tick may start, at the earliest; those that are missing
 * then end the wait (clock_wake_for_all).
 *
 * The clock is a system call where the kernel itself is a process, and there the pace counts: so at
 * lock step the time of the last interrupt is near enough for a guard time. */
static uint64_t time_to_sleep_ns(void)
{
    const uint64_t since_ns = self.schedule.hurry ? self.now_ns : clock_ns();
    const uint64_t wait_ns = self.schedule.due_ns > since_ns ? self.schedule.due_ns - since_ns : 0u;
    if (clock_is_virtual() && self.schedule.awaiting && since_ns < self.schedule.earliest_ns) {
        return self.schedule.earliest_ns - since_ns;
    }
    const uint64_t longest_ns = self.schedule.awaiting ? SCHEDULE_SLICE_NS : LONGEST_SLEEP_NS;
    return wait_ns < longest_ns ? wait_ns : longest_ns;
}

void interrupts_main_loop_sleeps(void)
{
    (void)__atomic_add_fetch(&self.main_loop_sleeps, 1u, __ATOMIC_RELAXED);
}

static uint64_t main_loop_had_ns(void)
{
    struct timespec had = {0, 0};
    (void)clock_gettime(self.main_loop_clock, &had);
    return (uint64_t)had.tv_sec * CLOCK_NS_PER_S + (uint64_t)had.tv_nsec;
}

/* At lock step this thread is not a real-time one, and the scheduler is fair. */
static bool may_yield(void)
{
    const uint32_t sleeps = __atomic_load_n(&self.main_loop_sleeps, __ATOMIC_RELAXED);
    return !self.lock_step && !clock_is_virtual() &&
           schedule_overdue(&self.schedule, self.now_ns, sleeps) &&
           schedule_yield(&self.schedule, self.now_ns, main_loop_had_ns());
}

/* Sleeps until frames come or a tick is due, `longest_ns` at most, and handles them. */
static void step(uint64_t longest_ns)
{
    struct pollfd waited = {.fd = self.socket->fd, .events = POLLIN, .revents = 0};
    const uint64_t wait_ns = time_to_sleep_ns();
    clock_wake_for_all(self.now_ns >= self.schedule.earliest_ns);
    const int ready = clock_poll(&waited, 1, 1, wait_ns < longest_ns ? wait_ns : longest_ns);
    const uint64_t woken_ns = clock_ns();
    self.now_ns = woken_ns;
    if (ready > 0) {
        receive_waiting();
        self.now_ns = woken_ns;
    } else if (ready < 0 && ready != -EINTR) {
        __atomic_store_n(&self.error, ready, __ATOMIC_RELEASE);
        clock_leave(); /* the shutdown needs a clock that advances */
    }
    schedule_wait(&self.schedule, self.now_ns);
    if (self.now_ns >= self.schedule.due_ns && !may_yield()) {
        run_tick();
    }
}

static void *run(void *unused)
{
    (void)unused;
    while (!__atomic_load_n(&self.ending, __ATOMIC_ACQUIRE) && interrupts_error() == 0) {
        step(UINT64_MAX);
    }
    port_wake();
    return NULL;
}

void interrupts_run(uint64_t longest_ns)
{
    if (self.running) {
        step(longest_ns);
    } else if (clock_poll(NULL, 0, 0, longest_ns) < 0) {
        clock_leave();
    }
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
    self.lock_step = lock_step && !clock_is_virtual();
    return make_lock() == 0 ? 0 : PORT_ERR_SYSTEM;
}

int interrupts_start(const struct port_handlers *handlers, uint32_t period_us)
{
    self.handlers = *handlers;
    self.now_ns = clock_ns();
    if (pthread_getcpuclockid(pthread_self(), &self.main_loop_clock) != 0) {
        return PORT_ERR_SYSTEM;
    }
    schedule_begin(&self.schedule, self.now_ns, (uint64_t)period_us * 1000u, self.lock_step);
    self.running = true;
    self.real_time = true;
    if (clock_is_virtual()) {
        return 0;
    }
    self.real_time = !self.lock_step;
    const int error = self.lock_step
                          ? interrupts_thread_batch(&self.thread, run)
                          : interrupts_thread_real_time(&self.thread, run, &self.real_time);
    self.started = error == 0;
    return error == 0 ? 0 : PORT_ERR_SYSTEM;
}

void interrupts_end(void)
{
    self.running = false;
    __atomic_store_n(&self.ending, true, __ATOMIC_RELEASE);
    if (self.started) {
        (void)pthread_join(self.thread, NULL);
        self.started = false;
    }
}

bool interrupts_keep_time(void)
{
    return self.real_time;
}

int interrupts_error(void)
{
    return __atomic_load_n(&self.error, __ATOMIC_ACQUIRE);
}
