/* SPDX-License-Identifier: MIT */
/*
 * interrupts: one thread that stands for the CAN receive interrupt and the timer interrupt of a microcontroller.
 *
 * It sleeps until a frame comes or a tick is due, passes on every waiting frame, then runs the tick. Both handlers run
 * with the lock of port_lock() held. At real-time pace it requests SCHED_FIFO and locked memory; if that is not
 * permitted it prints one line and runs as an ordinary thread. Ticks are delayed for a main loop that gets no processor
 * time (schedule.h). At fast pace it is a batch thread, so that the simulated drives for which it waits get the
 * processor first.
 *
 * In virtual time (clock.h) there is no thread: the main loop runs the interrupts while it sleeps, so that the work of
 * the controller is one sequence.
 *
 * Used by port_linux.c. Main loop, except interrupts_in_tick (any context). Starts and ends the thread, receives frames
 * from the socket, and calls the handlers of the application.
 */
#ifndef PORT_LINUX_INTERRUPTS_H
#define PORT_LINUX_INTERRUPTS_H

#include <stdbool.h>
#include <stdint.h>

#include "port/linux/can_socket.h"
#include "port/port.h"

/* Prepares the lock. 0 or PORT_ERR_SYSTEM. */
int interrupts_begin(struct can_socket *socket, bool lock_step);

/* Starts the thread; the caller is the main loop. 0 or PORT_ERR_SYSTEM. */
int interrupts_start(const struct port_handlers *handlers, uint32_t period_us);

/* The main loop is about to sleep, for INTERRUPTS_SLEEP_MAX_US at most: it has got processor time (schedule.h). */
#define INTERRUPTS_SLEEP_MAX_US 10000u
void interrupts_main_loop_sleeps(void);

/* Virtual time: sleeps until an interrupt comes, for `longest_ns` at most, and runs it. Main loop. */
void interrupts_run(uint64_t longest_ns);

/* Whether the caller is a tick. */
bool interrupts_in_tick(void);

/* Ends the thread and waits for it. Harmless when it never started. */
void interrupts_end(void);

/* Negative errno if the bus has failed (interface down or removed), which ends the thread; else 0. */
int interrupts_error(void);

/* Whether ticks come in time: a real-time thread with locked memory, or virtual time. From interrupts_start on. */
bool interrupts_keep_time(void);

#endif
