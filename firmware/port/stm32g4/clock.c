/* SPDX-License-Identifier: MIT */
/* Implements port/stm32g4/clock.h (see there): 170 MHz from the board's 24 MHz crystal. Used by port_stm32g4.c. Main
 * loop, once; changes registers of RCC, PWR and FLASH only. */
#include "port/stm32g4/clock.h"

#include <stdint.h>

#include "port/stm32g4/reg_clock.h"
#include "port/stm32g4/reg_flash.h"

/* A crystal takes milliseconds to start; at 16 MHz this many polls take some tenths of a second. */
#define POLLS 1000000u

#define WAIT_STATES 4u

/* RM0440 requires a microsecond at half the clock before the last step above 80 MHz. */
#define HALF_CLOCK_POLLS 100u

static bool wait_for(uint32_t address, uint32_t field, uint32_t value)
{
    for (uint32_t i = 0; i < POLLS; ++i) {
        if (reg_get(reg_read(address), field) == value) {
            return true;
        }
    }
    return false;
}

static bool start_crystal(void)
{
    reg_set(RCC_BASE + RCC_CR, RCC_CR_HSEON);
    return wait_for(RCC_BASE + RCC_CR, RCC_CR_HSERDY, 1u);
}

static bool start_pll(void)
{
    reg_write(RCC_BASE + RCC_PLLCFGR, reg_field(RCC_PLLCFGR_PLLSRC, RCC_PLLCFGR_PLLSRC_HSE) |
                                          reg_field(RCC_PLLCFGR_PLLM, RCC_PLLCFGR_PLLM_DIV6) |
                                          reg_field(RCC_PLLCFGR_PLLN, RCC_PLLCFGR_PLLN_MUL85) |
                                          reg_field(RCC_PLLCFGR_PLLR, RCC_PLLCFGR_PLLR_DIV2) |
                                          RCC_PLLCFGR_PLLREN);
    reg_set(RCC_BASE + RCC_CR, RCC_CR_PLLON);
    return wait_for(RCC_BASE + RCC_CR, RCC_CR_PLLRDY, 1u);
}

/* Voltage and wait states first: both are for the faster clock. */
static bool prepare_core(void)
{
    reg_set(RCC_BASE + RCC_APB1ENR1, RCC_APB1ENR1_PWREN);
    (void)reg_read(RCC_BASE + RCC_APB1ENR1);
    reg_clear(PWR_BASE + PWR_CR5, PWR_CR5_R1MODE);
    reg_put(FLASH_BASE + FLASH_ACR, FLASH_ACR_LATENCY, WAIT_STATES);
    reg_set(FLASH_BASE + FLASH_ACR, FLASH_ACR_PRFTEN | FLASH_ACR_ICEN | FLASH_ACR_DCEN);
    return wait_for(FLASH_BASE + FLASH_ACR, FLASH_ACR_LATENCY, WAIT_STATES);
}

static bool switch_over(void)
{
    reg_put(RCC_BASE + RCC_CFGR, RCC_CFGR_HPRE, RCC_CFGR_HPRE_DIV2);
    reg_put(RCC_BASE + RCC_CFGR, RCC_CFGR_SW, RCC_CFGR_SW_PLL);
    if (!wait_for(RCC_BASE + RCC_CFGR, RCC_CFGR_SWS, RCC_CFGR_SW_PLL)) {
        return false;
    }
    for (uint32_t i = 0; i < HALF_CLOCK_POLLS; ++i) {
        (void)reg_read(RCC_BASE + RCC_CFGR);
    }
    reg_put(RCC_BASE + RCC_CFGR, RCC_CFGR_HPRE, RCC_CFGR_HPRE_DIV1);
    return true;
}

bool clock_begin(void)
{
    return start_crystal() && start_pll() && prepare_core() && switch_over();
}
