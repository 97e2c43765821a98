/* SPDX-License-Identifier: MIT */
/* core: what every Cortex-M has at the same addresses: SysTick, interrupt controller, the mask of all interrupts. Used
 * by port/cortex_m, port/mps2 and port/stm32g4. Any context. Names of registers, and functions that read and write
 * them. */
#ifndef PORT_CORTEX_M_CORE_H
#define PORT_CORTEX_M_CORE_H

#include <stdint.h>

/* Registers, by their names in the ARMv7-M Architecture Reference Manual (B3.2 to B3.4). The last three are arrays: one
 * bit for each interrupt of the board, of CORE_IPR a byte. */
#define CORE_SYST_CSR (*(volatile uint32_t *)0xE000E010u) /* SysTick: control and status */
#define CORE_SYST_RVR (*(volatile uint32_t *)0xE000E014u) /* reload: what it begins with after 0 */
#define CORE_SYST_CVR (*(volatile uint32_t *)0xE000E018u) /* current value; a write sets it to 0 */
#define CORE_ICSR     (*(volatile uint32_t *)0xE000ED04u) /* interrupt control and state */
#define CORE_SHPR3    (*(volatile uint32_t *)0xE000ED20u) /* priorities of PendSV and SysTick */
#define CORE_ISER     ((volatile uint32_t *)0xE000E100u)  /* a 1 enables */
#define CORE_ISPR     ((volatile uint32_t *)0xE000E200u)  /* a 1 makes pending */
#define CORE_IPR      ((volatile uint32_t *)0xE000E400u)  /* priority */

#define CORE_SYST_CSR_RUN    7u            /* the core's clock, interrupt, enable */
#define CORE_ICSR_PENDSTSET  (1u << 26)    /* SysTick is pending */
#define CORE_SHPR3_SYST(pri) ((pri) << 24) /* field of SysTick's priority */

/* Holds off all interrupts. Returns the previous state for core_unmask(), so these two nest. */
static inline uint32_t core_mask(void)
{
    uint32_t before = 0;
    __asm__ volatile("mrs %0, primask\n\tcpsid i" : "=r"(before)::"memory");
    return before;
}

/* Back to the state that core_mask returned. */
static inline void core_unmask(uint32_t before)
{
    __asm__ volatile("msr primask, %0\n\tisb" ::"r"(before) : "memory");
}

/* Sleeps until an interrupt is pending, masked or not. */
static inline void core_sleep(void)
{
    __asm__ volatile("dsb\n\twfi" ::: "memory");
}

/* Enables a board's interrupt (0 ... 239) with a priority, 0 the highest; in the upper bits, as many as the core
 * has. */
static inline void core_enable(uint32_t number, uint8_t priority)
{
    const uint32_t shift = 8u * (number % 4u);
    CORE_IPR[number / 4u] =
        (CORE_IPR[number / 4u] & ~(0xFFu << shift)) | ((uint32_t)priority << shift);
    CORE_ISER[number / 32u] = 1u << (number % 32u);
}

/* Makes an interrupt pending, as if the board had requested it. */
static inline void core_pend(uint32_t number)
{
    CORE_ISPR[number / 32u] = 1u << (number % 32u);
}

#endif
