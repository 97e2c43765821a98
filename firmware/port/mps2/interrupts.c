/* SPDX-License-Identifier: MIT */
/* Implements port/mps2/interrupts.h (see there): the tick, and the receive handler. Used by port_mps2.c, uart.c,
 * link_fifo.c and link_slcan.c. Main loop and interrupts, as each function states. Writes the registers of SysTick,
 * masks interrupts, and calls the handlers of the application. */
#include "port/mps2/interrupts.h"

#include <string.h>

#include "port/cortex_m/core.h"
#include "port/cortex_m/startup.h"
#include "port/cortex_m/systick.h"
#include "port/mps2/board.h"

static struct {
    const struct link *link;
    struct port_handlers handlers;
    struct link_request request;
    uint32_t late_ns;        /* of the next tick */
    volatile uint32_t ticks; /* number of ticks; wraps */
    volatile bool woken;
    bool in_tick; /* nothing else runs meanwhile */
} self;

void interrupts_begin(const struct link *link)
{
    memset(&self, 0, sizeof self);
    self.link = link;
}

void interrupts_end(void)
{
    systick_end();
}

bool interrupts_in_tick(void)
{
    return self.in_tick;
}

int port_start(const struct port_handlers *handlers, uint32_t period_us)
{
    const uint32_t before = core_mask();
    self.handlers = *handlers;
    systick_begin(period_us, BOARD_CLOCK_MHZ, 0);
    core_unmask(before);
    return 0;
}

void port_tick_period(uint32_t period_us)
{
    systick_period(period_us);
}

void port_tick_await(uint32_t guard_us, bool hurry)
{
    self.request = (struct link_request){.guard_us = guard_us, .awaiting = true, .hurry = hurry};
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
    self.request.awaiting = false;
}

void interrupts_receive(const struct can_msg *message)
{
    const uint32_t before = core_mask();
    if (self.handlers.receive != NULL) {
        self.handlers.receive(self.handlers.self, message, systick_us());
    }
    core_unmask(before);
}

/* A function of its own, so that its instructions can be counted without the link. */
__attribute__((noinline)) static void run_tick(void)
{
    self.handlers.tick(self.handlers.self, systick_us(), self.late_ns + systick_late_ns());
}

void startup_systick(void)
{
    systick_tick();
    self.ticks++;
    self.request = (struct link_request){.awaiting = false};
    self.in_tick = true;
    run_tick();
    self.in_tick = false;
    self.late_ns = self.link->after_tick(&self.request);
}

/* Not nested, as port.h requires. */
void port_lock(void)
{
    (void)core_mask();
}

void port_unlock(void)
{
    core_unmask(0);
}

/* An interrupt between the test and the sleep is pending then, and ends the sleep. */
static void sleep_once(void)
{
    const uint32_t before = core_mask();
    if (!self.woken) {
        core_sleep();
    }
    core_unmask(before);
}

static void spin_once(void)
{
    const uint32_t ticks = self.ticks;
    while (!self.woken && self.ticks == ticks) {
    }
}

void port_wait(uint32_t timeout_us)
{
    const uint32_t began_us = systick_us();
    while (!self.woken && systick_us() - began_us < timeout_us) {
        if (self.link->sleeps) {
            sleep_once();
        } else {
            spin_once();
        }
    }
    self.woken = false;
}

void port_progress(void)
{
}

void port_wake(void)
{
    self.woken = true;
}
