/* SPDX-License-Identifier: MIT */
/*
 * port.h: everything that the controller needs of its hardware and operating system (the *platform*). Used by
 * firmware/app and the ports.
 *
 * A port is a folder port/<name>/ that defines these functions for one platform; they are bound at link time. It
 * includes this file, can/, port/common, port/cortex_m, port/semihost and its own files only.
 * docs/guides/port-to-your-board.md makes one.
 *
 * Three contexts (drawn in docs/reference/architecture.md):
 *   receive   the CAN receive interrupt: calls port_handlers.receive for every accepted frame
 *   timer     the timer interrupt: calls port_handlers.tick once a period
 *   main loop  main(): everything that may wait
 * The port calls both handlers as if between port_lock() and port_unlock(): they never overlap each other nor a
 * critical section of the main loop. So data shared with the main loop needs no other guard. Only the main loop calls
 * port_lock(). If the timer interrupt of a board may preempt its receive interrupt, the board therefore masks the timer
 * interrupt around each call of `receive`. On Linux one thread stands for both interrupts.
 *
 * Errors: 0 or a negative PORT_ERR_... Only port_wait() sleeps. port_lock() waits for a handler that runs (Linux).
 * port_store_erase() and port_store_write() return when the memory has finished, which takes 22 ms for a page of the
 * STM32G4 that has to be erased. If its comment states nothing else, a function may be called from any context. Call
 * none before port_begin().
 */
#ifndef PORT_PORT_H
#define PORT_PORT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "can/can_frame.h"
#include "can/can_match.h"

enum port_error {
    PORT_ERR_FULL = -1,   /* no room to send: the frame is not queued */
    PORT_ERR_STORE = -2,  /* outside the bank, or the memory did not take it */
    PORT_ERR_SYSTEM = -3, /* the platform cannot do it; the port has logged why */
};

/* --- Life --- */

/* Sets up clock, bus and store; both interrupts stay off. A hosted port reads its command line, a board ignores it (0,
 * NULL). Returns 0; otherwise main() returns the result as its exit status: the reason has been reported. Main loop,
 * once, before all others. */
int port_begin(int argc, char **argv);

/* Stops both interrupts, leaves the bus. Returns 0. If the platform has failed (the bus is gone), it returns the exit
 * status for main(), and the failure has been reported. Main loop. */
int port_end(void);

/* True when the end of the controller is requested (SIGTERM, SIGINT, SIGHUP); never on a board without such a
 * request. */
bool port_stop_requested(void);

/* True when it has been requested a second time: the drives then stop by their own ramps, not along the path. */
bool port_stop_insisted(void);

/* CANopen node number of this controller, 1 ... 127: from the command line, a build option or switches of the board. A
 * stored 0x2054 other than 0 replaces it. */
uint8_t port_node_id(void);

/* --- CAN, classic frames --- */

/* Sets the filters, at most PORT_FILTERS of them. Only frames that pass at least one filter come to the receive
 * handler. 0 or PORT_ERR_SYSTEM. Main loop, before port_start(). */
#define PORT_FILTERS 16
int port_can_accept(const struct can_match *filters, size_t count);

/* Queues one frame for sending. Frames of one context are sent in the order of the calls. 0 or PORT_ERR_FULL. */
int port_can_send(const struct can_msg *message);

/* False while a frame that a tick has sent still waits for the bus. True when each of them has been sent on the bus or
 * is lost (bus-off), and where the port cannot know. A tick calls it first. SYNC has a higher priority than setpoints,
 * so a tick that finds frames of its predecessor waiting sends no frame. Timer. */
bool port_can_delivered(void);

/* --- Time and tick --- */

struct port_handlers {
    void *self; /* handed to both */
    /* now_us: port_time_us() of this interrupt, so that the clock is read once only. */
    void (*receive)(void *self, const struct can_msg *message, uint32_t now_us);
    /* late_ns: how long after its due time the tick began (4.29 s at most are reported). A tick that is late is called
     * as soon as possible. Two ticks are at least three quarters of a period apart. If a tick is late by more than a
     * period, the periods that have passed are not made up for: due times count from this tick. The interrupts of some
     * timers merge (SysTick). Such a port loses a tick that is a whole period late, is on time with the next, and does
     * not keep the distance. In all cases a program continues with its next setpoint: only time is lost. */
    void (*tick)(void *self, uint32_t now_us, uint32_t late_ns);
};

/* Monotonic clocks that wrap round: only differences mean anything. */
uint32_t port_time_ns(void); /* wraps after 4.29 s */
uint32_t port_time_us(void); /* wraps after 71 minutes */

/* Turns both interrupts on; the first tick comes one period later. Main loop, once. */
int port_start(const struct port_handlers *handlers, uint32_t period_us);

/* Changes the period. The new value applies to the interval up to the next tick. If the timer has already loaded this
 * interval, it applies to the one after it. Main loop, in a critical section. */
void port_tick_period(uint32_t period_us);

/* For simulated drives. They run on a computer that may stall, and they can be faster than the clock. A tick that calls
 * port_tick_await() makes the next tick wait for port_tick_ready(). The receive handler calls this function when all
 * drives have answered. The wait ends guard_us after the start of the present tick at the latest. Time in which the
 * whole computer stalls does not count. If the wait ends after the due time of the next tick, that tick is late. At
 * fast pace, if `hurry` is true, the next tick starts as soon as port_tick_ready() is called, also before its due time.
 * A board whose timer follows the clock alone ignores both calls. */
void port_tick_await(uint32_t guard_us, bool hurry); /* timer */
void port_tick_ready(void);                          /* receive */

/* urgent: drives are real, so ticks have to come in time. While it is false, as at the beginning, a hosted port may
 * delay ticks so that the main loop gets processor time. While it is true it delays none. Boards, on which ticks are
 * interrupts, ignore it. Main loop. */
void port_tick_urgent(bool urgent);

/* How well ticks come in time. Boards: PORT_TIMING_KEPT. Any context. */
enum port_timing {
    PORT_TIMING_KEPT = 0,     /* by an interrupt, a real-time thread, or virtual time */
    PORT_TIMING_REFUSED = 1,  /* not permitted by the computer: real drives must not be enabled */
    PORT_TIMING_ACCEPTED = 2, /* not permitted, but the user has accepted this by an option */
};
enum port_timing port_timing(void);

/* --- Main loop --- */

/* Critical section: holds off both interrupts. Short, not nested, main loop only. On Linux port_lock() waits for the
 * handler that runs. */
void port_lock(void);
void port_unlock(void);

/* Sleeps until port_wake(), a request to stop, or timeout_us; sometimes less. Main loop, outside the critical
 * section. */
void port_wait(uint32_t timeout_us);

/* Ends the present or the next port_wait(). */
void port_wake(void);

/* Reports progress in long work, during which the main loop does not call port_wait(). A port with a watchdog feeds it,
 * provided that ticks come as well; others have nothing to do. Main loop. */
void port_progress(void);

/* --- Store: two banks for programs, two for parameters, so that an interrupted write leaves the other bank complete.
 * Main loop --- */

#define PORT_STORE_BANKS      2u /* 0 and 1: programs, as large as there is room for */
#define PORT_STORE_PARAMETERS 2u /* 2 and 3: parameters, at least PORT_STORE_PARAMETER_BYTES each */
#define PORT_STORE_BANKS_ALL  4u
#define PORT_STORE_PARAMETER_BYTES 2048u

uint32_t port_store_size(unsigned bank); /* bytes of a bank; equal in a pair */

/* The last 16 bytes of a bank are its commit record, which makes the content valid.
 * port_store_erase: erases a bank, its last 16 bytes first.
 * port_store_write: the caller writes at ascending offsets. There is no gap between two writes, except before the last
 * 16 bytes, which are one call. A port may keep back up to 7 bytes until they make 8 with those of the next write. So
 * between two writes the caller reads only data below the last multiple of 8 bytes, and after the last write all.
 * Both return 0 or PORT_ERR_STORE. */
int port_store_erase(unsigned bank);
int port_store_write(unsigned bank, uint32_t offset, const uint8_t *data, uint32_t size);

/* The bank as memory, aligned to 8, readable at any time and from any context. */
const uint8_t *port_store_data(unsigned bank);

/* --- RAM for chunks of streamed jobs --- */

/* The memory of the ring (app/stream), aligned to 8, and its size in bytes. Size 0: the controller refuses streamed
 * jobs. Each call returns the same memory. Its content may be lost at power-off. Main loop. */
uint8_t *port_stream_memory(uint32_t *size);

/* The same for the memory of the coefficient cache of streamed jobs (app/chunk_records). */
uint8_t *port_cache_memory(uint32_t *size);

/* --- Console --- */

enum port_level {
    PORT_NOTE,    /* only if it was requested (--verbose) */
    PORT_WARNING, /* always */
};

/* One line to the console: a fixed text and a number. Main loop. */
void port_log(enum port_level level, const char *text, int32_t value);

#endif
