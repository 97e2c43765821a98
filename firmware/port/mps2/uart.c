/* SPDX-License-Identifier: MIT */
/* Implements port/mps2/uart.h (see there): UART 0 of the board (Arm's CMSDK UART), both directions by interrupt. Used
 * by link_slcan. Reads and writes the registers of UART 0. Any context; uart_begin in the main loop. `receive` is
 * called in the receive interrupt. */
#include "port/mps2/uart.h"

#include "port/cortex_m/core.h"
#include "port/cortex_m/startup.h"
#include "port/mps2/board.h"
#include "port/mps2/interrupts.h"

#define RING_SIZE 8192u /* more than an SDO block of 127 segments takes as text */

struct uart_registers {
    uint32_t data;
    uint32_t state;
    uint32_t control;
    uint32_t interrupts; /* pending; written: acknowledged */
    uint32_t divider;
};

enum { STATE_OUT_FULL = 1, STATE_IN_FULL = 2 };
enum { CONTROL_OUT = 1, CONTROL_IN = 2, CONTROL_OUT_INTERRUPT = 4, CONTROL_IN_INTERRUPT = 8 };
enum { INTERRUPT_OUT = 1, INTERRUPT_IN = 2 };

static struct {
    void (*receive)(char character);
    uint32_t head; /* characters ever put in; wraps */
    volatile uint32_t tail;
    char ring[RING_SIZE];
} self;

static volatile struct uart_registers *registers(void)
{
    return (volatile struct uart_registers *)BOARD_UART;
}

void uart_begin(void (*receive)(char character))
{
    self.receive = receive;
    registers()->divider = 16; /* the least that it accepts; the emulator ignores the speed */
    registers()->control = CONTROL_OUT | CONTROL_IN | CONTROL_OUT_INTERRUPT | CONTROL_IN_INTERRUPT;
    core_enable(BOARD_UART_NUMBER, INTERRUPTS_UART_PRIORITY);
    core_enable(BOARD_UART_NUMBER + 1u, INTERRUPTS_UART_PRIORITY);
}

bool uart_send(const char *text, uint32_t length)
{
    const uint32_t before = core_mask();
    const bool room = RING_SIZE - (self.head - self.tail) >= length;
    for (uint32_t i = 0; room && i < length; ++i) {
        self.ring[self.head++ % RING_SIZE] = text[i];
    }
    core_unmask(before);
    core_pend(BOARD_UART_NUMBER + 1u);
    return room;
}

uint32_t uart_mark(void)
{
    return self.head;
}

bool uart_passed(uint32_t mark)
{
    return (int32_t)(self.tail - mark) >= 0;
}

bool uart_idle(void)
{
    return self.head == self.tail;
}

/* Acknowledges first: a character that comes while the last one is taken makes the interrupt pending again. */
static void take_in(void)
{
    registers()->interrupts = INTERRUPT_IN;
    while ((registers()->state & STATE_IN_FULL) != 0u) {
        self.receive((char)registers()->data);
    }
}

/* Likewise: a character that leaves meanwhile makes the interrupt pending again. */
static void give_out(void)
{
    registers()->interrupts = INTERRUPT_OUT;
    while (self.tail != self.head && (registers()->state & STATE_OUT_FULL) == 0u) {
        registers()->data = (uint8_t)self.ring[self.tail % RING_SIZE];
        self.tail++;
    }
}

/* The boards have UART 0 at one of two numbers; an interrupt that is not enabled does not come. */
__attribute__((section(".vectors.board"), used)) static const startup_vector vectors[34] = {
    [0] = take_in, [1] = give_out, [32] = take_in, [33] = give_out};
