/* SPDX-License-Identifier: MIT */
/* Implements port/stm32g4/irq.h (see there): the two interrupts of the controller, and the port's lock. Used by
 * port_stm32g4.c and vectors.c. Main loop, except the handlers. Switches the interrupts on and off by cpu, tick_timer
 * and fdcan, and calls the handlers of the application. */
#include "port/stm32g4/irq.h"

#include "port/stm32g4/cpu.h"
#include "port/stm32g4/reg_fdcan.h"
#include "port/stm32g4/reg_io.h"
#include "port/stm32g4/tick_timer.h"

static struct {
    struct fdcan *can;
    struct port_handlers handlers;
    struct tick_timer timer;
    volatile uint32_t ticks;
} self;

void irq_start(struct fdcan *can, const struct port_handlers *handlers, uint32_t period_us)
{
    self.can = can;
    self.handlers = *handlers;
    tick_timer_start(&self.timer, period_us);
    fdcan_start(can);
    cpu_interrupt_on(IRQ_TIM2, CPU_PRIORITY_TICK);
    cpu_interrupt_on(IRQ_FDCAN1_IT0, CPU_PRIORITY_RECEIVE);
}

void irq_stop(void)
{
    cpu_interrupt_off(IRQ_TIM2);
    cpu_interrupt_off(IRQ_FDCAN1_IT0);
    tick_timer_stop();
}

void irq_period(uint32_t period_us)
{
    const uint8_t before = cpu_hold(CPU_PRIORITY_TICK);
    tick_timer_period(&self.timer, period_us);
    (void)cpu_hold(before);
}

uint32_t irq_ticks(void)
{
    return self.ticks;
}

void irq_tick(void)
{
    const uint32_t late_ns = tick_timer_enter(&self.timer);
    self.handlers.tick(self.handlers.self, tick_timer_us(), late_ns);
    tick_timer_leave(&self.timer);
    self.ticks++;
}

/* A flood must not keep what was acknowledged waiting: it comes again as long as there are frames. */
void irq_can(void)
{
    const uint32_t acknowledged = fdcan_acknowledge();
    struct can_msg message;
    while (fdcan_fetch(&message)) {
        const uint8_t before = cpu_hold(CPU_PRIORITY_TICK);
        self.handlers.receive(self.handlers.self, &message, tick_timer_us());
        (void)cpu_hold(before);
    }
    fdcan_attend(self.can, acknowledged);
}
