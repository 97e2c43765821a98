/* SPDX-License-Identifier: MIT */
/* reg_io: registers of pins, timers and the console's UART (RM0440 chapters 9, 29 and 38; alternate functions: data
 * sheet DS12288). Used by port/stm32g4 only. Constants for reg.h. */
#ifndef PORT_STM32G4_REG_IO_H
#define PORT_STM32G4_REG_IO_H

#include "port/stm32g4/reg.h"

#define GPIOA_BASE 0x48000000u

#define GPIO_MODER   0x00u /* mode; two bits a pin */
#define GPIO_OSPEEDR 0x08u /* output speed; two bits a pin */
#define GPIO_PUPDR   0x0Cu /* pull-up or pull-down; two bits a pin */
#define GPIO_AFRL    0x20u /* alternate functions of pins 0 to 7; four bits a pin */
#define GPIO_AFRH    0x24u /* of pins 8 to 15 */

#define GPIO_MODER_ALTERNATE 2u /* the pin belongs to a peripheral */
#define GPIO_OSPEEDR_HIGH    2u /* the second fastest of four */
#define GPIO_PUPDR_UP        1u /* pull-up */

/* Pins and their alternate functions: PIN_port and number_peripheral_signal. */
#define PIN_PA2_LPUART1_TX 12u
#define PIN_PA3_LPUART1_RX 12u
#define PIN_PA11_FDCAN1_RX 9u
#define PIN_PA12_FDCAN1_TX 9u

/* TIM2 and TIM5 count with 32 bits. */
#define TIM2_BASE 0x40000000u
#define TIM5_BASE 0x40000C00u

#define TIM_CR1        0x00u  /* control */
#define TIM_CR1_CEN    BIT(0) /* the counter runs */
#define TIM_DIER       0x0Cu  /* interrupts */
#define TIM_DIER_CC1IE BIT(1) /* TIM_SR_CC1IF requests one */
#define TIM_SR         0x10u  /* status; a 0 clears a flag, a 1 leaves it */
#define TIM_SR_CC1IF   BIT(1) /* the counter has reached TIM_CCR1 */
#define TIM_EGR        0x14u  /* events by software (write only) */
#define TIM_EGR_UG     BIT(0) /* update: takes TIM_PSC over, and the counter begins at 0 */
#define TIM_EGR_CC1G   BIT(1) /* as if the counter had reached TIM_CCR1 */
#define TIM_CNT        0x24u  /* the counter */
#define TIM_PSC        0x28u  /* prescaler: one less than the divisor of the clock */
#define TIM_CCR1       0x34u  /* compare value */

#define IRQ_TIM2 28u /* interrupt of TIM2, by its number in the vector table */

#define LPUART1_BASE 0x40008000u

#define LPUART_CR1     0x00u  /* control */
#define LPUART_CR1_UE  BIT(0) /* the UART is on */
#define LPUART_CR1_TE  BIT(3) /* the transmitter is on */
#define LPUART_BRR     0x0Cu  /* bit rate: 256 * clock / bit rate */
#define LPUART_ISR     0x1Cu  /* status (read only) */
#define LPUART_ISR_TC  BIT(6) /* the last character has left */
#define LPUART_ISR_TXE BIT(7) /* LPUART_TDR can take a character */
#define LPUART_TDR     0x28u  /* character to send */

#endif
