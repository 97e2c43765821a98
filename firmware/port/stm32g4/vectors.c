/* SPDX-License-Identifier: MIT */
/* The interrupt vectors of the board, up to the last interrupt that is used. Used by the hardware. Constant data. */
#include "port/cortex_m/startup.h"
#include "port/stm32g4/irq.h"
#include "port/stm32g4/reg_fdcan.h"
#include "port/stm32g4/reg_io.h"

__attribute__((section(".vectors.board"), used)) static const startup_vector board_vectors[] = {
    [IRQ_FDCAN1_IT0] = irq_can,
    [IRQ_TIM2] = irq_tick,
};
