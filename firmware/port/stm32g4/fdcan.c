/* SPDX-License-Identifier: MIT */
/* Configuration, the way onto the bus and off it; frames are in fdcan_send.c and fdcan_receive.c. */
#include "port/stm32g4/fdcan.h"

#include <string.h>

#include "port/stm32g4/cpu.h"
#include "port/stm32g4/fdcan_private.h"
#include "port/stm32g4/fdcan_timing.h"

#define ALL_BUFFERS   ((1u << FDCAN_FIFO_ELEMENTS) - 1u)
#define ALL_FLAGS     0xFFFFFFFFu
#define FRAME_BITS    135u /* the longest: 8 bytes, all stuff bits, and the gap behind it */
#define SPARE_BITS    25u
#define COUNTS_PER_S  10000000u
#define GUARD_MAX     2500u
#define ANSWER_LOOKS  10000u /* at a bit that takes some cycles of the slower clock */
#define INTERRUPTS_ON (FDCAN_IE_RF0NE | FDCAN_IE_RF0LE | FDCAN_IE_TCE | FDCAN_IE_EPE | FDCAN_IE_BOE)

/* INIT crosses from one clock to another: it counts when it reads back. */
static bool set_control(uint32_t value)
{
    fdcan_put(FDCAN_CCCR, value);
    for (uint32_t i = 0; i < ANSWER_LOOKS; ++i) {
        if ((fdcan_get(FDCAN_CCCR) & (FDCAN_CCCR_INIT | FDCAN_CCCR_CCE)) == value) {
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
    fdcan_put(FDCAN_RXGFC, FDCAN_RXGFC_RRFE | FDCAN_RXGFC_RRFS |
                               reg_field(FDCAN_RXGFC_ANFE, FDCAN_REJECT) |
                               reg_field(FDCAN_RXGFC_ANFS, FDCAN_REJECT) |
                               reg_field(FDCAN_RXGFC_LSS, (uint32_t)filters));
}

/* A quarter of the shortest period at most: on a slow bus SYNC has to wait rather than the mainline for ever. */
static uint32_t guard(uint32_t bits_s)
{
    const uint32_t frame = (FRAME_BITS + SPARE_BITS) * (COUNTS_PER_S / bits_s);
    return frame < GUARD_MAX ? frame : GUARD_MAX;
}

bool fdcan_begin(struct fdcan *can, uint32_t bits_s)
{
    memset(can, 0, sizeof *can);
    can->off = true;
    const uint32_t timing = fdcan_timing(bits_s);
    if (timing == 0u || !open_configuration()) {
        return false;
    }
    can->guard_100ns = guard(bits_s);
    clear_message_ram();
    fdcan_put(FDCAN_NBTP, timing);
    reject_unless(0);
    fdcan_put(FDCAN_TXBC, 0);
    fdcan_put(FDCAN_TXBTIE, ALL_BUFFERS);
    fdcan_put(FDCAN_IR, ALL_FLAGS);
    fdcan_put(FDCAN_IE, INTERRUPTS_ON);
    fdcan_put(FDCAN_ILS, 0);
    fdcan_put(FDCAN_ILE, FDCAN_ILE_EINT0);
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

/* While the configuration is open the chip forgets its requests, too. Held. */
static void leave_and_come_back(struct fdcan *can)
{
    can->off = true;
    can->events.bus_offs++;
    fdcan_queue_clear(&can->urgent);
    fdcan_queue_clear(&can->ordinary);
    (void)open_configuration();
    (void)set_control(0);
}

void fdcan_attend(struct fdcan *can, uint32_t acknowledged)
{
    const uint8_t before = cpu_hold(CPU_PRIORITY_TICK);
    can->events.lost += reg_get(acknowledged, FDCAN_IR_RF0L);
    can->events.error_passives += reg_get(acknowledged, FDCAN_IR_EP);
    if ((acknowledged & FDCAN_IR_BO) != 0u) {
        if ((fdcan_get(FDCAN_PSR) & FDCAN_PSR_BO) != 0u) {
            leave_and_come_back(can);
        } else {
            can->off = false;
        }
    }
    if (!can->off) {
        fdcan_feed(can);
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
    const uint32_t counters = fdcan_get(FDCAN_ECR);
    *transmit = (uint8_t)reg_get(counters, FDCAN_ECR_TEC);
    *receive = (uint8_t)reg_get(counters, FDCAN_ECR_REC);
}
