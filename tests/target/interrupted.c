/* SPDX-License-Identifier: MIT */
/*
 * An image to test the counter of instructions with: the same work a hundred times, with SysTick interrupts at any
 * place in it, which must not be counted. The first word is the file that gets the number of interrupts, a u32. Run on
 * an emulated board by tests/system/test_target_counts.py. Writes that file by semihosting.
 */
#include <stdint.h>

#include "port/cortex_m/startup.h"
#include "port/semihost/semihost.h"

enum { ROUNDS = 100, STEPS = 200, STATUS_USAGE = 2, STATUS_FILE = 5 };

#define SYST_CSR (*(volatile uint32_t *)0xE000E010u)
#define SYST_RVR (*(volatile uint32_t *)0xE000E014u)

static volatile uint32_t interrupts;

void startup_systick(void)
{
    interrupts++;
}

__attribute__((noinline)) static uint32_t tick(uint32_t value)
{
    for (uint32_t i = 0; i < STEPS; i++) {
        value = value * 1664525u + 1013904223u;
        __asm__ volatile("" : "+r"(value));
    }
    return value;
}

int main(void)
{
    static char name[384];
    uint32_t value = 1;
    if (semihost_command_line(name, sizeof name) != 0) {
        return STATUS_USAGE;
    }
    const int file = semihost_open(name, SEMIHOST_WRITE);
    SYST_RVR = 1900; /* cycles, about 600 instructions: not a multiple of a round */
    SYST_CSR = 7;
    for (uint32_t k = 0; k < ROUNDS; k++) {
        value = tick(value);
    }
    SYST_CSR = 0;
    const uint32_t seen = interrupts;
    return file >= 0 && semihost_write(file, &seen, sizeof seen) == 0 && semihost_close(file) == 0
               ? 0
               : STATUS_FILE;
}
