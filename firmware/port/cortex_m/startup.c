/* SPDX-License-Identifier: MIT */
/* Implements port/cortex_m/startup.h (see there): what every Cortex-M does between reset and main(). Called by the
 * hardware, at reset and in interrupts; a board defines those that it needs. Writes the variables in RAM and the
 * control registers of the core before main(). */
#include "port/cortex_m/startup.h"

#include <stddef.h>
#include <stdint.h>
#include <string.h>

/* From the linker script. */
extern uint32_t startup_stack_bottom[], startup_stack_top[];
extern uint32_t startup_data_load[], startup_data_begin[], startup_data_end[];
extern uint32_t startup_bss_begin[], startup_bss_end[];

#define VTOR           (*(volatile uint32_t *)0xE000ED08u)
#define CPACR          (*(volatile uint32_t *)0xE000ED88u)
#define CPACR_FPU_FULL (0xFu << 20)

int main(int argc, char **argv);

__attribute__((section(".vectors"), used)) static const startup_vector startup_vectors[16] = {
    (startup_vector)(uintptr_t)startup_stack_top,
    startup_reset,
    startup_nmi,
    startup_hard_fault,
    startup_hard_fault, /* memory management */
    startup_hard_fault, /* bus */
    startup_hard_fault, /* usage */
    startup_hard_fault, /* secure, ARMv8-M */
    NULL,
    NULL,
    NULL,
    startup_halt, /* SVCall */
    startup_halt, /* debug monitor */
    NULL,
    startup_halt, /* PendSV */
    startup_systick,
};

static size_t bytes(const uint32_t *begin, const uint32_t *end)
{
    return (size_t)((uintptr_t)end - (uintptr_t)begin);
}

/* ARMv6-M has neither; a Cortex-M33 is the only one with a limit of the stack. */
static void prepare_core(void)
{
#if __ARM_ARCH > 6
    VTOR = (uint32_t)(uintptr_t)startup_vectors;
#endif
#if __ARM_ARCH >= 8
    __asm__ volatile("msr msplim, %0" ::"r"(startup_stack_bottom));
#endif
#if defined(__ARM_FP)
    CPACR |= CPACR_FPU_FULL;
#endif
    __asm__ volatile("dsb\n\tisb" ::: "memory");
}

void startup_reset(void)
{
    prepare_core();
    memcpy(startup_data_begin, startup_data_load, bytes(startup_data_begin, startup_data_end));
    memset(startup_bss_begin, 0, bytes(startup_bss_begin, startup_bss_end));
    startup_exit(main(0, NULL));
    startup_halt();
}

void startup_halt(void)
{
    for (;;) {
    }
}

void startup_nmi(void) __attribute__((weak, alias("startup_halt")));
void startup_hard_fault(void) __attribute__((weak, alias("startup_halt")));
void startup_systick(void) __attribute__((weak, alias("startup_halt")));
