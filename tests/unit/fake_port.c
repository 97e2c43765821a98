/* SPDX-License-Identifier: MIT */
/* Implements fake_port.h and port/port.h (see there) for tests, with a bus, a clock and a store in memory. Used by
 * app_bench, the tests of firmware/app and of port/stm32g4, and harnesses of tests/fuzz. One thread; no I/O. Changes
 * its own variable `self`, and fails the running test when a rule of port.h is broken. */
#include "fake_port.h"

#include <string.h>

#include "unity.h"

#define SENT_MAX 1024u

static struct {
    struct port_handlers handlers;
    struct can_match filters[PORT_FILTERS];
    size_t filter_count;
    struct can_match refused;
    uint32_t refusals;
    uint64_t now_ns;
    uint32_t period_us;
    uint32_t awaited_us;
    bool hurry;
    bool ready;
    bool locked;
    bool fail_send;
    bool hold;
    bool insisted;
    bool fail_store;
    uint32_t missing; /* bytes of a bank for a program */
    uint32_t operations;
    uint32_t power_off_at;
    bool urgent;
    enum port_timing timing;
    unsigned wakes;
    unsigned progress;
    uint32_t sent_head;
    uint32_t sent_tail;
    struct can_msg sent[SENT_MAX];
    uint8_t banks[PORT_STORE_BANKS_ALL][FAKE_PORT_BANK_BYTES] __attribute__((aligned(8)));
    uint8_t ring[FAKE_PORT_RING_BYTES] __attribute__((aligned(8)));
    uint8_t cache[FAKE_PORT_CACHE_BYTES] __attribute__((aligned(8)));
    uint32_t ring_missing;
    const struct fake_port_store *store;
    void (*wait_hook)(void *context);
    void *wait_context;
    void (*progress_hook)(void *context);
    void *progress_context;
    void (*unlock_hook)(void *context);
    void *unlock_context;
} self;

void fake_port_reset(void)
{
    memset(&self, 0, sizeof self);
    self.now_ns = UINT64_C(4294000000); /* soon to wrap, as clocks do */
}

void fake_port_advance_us(uint32_t us)
{
    self.now_ns += (uint64_t)us * 1000u;
}

bool fake_port_take(struct can_msg *message)
{
    if (self.sent_head == self.sent_tail) {
        return false;
    }
    *message = self.sent[self.sent_tail++ % SENT_MAX];
    return true;
}

void fake_port_tick(uint32_t late_ns)
{
    self.awaited_us = 0;
    self.hurry = false;
    self.ready = false;
    port_lock();
    self.handlers.tick(self.handlers.self, port_time_us(), late_ns);
    port_unlock();
}

void fake_port_receive(const struct can_msg *message)
{
    if (!can_match_any(self.filters, self.filter_count, message)) {
        return;
    }
    port_lock();
    self.handlers.receive(self.handlers.self, message, port_time_us());
    port_unlock();
}

uint32_t fake_port_period_us(void)
{
    return self.period_us;
}

uint32_t fake_port_awaited_us(void)
{
    return self.awaited_us;
}

bool fake_port_hurry(void)
{
    return self.hurry;
}

bool fake_port_ready(void)
{
    return self.ready;
}

bool fake_port_urgent(void)
{
    return self.urgent;
}

void fake_port_set_timing(enum port_timing timing)
{
    self.timing = timing;
}

void fake_port_refuse(const struct can_match *refused, uint32_t times)
{
    self.refused = *refused;
    self.refusals = times;
}

unsigned fake_port_progress(void)
{
    return self.progress;
}

unsigned fake_port_wakes(void)
{
    return self.wakes;
}

void fake_port_fail_send(bool fail)
{
    self.fail_send = fail;
}

void fake_port_shrink_store(uint32_t bytes)
{
    self.missing = FAKE_PORT_BANK_BYTES - bytes;
}

void fake_port_keep_store(void)
{
    static uint8_t kept[PORT_STORE_BANKS_ALL][FAKE_PORT_BANK_BYTES];
    const struct fake_port_store *store = self.store;
    memcpy(kept, self.banks, sizeof kept);
    fake_port_reset();
    memcpy(self.banks, kept, sizeof kept);
    self.store = store;
}

void fake_port_fail_store(bool fail)
{
    self.fail_store = fail;
}

void fake_port_spoil_store(unsigned bank, uint32_t offset)
{
    self.banks[bank][offset] ^= 0xFFu;
}

uint32_t fake_port_cut_store(uint32_t operation)
{
    const uint32_t done = self.operations;
    self.operations = 0;
    self.power_off_at = operation;
    return done;
}

void fake_port_use_store(const struct fake_port_store *store)
{
    self.store = store;
}

void fake_port_on_unlock(void (*hook)(void *context), void *context)
{
    self.unlock_hook = hook;
    self.unlock_context = context;
}

void fake_port_on_wait(void (*hook)(void *context), void *context)
{
    self.wait_hook = hook;
    self.wait_context = context;
}

int port_begin(int argc, char **argv)
{
    (void)argc;
    (void)argv;
    return 0;
}

int port_end(void)
{
    return 0;
}

bool port_stop_requested(void)
{
    return false;
}

bool port_stop_insisted(void)
{
    return self.insisted;
}

void fake_port_insist(bool insisted)
{
    self.insisted = insisted;
}

uint8_t port_node_id(void)
{
    return 1;
}

int port_can_accept(const struct can_match *filters, size_t count)
{
    if (count > PORT_FILTERS) {
        return PORT_ERR_SYSTEM;
    }
    memcpy(self.filters, filters, count * sizeof filters[0]);
    self.filter_count = count;
    return 0;
}

void fake_port_shrink_ring(uint32_t bytes)
{
    self.ring_missing = FAKE_PORT_RING_BYTES - bytes;
}

uint8_t *port_stream_memory(uint32_t *size)
{
    *size = FAKE_PORT_RING_BYTES - self.ring_missing;
    return self.ring;
}

uint8_t *port_cache_memory(uint32_t *size)
{
    *size = FAKE_PORT_CACHE_BYTES;
    return self.cache;
}

int port_can_send(const struct can_msg *message)
{
    if (self.fail_send) {
        return PORT_ERR_FULL;
    }
    if (self.refusals > 0u && can_match_any(&self.refused, 1, message)) {
        self.refusals--;
        return PORT_ERR_FULL;
    }
    TEST_ASSERT_TRUE_MESSAGE(self.sent_head - self.sent_tail < SENT_MAX, "nobody takes the frames");
    TEST_ASSERT_TRUE(message->id <= CAN_ID_MAX && message->len <= CAN_DATA_MAX);
    self.sent[self.sent_head++ % SENT_MAX] = *message;
    return 0;
}

void fake_port_hold_frames(bool hold)
{
    self.hold = hold;
}

bool port_can_delivered(void)
{
    return !self.hold;
}

uint32_t port_time_ns(void)
{
    return (uint32_t)self.now_ns;
}

uint32_t port_time_us(void)
{
    return (uint32_t)(self.now_ns / 1000u);
}

int port_start(const struct port_handlers *handlers, uint32_t period_us)
{
    self.handlers = *handlers;
    self.period_us = period_us;
    return 0;
}

void port_tick_period(uint32_t period_us)
{
    self.period_us = period_us;
}

void port_tick_await(uint32_t guard_us, bool hurry)
{
    self.awaited_us = guard_us;
    self.hurry = hurry;
}

void port_tick_urgent(bool urgent)
{
    self.urgent = urgent;
}

enum port_timing port_timing(void)
{
    return self.timing;
}

void port_tick_ready(void)
{
    self.ready = true;
}

void port_lock(void)
{
    TEST_ASSERT_FALSE_MESSAGE(self.locked, "the lock does not nest");
    self.locked = true;
}

void port_unlock(void)
{
    TEST_ASSERT_TRUE_MESSAGE(self.locked, "unlocked twice");
    self.locked = false;
    if (self.unlock_hook != NULL) {
        void (*hook)(void *context) = self.unlock_hook;
        self.unlock_hook = NULL;
        hook(self.unlock_context);
    }
}

void port_wait(uint32_t timeout_us)
{
    TEST_ASSERT_FALSE_MESSAGE(self.locked, "waits inside a critical section");
    fake_port_advance_us(timeout_us);
    if (self.wait_hook != NULL) {
        self.wait_hook(self.wait_context);
    }
}

void fake_port_on_progress(void (*hook)(void *context), void *context)
{
    self.progress_hook = hook;
    self.progress_context = context;
}

void port_progress(void)
{
    TEST_ASSERT_FALSE_MESSAGE(self.locked, "long work inside a critical section");
    self.progress++;
    if (self.progress_hook != NULL) {
        self.progress_hook(self.progress_context);
    }
}

void port_wake(void)
{
    self.wakes++;
}

/* Bytes that a bank of the memory has when nothing is missing. */
static uint32_t whole_size(unsigned bank)
{
    return bank < PORT_STORE_BANKS ? FAKE_PORT_BANK_BYTES : PORT_STORE_PARAMETER_BYTES;
}

uint32_t port_store_size(unsigned bank)
{
    if (self.store != NULL) {
        return self.store->size(bank);
    }
    return bank < PORT_STORE_BANKS ? FAKE_PORT_BANK_BYTES - self.missing : whole_size(bank);
}

/* One operation of the store: the erasing of a bank, or a byte. */
static bool power_is_gone(void)
{
    self.operations++;
    return self.power_off_at != 0u && self.operations >= self.power_off_at;
}

int port_store_erase(unsigned bank)
{
    TEST_ASSERT_TRUE(bank < PORT_STORE_BANKS_ALL);
    if (self.store != NULL) {
        return self.store->erase(bank);
    }
    if (self.fail_store || power_is_gone()) {
        return PORT_ERR_STORE;
    }
    memset(self.banks[bank], 0xFF, whole_size(bank));
    return 0;
}

int port_store_write(unsigned bank, uint32_t offset, const uint8_t *data, uint32_t size)
{
    TEST_ASSERT_TRUE(bank < PORT_STORE_BANKS_ALL);
    if (self.store != NULL) {
        return self.store->write(bank, offset, data, size);
    }
    if (self.fail_store || offset > whole_size(bank) || size > whole_size(bank) - offset) {
        return PORT_ERR_STORE;
    }
    for (uint32_t i = 0; i < size; ++i) {
        if (power_is_gone()) {
            return PORT_ERR_STORE;
        }
        self.banks[bank][offset + i] = data[i];
    }
    return 0;
}

const uint8_t *port_store_data(unsigned bank)
{
    return self.store != NULL ? self.store->data(bank) : self.banks[bank];
}

void port_log(enum port_level level, const char *text, int32_t value)
{
    (void)level;
    (void)text;
    (void)value;
    TEST_ASSERT_FALSE_MESSAGE(self.locked, "logs inside a critical section");
}
