/* SPDX-License-Identifier: MIT */
#include <string.h>

#include "port/stm32g4/cpu.h"
#include "port/stm32g4/fdcan_private.h"
#include "port/stm32g4/tick_timer.h"

/* Into the element that the chip names, then the request: in this order the chip never sees half a frame. */
static void transmit(uint32_t status, const struct can_msg *message)
{
    const uint32_t index = reg_get(status, FDCAN_TXFQS_TFQPI);
    const uint32_t element = FDCANRAM1_BASE + FDCANRAM_TXBUF + index * FDCAN_ELEMENT_SIZE;
    uint32_t words[2];
    memcpy(words, message->data, sizeof words);
    reg_write(element, reg_field(FDCAN_ELEMENT0_ID, message->id));
    reg_write(element + 4u, reg_field(FDCAN_ELEMENT1_DLC, message->len));
    reg_write(element + 8u, words[0]);
    reg_write(element + 12u, words[1]);
    fdcan_put(FDCAN_TXBAR, 1u << index);
}

/* The queue whose turn it is, with `room` free elements in the chip. What stays back before a tick has its turn when the
 * tick's own frames have gone. */
static struct fdcan_queue *next_queue(struct fdcan *can, uint32_t room)
{
    if (fdcan_queue_front(&can->urgent) != NULL) {
        return room > 0u ? &can->urgent : NULL;
    }
    const bool waits = fdcan_queue_front(&can->ordinary) != NULL;
    const bool fits = room == FDCAN_FIFO_ELEMENTS && tick_timer_left() > can->guard_100ns;
    return waits && fits ? &can->ordinary : NULL;
}

void fdcan_feed(struct fdcan *can)
{
    for (;;) {
        const uint32_t status = fdcan_get(FDCAN_TXFQS);
        struct fdcan_queue *queue = next_queue(can, reg_get(status, FDCAN_TXFQS_TFFL));
        if (queue == NULL) {
            return;
        }
        transmit(status, fdcan_queue_front(queue));
        can->mainline_last = queue == &can->ordinary;
        fdcan_queue_drop(queue);
    }
}

bool fdcan_send(struct fdcan *can, const struct can_msg *message, enum fdcan_sender sender)
{
    const uint8_t before = cpu_hold(CPU_PRIORITY_TICK);
    struct fdcan_queue *queue = sender == FDCAN_URGENT ? &can->urgent : &can->ordinary;
    const bool taken = !can->off && fdcan_queue_put(queue, message);
    if (taken) {
        fdcan_feed(can);
    }
    (void)cpu_hold(before);
    return taken;
}

/* The chip sends in the order of the requests, and takes a frame of the mainline only when it is empty: where that is the youngest
 * there, those of the interrupts have gone. */
bool fdcan_delivered(const struct fdcan *can)
{
    const uint8_t before = cpu_hold(CPU_PRIORITY_TICK);
    const uint32_t room = reg_get(fdcan_get(FDCAN_TXFQS), FDCAN_TXFQS_TFFL);
    const bool in_chip = room < FDCAN_FIFO_ELEMENTS && !can->mainline_last;
    const bool waits = fdcan_queue_front(&can->urgent) != NULL || in_chip;
    (void)cpu_hold(before);
    return can->off || !waits;
}
