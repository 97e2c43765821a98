/* SPDX-License-Identifier: MIT */
/* Implements port/stm32g4/watchdog.h (see there): the independent watchdog. Used by port_stm32g4.c. Main loop. Writes
 * registers of IWDG and the reset flags in RCC_CSR only. */
#include "port/stm32g4/watchdog.h"

#include "port/stm32g4/reg_clock.h"

/* LSI 32 kHz / 64 = 500 Hz */
#define DIVIDE_BY_64 4u
#define RELOAD       2000u /* counts until the reset: 4 s */

/* The registers take some cycles of the slow clock. */
#define POLLS 1000000u

static uint32_t fed_ticks;

void watchdog_start(void)
{
    reg_write(IWDG_BASE + IWDG_KR, IWDG_KEY_START);
    reg_write(IWDG_BASE + IWDG_KR, IWDG_KEY_UNLOCK);
    reg_write(IWDG_BASE + IWDG_PR, reg_field(IWDG_PR_PR, DIVIDE_BY_64));
    reg_write(IWDG_BASE + IWDG_RLR, reg_field(IWDG_RLR_RL, RELOAD - 1u));
    for (uint32_t i = 0; i < POLLS; ++i) {
        if ((reg_read(IWDG_BASE + IWDG_SR) & (IWDG_SR_PVU | IWDG_SR_RVU)) == 0u) {
            break;
        }
    }
    reg_write(IWDG_BASE + IWDG_KR, IWDG_KEY_FEED);
}

void watchdog_feed(uint32_t ticks)
{
    if (ticks != fed_ticks) {
        fed_ticks = ticks;
        reg_write(IWDG_BASE + IWDG_KR, IWDG_KEY_FEED);
    }
}

bool watchdog_has_reset(void)
{
    const bool restarted = (reg_read(RCC_BASE + RCC_CSR) & RCC_CSR_IWDGRSTF) != 0u;
    reg_set(RCC_BASE + RCC_CSR, RCC_CSR_RMVF);
    return restarted;
}
