/* SPDX-License-Identifier: MIT */
/* reg_io: registers of pins, timers and the console's UART (RM0440 chapters 9, 29 and 38; alternate functions: data
 * sheet DS12288). Used by port/stm32g4 only. Constants for reg.h. */
#ifndef PORT_STM32G4_REG_IO_H
#define PORT_STM32G4_REG_IO_H

#include "port/stm32g4/reg.h"

#define GPIOA_BASE 0x48000000u

#define GPIO_MODER   0x00u /* two bits a pin */
#define GPIO_OSPEEDR 0x08u /* two bits a pin */
#define GPIO_PUPDR   0x0Cu /* two bits a pin */
#define GPIO_AFRL    0x20u /* four bits a pin; pins 8 to 15 in the next register */
#define GPIO_AFRH    0x24u

#define GPIO_MODER_ALTERNATE 2u
#define GPIO_OSPEEDR_HIGH    2u
#define GPIO_PUPDR_UP        1u

/* Pins and their alternate functions: PIN_port and number_peripheral_signal. */
#define PIN_PA2_LPUART1_TX 12u
#define PIN_PA3_LPUART1_RX 12u
#define PIN_PA11_FDCAN1_RX 9u
#define PIN_PA12_FDCAN1_TX 9u

/* TIM2 and TIM5 count with 32 bits. */
#define TIM2_BASE 0x40000000u
#define TIM5_BASE 0x40000C00u

#define TIM_CR1        0x00u
#define TIM_CR1_CEN    BIT(0)
#define TIM_DIER       0x0Cu
#define TIM_DIER_CC1IE BIT(1)
#define TIM_SR         0x10u /* a 0 clears */
#define TIM_SR_CC1IF   BIT(1)
#define TIM_EGR        0x14u
#define TIM_EGR_UG     BIT(0)
#define TIM_EGR_CC1G   BIT(1)
#define TIM_CNT        0x24u
#define TIM_PSC        0x28u
#define TIM_CCR1       0x34u

#define IRQ_TIM2 28u

#define LPUART1_BASE 0x40008000u

#define LPUART_CR1     0x00u
#define LPUART_CR1_UE  BIT(0)
#define LPUART_CR1_TE  BIT(3)
#define LPUART_BRR     0x0Cu
#define LPUART_ISR     0x1Cu
#define LPUART_ISR_TC  BIT(6)
#define LPUART_ISR_TXE BIT(7)
#define LPUART_TDR     0x28u

#endif
