/* SPDX-License-Identifier: MIT */
/* Implements port/stm32g4/fdcan.h (see there): FDCAN1 for classic frames with 11-bit identifiers. Used by
 * port_stm32g4.c and irq. Main loop and interrupts, as each function states. Reads and writes the registers and the
 * message RAM of FDCAN1. */
#include "port/stm32g4/fdcan.h"

#include <string.h>

#include "port/stm32g4/cpu.h"
#include "port/stm32g4/reg_fdcan.h"
#include "port/stm32g4/tick_timer.h"

#define CLOCK_HZ       24000000u /* HSE */
#define QUANTA         24u       /* of a bit: one of synchronisation, */
#define BEFORE_SAMPLE  20u
#define AFTER_SAMPLE   3u
#define JUMP           3u
#define FASTEST_BITS_S (CLOCK_HZ / QUANTA)
#define PRESCALER_MAX  8u

#define ALL_BUFFERS   ((1u << FDCAN_FIFO_ELEMENTS) - 1u)
#define ALL_FLAGS     0xFFFFFFFFu
#define FRAME_BITS    135u /* the longest: 8 bytes, all stuff bits, and the gap after it */
#define SPARE_BITS    25u
#define COUNTS_PER_S  10000000u
#define GUARD_MAX     2500u
#define ANSWER_POLLS  10000u /* of a bit that takes some cycles of the slower clock */
#define INTERRUPTS_ON (FDCAN_IE_RF0NE | FDCAN_IE_RF0LE | FDCAN_IE_TCE | FDCAN_IE_EPE | FDCAN_IE_BOE)

static uint32_t get(uint32_t offset)
{
    return reg_read(FDCAN1_BASE + offset);
}

static void put(uint32_t offset, uint32_t value)
{
    reg_write(FDCAN1_BASE + offset, value);
}

/* ---- Configuration, onto the bus and off it ---- */

/* Value of register NBTP; 0: no such rate. */
static uint32_t bit_timing(uint32_t bits_s)
{
    for (uint32_t prescaler = 1; prescaler <= PRESCALER_MAX; prescaler *= 2u) {
        if (bits_s * prescaler == FASTEST_BITS_S) {
            return reg_field(FDCAN_NBTP_NSJW, JUMP - 1u) |
                   reg_field(FDCAN_NBTP_NBRP, prescaler - 1u) |
                   reg_field(FDCAN_NBTP_NTSEG1, BEFORE_SAMPLE - 1u) |
                   reg_field(FDCAN_NBTP_NTSEG2, AFTER_SAMPLE - 1u);
        }
    }
    return 0;
}

/* INIT crosses from one clock to another: it is valid when it reads back. */
static bool set_control(uint32_t value)
{
    put(FDCAN_CCCR, value);
    for (uint32_t i = 0; i < ANSWER_POLLS; ++i) {
        if ((get(FDCAN_CCCR) & (FDCAN_CCCR_INIT | FDCAN_CCCR_CCE)) == value) {
            return true;
        }
    }
    return false;
}

/* CCE can be set in a second write only, INIT being set. */
static bool open_configuration(void)
{
    return set_control(FDCAN_CCCR_INIT) && set_control(FDCAN_CCCR_INIT | FDCAN_CCCR_CCE);
}

/* Its contents are random after power-on. */
static void clear_message_ram(void)
{
    for (uint32_t offset = 0; offset < FDCANRAM_SIZE; offset += 4u) {
        reg_write(FDCANRAM1_BASE + offset, 0);
    }
}

static void reject_unless(size_t filters)
{
    put(FDCAN_RXGFC, FDCAN_RXGFC_RRFE | FDCAN_RXGFC_RRFS |
                         reg_field(FDCAN_RXGFC_ANFE, FDCAN_REJECT) |
                         reg_field(FDCAN_RXGFC_ANFS, FDCAN_REJECT) |
                         reg_field(FDCAN_RXGFC_LSS, (uint32_t)filters));
}

/* At most a quarter of the shortest period: on a slow bus SYNC may have to wait, else the main loop would wait for
 * ever. */
static uint32_t guard(uint32_t bits_s)
{
    const uint32_t frame = (FRAME_BITS + SPARE_BITS) * (COUNTS_PER_S / bits_s);
    return frame < GUARD_MAX ? frame : GUARD_MAX;
}

bool fdcan_begin(struct fdcan *can, uint32_t bits_s)
{
    memset(can, 0, sizeof *can);
    can->off = true;
    const uint32_t timing = bit_timing(bits_s);
    if (timing == 0u || !open_configuration()) {
        return false;
    }
    can->guard_100ns = guard(bits_s);
    clear_message_ram();
    put(FDCAN_NBTP, timing);
    reject_unless(0);
    put(FDCAN_TXBC, 0);
    put(FDCAN_TXBTIE, ALL_BUFFERS);
    put(FDCAN_IR, ALL_FLAGS);
    put(FDCAN_IE, INTERRUPTS_ON);
    put(FDCAN_ILS, 0);
    put(FDCAN_ILE, FDCAN_ILE_EINT0);
    return true;
}

bool fdcan_accept(const struct can_match *filters, size_t count)
{
    if (count > FDCAN_FILTERS) {
        return false;
    }
    for (size_t i = 0; i < count; ++i) {
        reg_write(FDCANRAM1_BASE + FDCANRAM_FLSSA + 4u * (uint32_t)i,
                  reg_field(FDCAN_FILTER_SFT, FDCAN_SFT_MASK) |
                      reg_field(FDCAN_FILTER_SFEC, FDCAN_SFEC_FIFO0) |
                      reg_field(FDCAN_FILTER_SFID1, filters[i].id) |
                      reg_field(FDCAN_FILTER_SFID2, filters[i].mask));
    }
    reject_unless(count);
    return true;
}

void fdcan_start(struct fdcan *can)
{
    can->off = false;
    (void)set_control(0);
}

void fdcan_stop(struct fdcan *can)
{
    can->off = true;
    (void)set_control(FDCAN_CCCR_INIT);
}

/* ---- Queues ---- */

static void queue_clear(struct fdcan_queue *queue)
{
    queue->head = 0;
    queue->tail = 0;
}

/* False: no room. */
static bool queue_put(struct fdcan_queue *queue, const struct can_msg *message)
{
    if (queue->head - queue->tail == FDCAN_QUEUE_SIZE) {
        return false;
    }
    queue->frames[queue->head % FDCAN_QUEUE_SIZE] = *message;
    queue->head++;
    return true;
}

/* The oldest, which stays; NULL: none. */
static const struct can_msg *queue_front(const struct fdcan_queue *queue)
{
    return queue->head == queue->tail ? NULL : &queue->frames[queue->tail % FDCAN_QUEUE_SIZE];
}

static void queue_drop(struct fdcan_queue *queue)
{
    queue->tail++;
}

/* ---- Sending ---- */

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
    put(FDCAN_TXBAR, 1u << index);
}

/* The queue that may send next, with `room` free elements in the chip. Frames that are held back before a tick are sent
 * after those of the tick. */
static struct fdcan_queue *next_queue(struct fdcan *can, uint32_t room)
{
    if (queue_front(&can->urgent) != NULL) {
        return room > 0u ? &can->urgent : NULL;
    }
    const bool waits = queue_front(&can->ordinary) != NULL;
    const bool fits = room == FDCAN_FIFO_ELEMENTS && tick_timer_left() > can->guard_100ns;
    return waits && fits ? &can->ordinary : NULL;
}

/* Gives the chip as many frames as its FIFO has room for, from the queue that may send next. With the tick held off. */
static void feed(struct fdcan *can)
{
    for (;;) {
        const uint32_t status = get(FDCAN_TXFQS);
        struct fdcan_queue *queue = next_queue(can, reg_get(status, FDCAN_TXFQS_TFFL));
        const struct can_msg *message = queue == NULL ? NULL : queue_front(queue);
        if (message == NULL) {
            return;
        }
        transmit(status, message);
        can->main_loop_last = queue == &can->ordinary;
        queue_drop(queue);
    }
}

bool fdcan_send(struct fdcan *can, const struct can_msg *message, enum fdcan_sender sender)
{
    const uint8_t before = cpu_hold(CPU_PRIORITY_TICK);
    struct fdcan_queue *queue = sender == FDCAN_URGENT ? &can->urgent : &can->ordinary;
    const bool taken = !can->off && queue_put(queue, message);
    if (taken) {
        feed(can);
    }
    (void)cpu_hold(before);
    return taken;
}

/* The chip sends in the order of the requests, and gets a frame of the main loop only when it is empty. So if the
 * newest frame in the chip is one of the main loop, those of the interrupts have been sent. */
bool fdcan_delivered(const struct fdcan *can)
{
    const uint8_t before = cpu_hold(CPU_PRIORITY_TICK);
    const uint32_t room = reg_get(get(FDCAN_TXFQS), FDCAN_TXFQS_TFFL);
    const bool in_chip = room < FDCAN_FIFO_ELEMENTS && !can->main_loop_last;
    const bool waits = queue_front(&can->urgent) != NULL || in_chip;
    (void)cpu_hold(before);
    return can->off || !waits;
}

/* ---- Receiving ---- */

uint32_t fdcan_acknowledge(void)
{
    const uint32_t flags = get(FDCAN_IR);
    put(FDCAN_IR, flags);
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
        const uint32_t status = get(FDCAN_RXF0S);
        if (reg_get(status, FDCAN_RXF0S_F0FL) == 0u) {
            return false;
        }
        const uint32_t index = reg_get(status, FDCAN_RXF0S_F0GI);
        const uint32_t element = FDCANRAM1_BASE + FDCANRAM_RXFIFO0 + index * FDCAN_ELEMENT_SIZE;
        const uint32_t first = reg_read(element);
        read_element(element, first, message);
        put(FDCAN_RXF0A, index);
        if (is_plain(first)) {
            return true;
        }
    }
}

/* ---- Bus-off and errors ---- */

/* Opening the configuration also drops the requests in the chip. With the tick held off. */
static void leave_and_come_back(struct fdcan *can)
{
    can->off = true;
    can->events.bus_offs++;
    queue_clear(&can->urgent);
    queue_clear(&can->ordinary);
    (void)open_configuration();
    (void)set_control(0);
}

void fdcan_attend(struct fdcan *can, uint32_t acknowledged)
{
    const uint8_t before = cpu_hold(CPU_PRIORITY_TICK);
    can->events.lost += reg_get(acknowledged, FDCAN_IR_RF0L);
    can->events.error_passives += reg_get(acknowledged, FDCAN_IR_EP);
    if ((acknowledged & FDCAN_IR_BO) != 0u) {
        if ((get(FDCAN_PSR) & FDCAN_PSR_BO) != 0u) {
            leave_and_come_back(can);
        } else {
            can->off = false;
        }
    }
    if (!can->off) {
        feed(can);
    }
    (void)cpu_hold(before);
}

struct fdcan_events fdcan_take_events(struct fdcan *can)
{
    const uint8_t before = cpu_hold(CPU_PRIORITY_TICK);
    const struct fdcan_events events = can->events;
    memset(&can->events, 0, sizeof can->events);
    (void)cpu_hold(before);
    return events;
}

void fdcan_errors(uint8_t *transmit, uint8_t *receive)
{
    const uint32_t counters = get(FDCAN_ECR);
    *transmit = (uint8_t)reg_get(counters, FDCAN_ECR_TEC);
    *receive = (uint8_t)reg_get(counters, FDCAN_ECR_REC);
}
