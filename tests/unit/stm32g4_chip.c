/* SPDX-License-Identifier: MIT */
/* Implements stm32g4_chip.h (see there): a register model of an STM32G474. Part of the C tests; no I/O. */
#include "stm32g4_chip.h"

#include <stdio.h>
#include <string.h>

#include "fdcan_model.h"
#include "flash_model.h"
#include "port/stm32g4/cpu.h"
#include "port/stm32g4/reg.h"
#include "unity.h"

#define PLAIN_MAX 256u
#define LINES_MAX 102u
#define SAID_SIZE 1024u

enum { TIM2 = 0x40000000, TIM5 = 0x40000C00, LPUART1_TDR = 0x40008028 };
enum {
    CR1 = 0x00,
    DIER = 0x0C,
    SR = 0x10,
    EGR = 0x14,
    CNT = 0x24,
    PSC = 0x28,
    ARR = 0x2C,
    CCR1 = 0x34
};

struct timer {
    uint32_t count;
    uint32_t compare;
    uint32_t prescaler;      /* in force */
    uint32_t prescaler_next; /* from the next update on */
    bool runs;
    bool interrupt_on;
    bool matched;
};

struct plain {
    uint32_t address;
    uint32_t value;
    unsigned writes;
};

static struct {
    char said[SAID_SIZE];
    unsigned said_length;
    struct plain plain[PLAIN_MAX];
    unsigned plains;
    struct timer tim2;
    struct timer tim5;
    uint32_t tenths; /* of TIM5's next microsecond */
    uint8_t held;
    bool in_handler;
    void (*sleep_hook)(void);
    unsigned resets;
    bool on[LINES_MAX];
    uint8_t priority[LINES_MAX];
} self;

void chip_forbids(const char *rule, uint32_t address)
{
    static char text[160];
    (void)snprintf(text, sizeof text, "0x%08lx: %s", (unsigned long)address, rule);
    TEST_FAIL_MESSAGE(text);
}

static struct plain *plain(uint32_t address)
{
    for (unsigned i = 0; i < self.plains; ++i) {
        if (self.plain[i].address == address) {
            return &self.plain[i];
        }
    }
    TEST_ASSERT_TRUE(self.plains < PLAIN_MAX && address % 4u == 0u);
    self.plain[self.plains] = (struct plain){.address = address, .value = 0, .writes = 0};
    return &self.plain[self.plains++];
}

void chip_power_on(void)
{
    memset(&self, 0, sizeof self);
    fdcan_model_reset();
    flash_model_power_on();
}

uint32_t chip_peek(uint32_t address)
{
    return plain(address)->value;
}

void chip_poke(uint32_t address, uint32_t value)
{
    plain(address)->value = value;
}

unsigned chip_writes(uint32_t address)
{
    return plain(address)->writes;
}

static struct timer *timer_of(uint32_t address)
{
    if (address >= TIM2 && address < TIM2 + 0x400u) {
        return &self.tim2;
    }
    return address >= TIM5 && address < TIM5 + 0x400u ? &self.tim5 : NULL;
}

static uint32_t read_timer(const struct timer *timer, uint32_t offset)
{
    switch (offset) {
    case CNT:
        return timer->count;
    case SR:
        return timer->matched ? 2u : 0u;
    case DIER:
        return timer->interrupt_on ? 2u : 0u;
    case CCR1:
        return timer->compare;
    default:
        chip_forbids("this model of a timer does not know the register", offset);
        return 0;
    }
}

static void write_timer(struct timer *timer, uint32_t offset, uint32_t value)
{
    switch (offset) {
    case CR1:
        timer->runs = (value & 1u) != 0u;
        break;
    case DIER:
        timer->interrupt_on = value == 2u;
        break;
    case SR: /* a 0 clears */
        timer->matched = timer->matched && (value & 2u) != 0u;
        break;
    case EGR:
        if ((value & 1u) != 0u) {
            timer->prescaler = timer->prescaler_next;
            timer->count = 0;
        }
        timer->matched = timer->matched || (value & 2u) != 0u;
        break;
    case PSC:
        timer->prescaler_next = value;
        break;
    case CCR1:
        timer->compare = value;
        break;
    default:
        chip_forbids("this model of a timer does not know the register", offset);
        break;
    }
}

uint32_t reg_read(uint32_t address)
{
    const struct timer *timer = timer_of(address);
    if (fdcan_model_covers(address)) {
        return fdcan_model_read(address);
    }
    if (flash_model_covers(address)) {
        return flash_model_read(address);
    }
    return timer != NULL ? read_timer(timer, address % 0x400u) : plain(address)->value;
}

static void hear(uint32_t address, char character)
{
    if (address == LPUART1_TDR && self.said_length < SAID_SIZE - 1u) {
        self.said[self.said_length++] = character;
    }
}

const char *chip_said(void)
{
    self.said[self.said_length] = '\0';
    self.said_length = 0;
    return self.said;
}

void reg_write(uint32_t address, uint32_t value)
{
    struct timer *timer = timer_of(address);
    if (fdcan_model_covers(address)) {
        fdcan_model_write(address, value);
    } else if (flash_model_covers(address)) {
        flash_model_write(address, value);
    } else if (timer != NULL) {
        write_timer(timer, address % 0x400u, value);
    } else {
        plain(address)->value = value;
        plain(address)->writes++;
        hear(address, (char)value);
    }
}

const uint8_t *reg_memory(uint32_t address)
{
    return flash_model_memory(address);
}

/* The timers' clock is 170 MHz. */
void chip_advance_100ns(uint32_t counts)
{
    TEST_ASSERT_TRUE_MESSAGE(self.tim2.runs && self.tim5.runs, "the clocks stand still");
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(16, self.tim2.prescaler, "TIM2 does not count 100 ns");
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(169, self.tim5.prescaler, "TIM5 does not count 1 us");
    const uint32_t ahead = self.tim2.compare - self.tim2.count;
    self.tim2.matched = self.tim2.matched || (ahead != 0u && ahead <= counts);
    self.tim2.count += counts;
    self.tenths += counts;
    self.tim5.count += self.tenths / 10u;
    self.tenths %= 10u;
}

bool chip_tick_pending(void)
{
    return self.tim2.matched && self.tim2.interrupt_on;
}

uint8_t chip_held(void)
{
    return self.held;
}

void chip_in_handler(bool in_handler)
{
    self.in_handler = in_handler;
}

bool chip_interrupt_is_on(uint32_t number, uint8_t *priority)
{
    *priority = self.priority[number];
    return self.on[number];
}

void chip_on_sleep(void (*hook)(void))
{
    self.sleep_hook = hook;
}

unsigned chip_resets(void)
{
    return self.resets;
}

void cpu_sleep(void)
{
    TEST_ASSERT_EQUAL_UINT8_MESSAGE(0, self.held, "sleeps with interrupts held off");
    TEST_ASSERT_NOT_NULL_MESSAGE(self.sleep_hook, "sleeps for ever");
    self.sleep_hook();
}

void cpu_reset(void)
{
    self.resets++;
}

uint8_t cpu_hold(uint8_t priority)
{
    const uint8_t before = self.held;
    self.held = priority;
    return before;
}

bool cpu_in_handler(void)
{
    return self.in_handler;
}

void cpu_interrupt_on(uint32_t number, uint8_t priority)
{
    self.on[number] = true;
    self.priority[number] = priority;
}

void cpu_interrupt_off(uint32_t number)
{
    self.on[number] = false;
}
