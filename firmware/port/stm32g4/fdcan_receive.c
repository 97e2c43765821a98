/* SPDX-License-Identifier: MIT */
#include <string.h>

#include "port/stm32g4/fdcan_private.h"

uint32_t fdcan_acknowledge(void)
{
    const uint32_t flags = fdcan_get(FDCAN_IR);
    fdcan_put(FDCAN_IR, flags);
    return flags;
}

static bool is_plain(uint32_t word)
{
    return (word & (FDCAN_ELEMENT0_XTD | FDCAN_ELEMENT0_RTR)) == 0u;
}

static void read_element(uint32_t element, uint32_t first, struct can_msg *message)
{
    const uint32_t length = reg_get(reg_read(element + 4u), FDCAN_ELEMENT1_DLC);
    const uint32_t words[2] = {reg_read(element + 8u), reg_read(element + 12u)};
    memset(message, 0, sizeof *message);
    message->id = reg_get(first, FDCAN_ELEMENT0_ID);
    message->len = (uint8_t)(length < CAN_DATA_MAX ? length : CAN_DATA_MAX);
    memcpy(message->data, words, message->len);
}

bool fdcan_fetch(struct can_msg *message)
{
    for (;;) {
        const uint32_t status = fdcan_get(FDCAN_RXF0S);
        if (reg_get(status, FDCAN_RXF0S_F0FL) == 0u) {
            return false;
        }
        const uint32_t index = reg_get(status, FDCAN_RXF0S_F0GI);
        const uint32_t element = FDCANRAM1_BASE + FDCANRAM_RXFIFO0 + index * FDCAN_ELEMENT_SIZE;
        const uint32_t first = reg_read(element);
        read_element(element, first, message);
        fdcan_put(FDCAN_RXF0A, index);
        if (is_plain(first)) {
            return true;
        }
    }
}
