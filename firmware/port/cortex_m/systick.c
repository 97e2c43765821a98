/* SPDX-License-Identifier: MIT */
/* Implements port/cortex_m/systick.h (see there): SysTick as timer of the tick and as clock of a port. Used by
 * port/mps2. Main loop and interrupts, as each function of the header states. Writes the registers of SysTick and its
 * priority (SHPR3), reads ICSR, and masks interrupts while it reads the time. */
#include "port/cortex_m/systick.h"

#include "port/cortex_m/core.h"

static struct {
    uint32_t core_mhz;
    uint32_t base_ns; /* when the present period began */
    uint32_t base_us;
    uint32_t running_us; /* the period that SysTick counts */
    uint32_t loaded_us;  /* and what it begins with next */
    uint32_t wanted_us;
} self;

static void load(uint32_t period_us)
{
    self.loaded_us = period_us;
    CORE_SYST_RVR = period_us * self.core_mhz - 1u;
}

void systick_begin(uint32_t period_us, uint32_t core_mhz, uint8_t priority)
{
    CORE_SHPR3 = (CORE_SHPR3 & ~CORE_SHPR3_SYST(0xFFu)) | CORE_SHPR3_SYST((uint32_t)priority);
    self.core_mhz = core_mhz;
    self.running_us = period_us;
    self.wanted_us = period_us;
    load(period_us);
    CORE_SYST_CVR = 0;
    CORE_SYST_CSR = CORE_SYST_CSR_RUN;
}

void systick_end(void)
{
    CORE_SYST_CSR = 0;
}

void systick_period(uint32_t period_us)
{
    self.wanted_us = period_us;
}

uint32_t systick_period_us(void)
{
    return self.running_us;
}

void systick_tick(void)
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
    return current == 0u ? 0u : period_us * self.core_mhz - current;
}

/* In two parts: counts times 1000 would not fit at a high clock. */
static uint32_t ns_of(uint32_t count)
{
    return count / self.core_mhz * 1000u + count % self.core_mhz * 1000u / self.core_mhz;
}

/* Under the mask, where a period may be over whose interrupt is pending. */
static uint32_t elapsed_ns(void)
{
    if (self.core_mhz == 0u) {
        return 0; /* not begun */
    }
    uint32_t passed = counts(self.running_us);
    uint32_t whole_us = 0;
    if ((CORE_ICSR & CORE_ICSR_PENDSTSET) != 0u) {
        passed = counts(self.loaded_us);
        whole_us = self.running_us;
    }
    return whole_us * 1000u + ns_of(passed);
}

uint32_t systick_late_ns(void)
{
    return elapsed_ns();
}

uint32_t systick_ns(void)
{
    const uint32_t before = core_mask();
    const uint32_t now_ns = self.base_ns + elapsed_ns();
    core_unmask(before);
    return now_ns;
}

uint32_t systick_us(void)
{
    const uint32_t before = core_mask();
    const uint32_t now_us = self.base_us + elapsed_ns() / 1000u;
    core_unmask(before);
    return now_us;
}
