/* SPDX-License-Identifier: MIT */
/* reg_clock: registers of clocks, resets, supply and watchdog (RM0440 chapters 6, 7 and 42). Used by port/stm32g4 only.
 * Constants for reg.h. */
#ifndef PORT_STM32G4_REG_CLOCK_H
#define PORT_STM32G4_REG_CLOCK_H

#include "port/stm32g4/reg.h"

#define RCC_BASE 0x40021000u

#define RCC_CR                 0x00u      /* clock control */
#define RCC_CR_HSION           BIT(8)     /* internal oscillator, 16 MHz: on */
#define RCC_CR_HSEON           BIT(16)    /* crystal oscillator: on */
#define RCC_CR_HSERDY          BIT(17)    /* crystal oscillator: stable (read only) */
#define RCC_CR_PLLON           BIT(24)    /* PLL: on */
#define RCC_CR_PLLRDY          BIT(25)    /* PLL: locked (read only) */
#define RCC_CFGR               0x08u      /* clock configuration */
#define RCC_CFGR_SW            BITS(0, 2) /* source of the system clock: requested, */
#define RCC_CFGR_SWS           BITS(2, 2) /* and in use (read only) */
#define RCC_CFGR_HPRE          BITS(4, 4) /* divisor of the bus clock HCLK */
#define RCC_PLLCFGR            0x0Cu /* PLL: input / M * N / R; to be written while it is off */
#define RCC_PLLCFGR_PLLSRC     BITS(0, 2)  /* input of the PLL */
#define RCC_PLLCFGR_PLLM       BITS(4, 4)  /* divisor of the input; one less than it */
#define RCC_PLLCFGR_PLLN       BITS(8, 7)  /* multiplier */
#define RCC_PLLCFGR_PLLREN     BIT(24)     /* output R, for the system clock: on */
#define RCC_PLLCFGR_PLLR       BITS(25, 2) /* divisor of output R; 0: 2 */
#define RCC_APB1RSTR1          0x38u       /* resets of peripherals; 1: held in reset */
#define RCC_APB1RSTR1_FDCANRST BIT(25)
#define RCC_AHB2ENR            0x4Cu /* clocks of peripherals, as the next two; 1: on */
#define RCC_AHB2ENR_GPIOAEN    BIT(0)
#define RCC_APB1ENR1           0x58u
#define RCC_APB1ENR1_TIM2EN    BIT(0)
#define RCC_APB1ENR1_TIM5EN    BIT(3)
#define RCC_APB1ENR1_FDCANEN   BIT(25)
#define RCC_APB1ENR1_PWREN     BIT(28)
#define RCC_APB1ENR2           0x5Cu
#define RCC_APB1ENR2_LPUART1EN BIT(0)
#define RCC_CCIPR              0x88u /* sources of the clocks of peripherals */
#define RCC_CCIPR_LPUART1SEL   BITS(10, 2)
#define RCC_CCIPR_FDCANSEL     BITS(24, 2)
#define RCC_CSR                0x94u   /* control and status: which reset came last */
#define RCC_CSR_RMVF           BIT(23) /* 1 clears all reset flags */
#define RCC_CSR_IWDGRSTF       BIT(29) /* the watchdog has reset the chip */

/* Values by the names of the reference manual: REGISTER_FIELD_MEANING. */
#define RCC_CFGR_SW_PLL          3u
#define RCC_CFGR_HPRE_DIV1       0u
#define RCC_CFGR_HPRE_DIV2       8u
#define RCC_PLLCFGR_PLLSRC_HSE   3u
#define RCC_PLLCFGR_PLLM_DIV6    5u
#define RCC_PLLCFGR_PLLN_MUL85   85u
#define RCC_PLLCFGR_PLLR_DIV2    0u
#define RCC_CCIPR_LPUART1SEL_HSI 2u
#define RCC_CCIPR_FDCANSEL_HSE   0u

#define PWR_BASE 0x40007000u

#define PWR_CR5        0x80u  /* power control 5 */
#define PWR_CR5_R1MODE BIT(0) /* regulator; 0: boost mode, for more than 150 MHz */

#define IWDG_BASE 0x40003000u

#define IWDG_KR     0x00u       /* key (write only) */
#define IWDG_PR     0x04u       /* prescaler */
#define IWDG_PR_PR  BITS(0, 3)  /* divisor of the oscillator: 4 << value, at most 256 */
#define IWDG_RLR    0x08u       /* reload */
#define IWDG_RLR_RL BITS(0, 12) /* what the counter begins with after each feed */
#define IWDG_SR     0x0Cu       /* status */
#define IWDG_SR_PVU BIT(0)      /* a new prescaler, or */
#define IWDG_SR_RVU BIT(1)      /* a new reload value is not in force yet */

/* What IWDG_KR takes. */
#define IWDG_KEY_FEED   0xAAAAu /* the counter begins anew */
#define IWDG_KEY_UNLOCK 0x5555u /* IWDG_PR and IWDG_RLR can be written */
#define IWDG_KEY_START  0xCCCCu /* the watchdog runs until the next reset */

#endif
