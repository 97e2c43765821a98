/* SPDX-License-Identifier: MIT */
/* Implements port/stm32g4/tick_timer.h (see there): the clocks of the port, and when the next tick is due. Used by
 * irq.c, fdcan.c and port_stm32g4.c. Main loop and tick; the times in any context. Writes the registers of TIM2 and
 * TIM5. */
#include "port/stm32g4/tick_timer.h"

#include "port/stm32g4/reg_io.h"

#define NS_PER_COUNT 100u

static void run(uint32_t base, uint32_t divisor)
{
    reg_write(base + TIM_PSC, divisor - 1u);
    reg_write(base + TIM_EGR, TIM_EGR_UG); /* takes the divisor over */
    reg_write(base + TIM_CR1, TIM_CR1_CEN);
}

void tick_timer_begin(uint32_t input_mhz)
{
    run(TIM2_BASE, input_mhz / TICK_TIMER_PER_US);
    run(TIM5_BASE, input_mhz);
}

static uint32_t now(void)
{
    return reg_read(TIM2_BASE + TIM_CNT);
}

uint32_t tick_timer_ns(void)
{
    return now() * NS_PER_COUNT;
}

uint32_t tick_timer_us(void)
{
    return reg_read(TIM5_BASE + TIM_CNT);
}

uint32_t tick_timer_left(void)
{
    if ((reg_read(TIM2_BASE + TIM_DIER) & TIM_DIER_CC1IE) == 0u) {
        return UINT32_MAX;
    }
    const uint32_t left = reg_read(TIM2_BASE + TIM_CCR1) - now();
    return left <= UINT32_MAX / 2u ? left : 0u;
}

static void acknowledge(void)
{
    reg_write(TIM2_BASE + TIM_SR, ~TIM_SR_CC1IF);
}

static uint32_t since(uint32_t later, uint32_t earlier)
{
    const uint32_t counts = later - earlier;
    return counts <= UINT32_MAX / 2u ? counts : 0u;
}

/* The compare is for equality: for a time that is over the interrupt is made by software. */
static void wake_at(uint32_t time)
{
    reg_write(TIM2_BASE + TIM_CCR1, time);
    if (now() - time <= UINT32_MAX / 2u) {
        reg_write(TIM2_BASE + TIM_EGR, TIM_EGR_CC1G);
    }
}

void tick_timer_start(struct tick_timer *timer, uint32_t period_us)
{
    tick_timer_period(timer, period_us);
    timer->started = now();
    timer->due = timer->started + timer->period;
    reg_write(TIM2_BASE + TIM_CCR1, timer->due);
    acknowledge();
    reg_write(TIM2_BASE + TIM_DIER, TIM_DIER_CC1IE);
}

void tick_timer_stop(void)
{
    reg_write(TIM2_BASE + TIM_DIER, 0);
    acknowledge();
}

void tick_timer_period(struct tick_timer *timer, uint32_t period_us)
{
    timer->period = period_us * TICK_TIMER_PER_US;
}

uint32_t tick_timer_enter(struct tick_timer *timer)
{
    acknowledge();
    timer->started = now();
    const uint32_t late = since(timer->started, timer->due);
    return late <= UINT32_MAX / NS_PER_COUNT ? late * NS_PER_COUNT : UINT32_MAX;
}

void tick_timer_leave(struct tick_timer *timer)
{
    const uint32_t late = since(timer->started, timer->due);
    const uint32_t rest = timer->period / 4u * 3u;
    timer->due = (late < timer->period ? timer->due : timer->started) + timer->period;
    const uint32_t earliest = timer->started + rest;
    wake_at(since(earliest, timer->due) > 0u ? earliest : timer->due);
}
