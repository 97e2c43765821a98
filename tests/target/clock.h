/* SPDX-License-Identifier: MIT */
/*
 * The core's own clock, to time a few instructions: SysTick, which counts cycles of the processor's clock, or on RISC-V
 * the counter of instructions retired (which QEMU answers in nanoseconds of its virtual time). Wraps at 24 bits. The
 * host has none: always 0. Used by the images isr and setpoints. clock_begin writes the
 * registers of SysTick; clock_now only reads.
 */
#ifndef TARGET_CLOCK_H
#define TARGET_CLOCK_H

#include <stdint.h>

#define CLOCK_MASK 0xFFFFFFu

#if defined(__riscv)

static inline void clock_begin(void)
{
}

static inline uint32_t clock_now(void)
{
    uint32_t now;
    __asm__ volatile("csrr %0, minstret" : "=r"(now)::"memory");
    return now;
}

#elif defined(__arm__)

#define CLOCK_SYST_CSR                                                                             \
    (*(volatile uint32_t *)0xE000E010u) /* bit 2: the processor's clock, bit 0: on */
#define CLOCK_SYST_RVR (*(volatile uint32_t *)0xE000E014u)
#define CLOCK_SYST_CVR (*(volatile uint32_t *)0xE000E018u)

static inline void clock_begin(void)
{
    CLOCK_SYST_RVR = CLOCK_MASK;
    CLOCK_SYST_CVR = 0;
    CLOCK_SYST_CSR = 5u;
}

/* It counts down. */
static inline uint32_t clock_now(void)
{
    return ~CLOCK_SYST_CVR;
}

#else

static inline void clock_begin(void)
{
}

static inline uint32_t clock_now(void)
{
    return 0;
}

#endif

#endif
