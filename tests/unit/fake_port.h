/* SPDX-License-Identifier: MIT */
/*
 * fake_port: port.h for tests: time that the test moves, sent frames that the test takes, interrupts that the test
 * calls. Ends the test when a rule of port.h about the lock is broken. Used by app_bench, the tests of firmware/app and
 * of port/stm32g4, and harnesses of tests/fuzz. One thread; no I/O. Changes only its own variable.
 */
#ifndef TESTS_UNIT_FAKE_PORT_H
#define TESTS_UNIT_FAKE_PORT_H

#include <stdbool.h>
#include <stdint.h>

#include "port/port.h"

#define FAKE_PORT_BANK_BYTES 65536u

void fake_port_reset(void);

void fake_port_advance_us(uint32_t us);

/* The oldest frame sent and not yet taken; false: none. */
bool fake_port_take(struct can_msg *message);

/* Interrupts, called as a port does: a frame that the filters of port_can_accept do not pass is not received. */
void fake_port_tick(uint32_t late_ns);
void fake_port_receive(const struct can_msg *message);

/* What the application requested. */
uint32_t fake_port_period_us(void);
uint32_t fake_port_awaited_us(void); /* port_tick_await of the last tick; 0: not called */
bool fake_port_hurry(void);          /* and in a hurry */
bool fake_port_urgent(void);         /* port_tick_urgent, last */
bool fake_port_ready(void);          /* port_tick_ready since the last tick */
unsigned fake_port_wakes(void);
unsigned fake_port_progress(void); /* calls of port_progress */

/* Sets the result of port_timing() from now on. */
void fake_port_set_timing(enum port_timing timing);

/* So many of the next frames that pass this filter are refused. */
void fake_port_refuse(const struct can_match *refused, uint32_t times);

/* Sets the result of port_can_delivered from now on: frames of ticks wait for the bus, or not. */
void fake_port_hold_frames(bool hold);

/* From now on port_can_send, or port_store_write, fails. */
void fake_port_fail_send(bool fail);
void fake_port_fail_store(bool fail);

/* From its n-th operation on (the erasing of a bank, or a byte) the store takes nothing more, as when the power has
 * gone; 0: it takes all. Returns how many operations there were since the last call. */
uint32_t fake_port_cut_store(uint32_t operation);

/* fake_port_reset, but what is in the store stays, as over a loss of power. */
void fake_port_keep_store(void);

/* A bank for programs has only so many bytes now. */
void fake_port_shrink_store(uint32_t bytes);

/* The ring of streamed jobs has only so many bytes from now on: before controller_init. */
#define FAKE_PORT_RING_BYTES  (256u * 1024u)
#define FAKE_PORT_CACHE_BYTES (8u * 1024u)
void fake_port_shrink_ring(uint32_t bytes);

/* Turns the bits of one byte of the store. */
void fake_port_spoil_store(unsigned bank, uint32_t offset);

/* The store from now on, instead of memory; NULL: memory again. */
struct fake_port_store {
    uint32_t (*size)(unsigned bank);
    int (*erase)(unsigned bank);
    int (*write)(unsigned bank, uint32_t offset, const uint8_t *data, uint32_t size);
    const uint8_t *(*data)(unsigned bank);
};
void fake_port_use_store(const struct fake_port_store *store);

/* Called once, after the next critical section: an interrupt between two of them. */
void fake_port_on_unlock(void (*hook)(void *context), void *context);
/* Sets the result of port_stop_insisted from now on. */
void fake_port_insist(bool insisted);

/* Called by port_progress; may be NULL. */
void fake_port_on_progress(void (*hook)(void *context), void *context);

/* Called by port_wait; may be NULL. */
void fake_port_on_wait(void (*hook)(void *context), void *context);

#endif
