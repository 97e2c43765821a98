/* SPDX-License-Identifier: MIT */
/* Implements port/port.h for NUCLEO-G474RE by the modules of this folder; the store is in port_store.c. Used by
 * firmware/app and the ports. Contexts: port/port.h. Writes registers of RCC; sends, receives and writes the console by
 * the modules of this folder. */
#include "port/port.h"

#include "port/stm32g4/clock.h"
#include "port/stm32g4/console.h"
#include "port/stm32g4/cpu.h"
#include "port/stm32g4/faults.h"
#include "port/stm32g4/fdcan.h"
#include "port/stm32g4/flash.h"
#include "port/stm32g4/irq.h"
#include "port/stm32g4/pins.h"
#include "port/stm32g4/reg_clock.h"
#include "port/stm32g4/reg_io.h"
#include "port/stm32g4/tick_timer.h"
#include "port/stm32g4/watchdog.h"

/* make NODE=... CAN_BITS_S=... */
#if !defined(BOARD_NODE)
#define BOARD_NODE 1
#endif
#if !defined(BOARD_CAN_BITS_S)
#define BOARD_CAN_BITS_S 1000000
#endif
typedef char node_is_a_can_open_one[BOARD_NODE >= 1 && BOARD_NODE <= 127 ? 1 : -1];

#define REPORT_US 1000000u

static struct {
    struct fdcan can;
    volatile bool started;
    volatile bool awake;
    uint32_t reported_us;
} self;

static int fail(const char *text)
{
    port_log(PORT_WARNING, text, 0);
    return PORT_ERR_SYSTEM;
}

static void begin_can_hardware(void)
{
    reg_put(RCC_BASE + RCC_CCIPR, RCC_CCIPR_FDCANSEL, RCC_CCIPR_FDCANSEL_HSE);
    reg_set(RCC_BASE + RCC_APB1ENR1, RCC_APB1ENR1_FDCANEN);
    reg_set(RCC_BASE + RCC_APB1RSTR1, RCC_APB1RSTR1_FDCANRST);
    reg_clear(RCC_BASE + RCC_APB1RSTR1, RCC_APB1RSTR1_FDCANRST);
    pins_alternate(11, PIN_PA11_FDCAN1_RX);
    pins_alternate(12, PIN_PA12_FDCAN1_TX);
}

int port_begin(int argc, char **argv)
{
    (void)argc;
    (void)argv;
    faults_begin();
    pins_begin();
    const bool clocked = clock_begin();
    console_begin();
    if (watchdog_has_reset()) {
        port_log(PORT_WARNING, "restarted by the watchdog", 0);
    }
    if (!clocked) {
        return fail("the 24 MHz crystal or the PLL does not start");
    }
    if (!flash_is_dual()) {
        return fail("the flash is not in dual-bank mode: set option bit DBANK");
    }
    reg_set(RCC_BASE + RCC_APB1ENR1, RCC_APB1ENR1_TIM2EN | RCC_APB1ENR1_TIM5EN);
    (void)reg_read(RCC_BASE + RCC_APB1ENR1);
    tick_timer_begin(CLOCK_MHZ);
    begin_can_hardware();
    return fdcan_begin(&self.can, BOARD_CAN_BITS_S) ? 0 : fail("FDCAN1 cannot be configured");
}

int port_end(void)
{
    irq_stop();
    fdcan_stop(&self.can);
    self.started = false;
    return 0;
}

bool port_stop_requested(void)
{
    return false;
}

bool port_stop_insisted(void)
{
    return false;
}

uint8_t port_node_id(void)
{
    return BOARD_NODE;
}

int port_can_accept(const struct can_match *filters, size_t count)
{
    return fdcan_accept(filters, count) ? 0 : PORT_ERR_SYSTEM;
}

int port_can_send(const struct can_msg *message)
{
    const enum fdcan_sender sender = cpu_in_handler() ? FDCAN_URGENT : FDCAN_ORDINARY;
    return fdcan_send(&self.can, message, sender) ? 0 : PORT_ERR_FULL;
}

bool port_can_delivered(void)
{
    return fdcan_delivered(&self.can);
}

uint32_t port_time_ns(void)
{
    return tick_timer_ns();
}

uint32_t port_time_us(void)
{
    return tick_timer_us();
}

int port_start(const struct port_handlers *handlers, uint32_t period_us)
{
    const uint32_t spoiled_words = faults_from_now_on();
    if (spoiled_words != 0u) {
        port_log(PORT_WARNING, "spoiled words in the program store", (int32_t)spoiled_words);
    }
    watchdog_start();
    self.started = true;
    irq_start(&self.can, handlers, period_us);
    return 0;
}

void port_tick_period(uint32_t period_us)
{
    irq_period(period_us);
}

void port_tick_await(uint32_t guard_us, bool hurry)
{
    (void)guard_us;
    (void)hurry;
}

void port_tick_urgent(bool urgent)
{
    (void)urgent;
}

enum port_timing port_timing(void)
{
    return PORT_TIMING_KEPT;
}

void port_tick_ready(void)
{
}

void port_lock(void)
{
    (void)cpu_hold(CPU_PRIORITY_TICK);
}

void port_unlock(void)
{
    (void)cpu_hold(0);
}

static void log_count(const char *text, uint32_t count)
{
    if (count != 0u) {
        port_log(PORT_WARNING, text, (int32_t)count);
    }
}

/* From 128 on it is error passive; 256 when sending is bus-off. */
static void log_errors(void)
{
    uint8_t transmit = 0;
    uint8_t receive = 0;
    fdcan_errors(&transmit, &receive);
    port_log(PORT_WARNING, "CAN error counter now, sending", transmit);
    port_log(PORT_WARNING, "CAN error counter now, receiving", receive);
}

/* Once a second at most: a line takes some milliseconds. */
static void log_events(uint32_t now_us)
{
    if (now_us - self.reported_us < REPORT_US) {
        return;
    }
    self.reported_us = now_us;
    const struct fdcan_events events = fdcan_take_events(&self.can);
    log_count("left the CAN bus after too many errors, times", events.bus_offs);
    log_count("error passive on the CAN bus began or ended, times", events.error_passives);
    if (events.error_passives != 0u) {
        log_errors();
    }
    log_count("frames came too fast, lost", events.lost);
}

void port_progress(void)
{
    watchdog_feed(irq_ticks());
}

void port_wait(uint32_t timeout_us)
{
    const uint32_t began_us = port_time_us();
    port_progress();
    log_events(began_us);
    while (!self.awake && port_time_us() - began_us < timeout_us) {
        if (self.started) {
            cpu_sleep();
        }
    }
    self.awake = false;
}

void port_wake(void)
{
    self.awake = true;
}

void port_log(enum port_level level, const char *text, int32_t value)
{
    if (level == PORT_WARNING) {
        console_number(text, value);
    }
}
