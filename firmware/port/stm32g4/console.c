/* SPDX-License-Identifier: MIT */
/* Implements port/stm32g4/console.h (see there): sends the lines of port_log and of faults by LPUART1 on PA2, which the
 * board's ST-LINK shows as a serial port. Used by port_stm32g4.c and faults. Main loop, and handlers that do not
 * return: a character takes 87 us, and the functions wait for it. Writes registers of LPUART1 and RCC. */
#include "port/stm32g4/console.h"

#include "port/stm32g4/pins.h"
#include "port/stm32g4/reg_clock.h"
#include "port/stm32g4/reg_io.h"

/* 256 * 16 MHz / 115200 = 35555.6 */
#define DIVISOR 35556u

/* Longer than a character takes at any clock; a console that hangs must not stop the controller. */
#define POLLS 100000u

#define DIGITS_MAX 10u

void console_begin(void)
{
    reg_put(RCC_BASE + RCC_CCIPR, RCC_CCIPR_LPUART1SEL, RCC_CCIPR_LPUART1SEL_HSI);
    reg_set(RCC_BASE + RCC_APB1ENR2, RCC_APB1ENR2_LPUART1EN);
    (void)reg_read(RCC_BASE + RCC_APB1ENR2);
    pins_alternate(2, PIN_PA2_LPUART1_TX);
    reg_write(LPUART1_BASE + LPUART_BRR, DIVISOR);
    reg_write(LPUART1_BASE + LPUART_CR1, LPUART_CR1_UE | LPUART_CR1_TE);
}

static void put(char character)
{
    for (uint32_t i = 0; i < POLLS; ++i) {
        if ((reg_read(LPUART1_BASE + LPUART_ISR) & LPUART_ISR_TXE) != 0u) {
            reg_write(LPUART1_BASE + LPUART_TDR, (uint8_t)character);
            return;
        }
    }
}

static void put_text(const char *text)
{
    while (*text != '\0') {
        put(*text++);
    }
}

static void put_digits(uint32_t value, uint32_t base)
{
    char digits[DIGITS_MAX];
    uint32_t count = 0;
    do {
        digits[count++] = "0123456789abcdef"[value % base];
        value /= base;
    } while (value != 0u);
    while (count > 0u) {
        put(digits[--count]);
    }
}

static void begin_line(const char *text)
{
    put_text("hodograph: ");
    put_text(text);
    put(' ');
}

void console_number(const char *text, int32_t value)
{
    begin_line(text);
    if (value < 0) {
        put('-');
    }
    put_digits(value < 0 ? 0u - (uint32_t)value : (uint32_t)value, 10u);
    put_text("\r\n");
}

void console_hex(const char *text, uint32_t value)
{
    begin_line(text);
    put_text("0x");
    put_digits(value, 16u);
    put_text("\r\n");
}
