/* SPDX-License-Identifier: MIT */
/* What the files of fdcan share: registers of FDCAN1, and the transmitter. */
#ifndef PORT_STM32G4_FDCAN_PRIVATE_H
#define PORT_STM32G4_FDCAN_PRIVATE_H

#include <stdint.h>

#include "port/stm32g4/fdcan.h"
#include "port/stm32g4/reg_fdcan.h"

static inline uint32_t fdcan_get(uint32_t offset)
{
    return reg_read(FDCAN1_BASE + offset);
}

static inline void fdcan_put(uint32_t offset, uint32_t value)
{
    reg_write(FDCAN1_BASE + offset, value);
}

/* Gives the chip what its FIFO has room for, from the queue whose turn it is. With the tick held off. */
void fdcan_feed(struct fdcan *can);

#endif
