/* SPDX-License-Identifier: MIT */
/*
 * port.h: everything that the controller needs of a machine. Used by firmware/app and the ports.
 *
 * A port is a folder port/<name>/ that defines these functions; they are bound at link time. It includes this file,
 * can/, port/common, port/cortex_m, port/semihost and its own files only. docs/guides/port-to-your-board.md makes one.
 *
 * Three contexts (drawn in docs/reference/architecture.md):
 *   receive   the CAN receive interrupt: calls port_handlers.receive for every accepted frame
 *   timer     the timer interrupt: calls port_handlers.tick once a period
 *   main loop  main(): everything that may wait
 * The port calls both handlers as if between port_lock() and port_unlock(): they never overlap each
 * other nor a critical section of the main loop, so data shared with the main loop needs no other
 * guard. (A board whose timer interrupt may preempt its receive interrupt masks the timer interrupt around each call of
 * `receive`; port_lock() is for the main loop only.) On Linux one thread stands for both interrupts.
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
    PORT_ERR_SYSTEM = -3, /* the machine cannot do it; the port has logged why */
};

/* --- Life --- */

/* Sets up clock, bus and store; both interrupts stay off. A hosted port reads its command line, a board ignores it (0,
 * NULL). Returns 0; otherwise main() returns the result as its exit status: the reason has been reported. Main loop,
 * once, before all others. */
int port_begin(int argc, char **argv);

/* Stops both interrupts, leaves the bus. Returns 0, or the exit status for main() when the machine
 * has failed (the bus is gone); that has been reported. Main loop. */
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

/* Lets only frames that pass one of them through to the receive handler. At most PORT_FILTERS of them. Main loop,
 * before port_start(). */
#define PORT_FILTERS 16
int port_can_accept(const struct can_match *filters, size_t count);

/* Queues one frame for sending, in call order per context. 0 or PORT_ERR_FULL. */
int port_can_send(const struct can_msg *message);

/* False while a frame that a tick has sent still waits for the bus; true when each has been sent on the bus, or is lost
 * (bus-off), and where the port cannot know. SYNC has a higher priority than setpoints, so a tick that finds its
 * predecessor's frames waiting sends none. First in a tick. Timer. */
bool port_can_delivered(void);

/* --- Time and tick --- */

struct port_handlers {
    void *self; /* handed to both */
    /* now_us: port_time_us() of this interrupt, so that the clock is read once only. */
    void (*receive)(void *self, const struct can_msg *message, uint32_t now_us);
    /* late_ns: how long after its due time the tick began (4.29 s at most are reported). A late tick is called late.
     * Where the port has the choice it skips none, and no two are closer than three quarters of a period; a timer whose
     * interrupts merge (SysTick) drops those that are a whole period late and is on time with the next. In both cases a
     * program continues with its next tick: only time is lost. */
    void (*tick)(void *self, uint32_t now_us, uint32_t late_ns);
};

/* Monotonic clocks that wrap round: only differences mean anything. */
uint32_t port_time_ns(void); /* wraps after 4.29 s */
uint32_t port_time_us(void); /* wraps after 71 minutes */

/* Turns both interrupts on; the first tick comes one period later. Main loop, once. */
int port_start(const struct port_handlers *handlers, uint32_t period_us);

/* Changes the period. The new value applies to the interval that ends with the next tick, or to the following one if
 * the timer has already loaded that interval. Main loop, in a critical section. */
void port_tick_period(uint32_t period_us);

/* For simulated drives, which run on a host that may stall, and can be faster than the clock. A tick that calls
 * port_tick_await() makes the next tick wait for port_tick_ready(), which the receive handler calls when all drives have
 * answered. The wait ends guard_us after the start of the present tick at the latest; while the host as a whole stalls,
 * this time does not run. If the wait goes beyond the due time of the next tick, that tick is late. At fast pace, and if
 * `hurry`, the next tick starts as soon as port_tick_ready() is called, before its due time. A board, whose timer knows
 * nothing but the clock, ignores both calls. */
void port_tick_await(uint32_t guard_us, bool hurry); /* timer */
void port_tick_ready(void);                          /* receive */

/* Whether ticks have to come in time because drives are real: then none is delayed for a main loop that gets no
 * processor time. Initially false. Boards, on which ticks are interrupts, ignore it. Main loop. */
void port_tick_urgent(bool urgent);

/* How well ticks come in time. Boards: PORT_TIMING_KEPT. Any context. */
enum port_timing {
    PORT_TIMING_KEPT = 0,     /* by an interrupt, a real-time thread, or virtual time */
    PORT_TIMING_REFUSED = 1,  /* the machine does not permit it: real drives must not be enabled */
    PORT_TIMING_ACCEPTED = 2, /* the same, and the user has accepted it by an option */
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

/* port_store_erase: erases a bank, its last 16 bytes first. port_store_write: the caller writes at ascending offsets
 * without gaps. Only before the last 16 bytes, which it writes by one call, there may be a gap. Between two writes the
 * data below the last whole multiple of 8 bytes can be read, after the last write all. 0 or PORT_ERR_STORE. */
int port_store_erase(unsigned bank);
int port_store_write(unsigned bank, uint32_t offset, const uint8_t *data, uint32_t size);

/* The bank as memory, aligned to 8, readable at any time and from any context. */
const uint8_t *port_store_data(unsigned bank);

/* --- RAM for chunks of streamed jobs --- */

/* The memory of the ring (app/stream), aligned to 8, and its bytes; 0: this port streams nothing. Lost with the power.
 * Always the same. Main loop. */
uint8_t *port_stream_memory(uint32_t *size);

/* The memory of the coefficient cache of streamed jobs (app/chunk_records), likewise; without any, nothing is
 * streamed. */
uint8_t *port_cache_memory(uint32_t *size);

/* --- Console --- */

enum port_level {
    PORT_NOTE,    /* only if it was requested (--verbose) */
    PORT_WARNING, /* always */
};

/* One line to the console: a fixed text and a number. Main loop. */
void port_log(enum port_level level, const char *text, int32_t value);

#endif
