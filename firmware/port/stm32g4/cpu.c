/* SPDX-License-Identifier: MIT */
/* Implements port/stm32g4/cpu.h (see there): interrupts, sleep and reset of the core, by BASEPRI, NVIC and AIRCR
 * (ARMv7-M Architecture Reference Manual B1, B3). Used by port/stm32g4 only. Any context, but cpu_sleep: main loop.
 * Writes these registers only. */
#include "port/stm32g4/cpu.h"

#include "port/cortex_m/core.h"
#include "port/stm32g4/reg.h"

#define NVIC_ICER 0xE000E180u
#define SCB_AIRCR 0xE000ED0Cu

#define AIRCR_SYSRESETREQ 0x05FA0004u
#define PRIORITY_SHIFT    4u /* the chip has the upper four of eight bits */

void cpu_interrupt_on(uint32_t number, uint8_t priority)
{
    core_enable(number, (uint8_t)(priority << PRIORITY_SHIFT));
}

void cpu_interrupt_off(uint32_t number)
{
    reg_write(NVIC_ICER + 4u * (number / 32u), 1u << (number % 32u));
    __asm__ volatile("dsb\n\tisb" ::: "memory");
}

uint8_t cpu_hold(uint8_t priority)
{
    uint32_t before = 0;
    const uint32_t now = (uint32_t)priority << PRIORITY_SHIFT;
    __asm__ volatile("mrs %0, basepri\n\tmsr basepri, %1\n\tisb"
                     : "=&r"(before)
                     : "r"(now)
                     : "memory");
    return (uint8_t)(before >> PRIORITY_SHIFT);
}

bool cpu_in_handler(void)
{
    uint32_t number = 0;
    __asm__ volatile("mrs %0, ipsr" : "=r"(number));
    return number != 0u;
}

/* The return from an interrupt sets the event that wfe waits for: none is missed between a test and the sleep. */
void cpu_sleep(void)
{
    __asm__ volatile("dsb\n\twfe" ::: "memory");
}

void cpu_reset(void)
{
    __asm__ volatile("dsb" ::: "memory");
    reg_write(SCB_AIRCR, AIRCR_SYSRESETREQ);
    for (;;) {
    }
}
