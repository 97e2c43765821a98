/* SPDX-License-Identifier: MIT */
/*
 * fake_port: port.h for tests: time that the test moves, sent frames that the test takes,
 * interrupts that the test calls. Ends the test when a rule of port.h about the lock is broken.
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

/* What the application asked for. */
uint32_t fake_port_period_us(void);
uint32_t fake_port_awaited_us(void); /* port_tick_await of the last tick; 0: not called */
bool fake_port_hurry(void);          /* and in a hurry */
bool fake_port_ready(void);          /* port_tick_ready since the last tick */
unsigned fake_port_wakes(void);

/* From now on port_can_send, or port_store_write, fails. */
void fake_port_fail_send(bool fail);
void fake_port_fail_store(bool fail);

/* A bank has only so many bytes now. */
void fake_port_shrink_store(uint32_t bytes);

/* Turns the bits of one byte of the store. */
void fake_port_spoil_store(unsigned bank, uint32_t offset);

/* The store from now on, instead of memory; NULL: memory again. */
struct fake_port_store {
    uint32_t bank_bytes;
    int (*erase)(unsigned bank);
    int (*write)(unsigned bank, uint32_t offset, const uint8_t *data, uint32_t size);
    const uint8_t *(*data)(unsigned bank);
};
void fake_port_use_store(const struct fake_port_store *store);

/* What port_stop_insisted says from now on. */
void fake_port_insist(bool insisted);

/* Called by port_wait; may be NULL. */
void fake_port_on_wait(void (*hook)(void *context), void *context);

#endif
