/* SPDX-License-Identifier: MIT */
#include "port/mps2/clock.h"

#include <stdbool.h>

#include "port/cortex_m/core.h"
#include "port/mps2/board.h"

static struct {
    uint32_t base_ns; /* when the present period began */
    uint32_t base_us;
    uint32_t running_us; /* the period that SysTick counts */
    uint32_t loaded_us;  /* and what it begins with next */
    uint32_t wanted_us;
} self;

static void load(uint32_t period_us)
{
    self.loaded_us = period_us;
    CORE_SYST_RVR = period_us * BOARD_CLOCK_MHZ - 1u;
}

void clock_begin(uint32_t period_us)
{
    self.running_us = period_us;
    self.wanted_us = period_us;
    load(period_us);
    CORE_SYST_CVR = 0;
    CORE_SYST_CSR = CORE_SYST_CSR_RUN;
}

void clock_end(void)
{
    CORE_SYST_CSR = 0;
}

void clock_period(uint32_t period_us)
{
    self.wanted_us = period_us;
}

uint32_t clock_period_us(void)
{
    return self.running_us;
}

void clock_tick(void)
{
    self.base_us += self.running_us;
    self.base_ns += self.running_us * 1000u;
    self.running_us = self.loaded_us;
    load(self.wanted_us);
}

/* Counts since 0 was reached; 0 itself is the first instant of a period. */
static uint32_t counts(uint32_t period_us)
{
    const uint32_t current = CORE_SYST_CVR;
    return current == 0u ? 0u : period_us * BOARD_CLOCK_MHZ - current;
}

/* Under the mask, where a period may be over whose interrupt is pending. */
static uint32_t elapsed_ns(void)
{
    uint32_t passed = counts(self.running_us);
    uint32_t whole_us = 0;
    if ((CORE_ICSR & CORE_ICSR_PENDSTSET) != 0u) {
        passed = counts(self.loaded_us);
        whole_us = self.running_us;
    }
    return whole_us * 1000u + passed * (1000u / BOARD_CLOCK_MHZ);
}

uint32_t clock_late_ns(void)
{
    return elapsed_ns();
}

uint32_t clock_ns(void)
{
    const uint32_t before = core_mask();
    const uint32_t now_ns = self.base_ns + elapsed_ns();
    core_unmask(before);
    return now_ns;
}

uint32_t clock_us(void)
{
    const uint32_t before = core_mask();
    const uint32_t now_us = self.base_us + elapsed_ns() / 1000u;
    core_unmask(before);
    return now_us;
}
