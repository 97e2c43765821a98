/* SPDX-License-Identifier: MIT */
/* Implements port/stm32g4/pins.h (see there): the pins that the port uses. Used by port_stm32g4.c and console. Main
 * loop, at the start. Writes registers of GPIOA and RCC. */
#include "port/stm32g4/pins.h"

#include "port/stm32g4/reg_clock.h"
#include "port/stm32g4/reg_io.h"

void pins_begin(void)
{
    reg_set(RCC_BASE + RCC_AHB2ENR, RCC_AHB2ENR_GPIOAEN);
    (void)reg_read(RCC_BASE + RCC_AHB2ENR); /* the clock comes two cycles later */
}

void pins_alternate(uint32_t pin, uint32_t function)
{
    const uint32_t pair = BITS(2u * pin, 2);
    const uint32_t select = GPIOA_BASE + (pin < 8u ? GPIO_AFRL : GPIO_AFRH);
    reg_put(select, BITS(4u * (pin % 8u), 4), function);
    reg_put(GPIOA_BASE + GPIO_OSPEEDR, pair, GPIO_OSPEEDR_HIGH);
    reg_put(GPIOA_BASE + GPIO_PUPDR, pair, GPIO_PUPDR_UP);
    reg_put(GPIOA_BASE + GPIO_MODER, pair, GPIO_MODER_ALTERNATE);
}
