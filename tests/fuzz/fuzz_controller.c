/* SPDX-License-Identifier: MIT */
/*
 * Fuzz harness of app/controller.h: the whole controller on the fake port, with two fake drives, a host, and another
 * node that sends any frames; frames are lost and refused, ticks are late, the power fails. Rules: those of port.h (the
 * fake port checks them); no setpoint of an axis on the path is farther from the one before than its velocity limit
 * allows; a program that a block transfer has brought, or taken, is the one that was sent, whatever came between its
 * frames; and where the configuration is still the first one, a sound bus and a reset lead out of everything.
 *
 * Input: one byte selects what happens next.
 *
 * Run by `make fuzz` with libFuzzer, and on its corpus by `make test` and `make unit` (replay.c). No I/O, except that a
 * broken rule is printed and aborts the process.
 */
#include <stdlib.h>
#include <string.h>

#include "app/commands.h"
#include "app/controller.h"
#include "app_image.h"
#include "canopen/cob.h"
#include "canopen/pdo.h"
#include "fake_drive.h"
#include "fake_port.h"
#include "fuzz.h"

#define DRIVES              2u
#define VELOCITY_UM_S       120000u
#define ROUNDS_MAX          2000u /* of frames that answer frames, in one instant */
#define PERIODS_MAX         3000u
#define BACK_PERIODS        12000u /* time that the recovery from everything may take */
#define BEAT_PERIODS        50u
#define BLOCKS_MAX          20u /* of a transfer, repeated ones included */
#define SEGMENT_BYTES       7u
#define SDO_SIZE_CODE(size) (0x23u | ((4u - (size)) << 2))

static struct {
    struct controller controller;
    struct fake_drive drives[DRIVES];
    int32_t last_target[DRIVES];
    bool target_known[DRIVES];
    bool was_on_path;
    uint32_t first_crc32;
    uint32_t periods;
    uint32_t lost; /* so many of the next frames on the bus are lost */
} self;

/* The client of a block transfer of the program (object 0x2000 sub 1). */
static struct {
    uint8_t answer[8];
    uint8_t expected; /* answer[0], but size and CRC bits; 0: none */
    bool answered;
    bool aborted;
    bool reading; /* segments come */
    bool complete;
    uint32_t block_start;
    uint8_t good; /* last segment of the block that came in order */
    uint8_t data[APP_IMAGE_SIZE + SEGMENT_BYTES];
} client;

static void to_controller(const struct can_msg *frame)
{
    fake_port_receive(frame);
}

static void to_drives(const struct can_msg *frame)
{
    for (unsigned i = 0; i < DRIVES; ++i) {
        struct can_msg answers[2];
        const int count = fake_drive_receive(&self.drives[i], frame, answers);
        for (int k = 0; k < count; ++k) {
            if (self.lost > 0u) {
                self.lost--;
            } else {
                to_controller(&answers[k]);
            }
        }
    }
}

/* The states in which a target comes from a program, or stands. */
static bool on_path(void)
{
    const enum machine_state state = self.controller.machine.state;
    return state == MACHINE_READY || state == MACHINE_RUNNING || state == MACHINE_STOPPING ||
           state == MACHINE_HOLDING || state == MACHINE_HELD;
}

static void check_setpoint(const struct can_msg *frame)
{
    const struct config *config = &self.controller.config;
    for (unsigned i = 0; i < DRIVES && i < config->axis_count; ++i) {
        struct pdo_setpoint setpoint;
        if (frame->id != COB_RPDO1 + config->node[i] || pdo_decode_setpoint(frame, &setpoint) < 0) {
            continue;
        }
        const int64_t step = llabs((int64_t)setpoint.target_counts - self.last_target[i]);
        const int64_t most = (int64_t)config->axis[i].velocity_limit_um_s * config->period_us /
                                 1000000 * config->counts_per_mm / 1000 +
                             config->counts_per_mm / 1000 + 2;
        FUZZ_CHECK(!self.target_known[i] || !self.was_on_path || !on_path() ||
                   config->axis[i].velocity_limit_um_s == 0u || step <= most);
        self.last_target[i] = setpoint.target_counts;
        self.target_known[i] = true;
    }
}

static void take_segment(const struct can_msg *frame)
{
    const uint8_t sequence = frame->data[0] & 0x7Fu;
    const uint32_t offset = client.block_start + client.good * SEGMENT_BYTES;
    if (sequence == client.good + 1u && offset + SEGMENT_BYTES <= sizeof client.data) {
        memcpy(client.data + offset, frame->data + 1, SEGMENT_BYTES);
        client.good = sequence;
        client.complete = (frame->data[0] & 0x80u) != 0u;
    }
}

/* Answers to others name another object; that of a command to stop is no block's. */
static void to_client(const struct can_msg *frame)
{
    static const uint8_t object[3] = {0x00, 0x20, 0x01};
    if (frame->id != COB_SDO_RESPONSE + self.controller.node || frame->len != 8u) {
        return;
    }
    if (frame->data[0] == 0x80u) {
        client.aborted = client.aborted || memcmp(frame->data + 1, object, sizeof object) == 0;
    } else if (client.reading) {
        take_segment(frame);
    } else if (client.expected != 0u && (frame->data[0] & 0xE3u) == client.expected) {
        memcpy(client.answer, frame->data, sizeof client.answer);
        client.answered = true;
    }
}

static bool pass_frames(void)
{
    struct can_msg frame;
    bool any = false;
    while (fake_port_take(&frame)) {
        check_setpoint(&frame);
        if (self.lost > 0u) {
            self.lost--;
        } else {
            to_client(&frame);
            to_drives(&frame);
        }
        any = true;
    }
    return any;
}

static bool poll_drives(uint32_t us)
{
    bool any = false;
    for (unsigned i = 0; i < DRIVES; ++i) {
        struct can_msg frame;
        if (fake_drive_process(&self.drives[i], us, &frame) != 0) {
            to_controller(&frame);
            any = true;
        }
    }
    return any;
}

static void settle(void)
{
    bool busy = true;
    for (unsigned rounds = 0; busy; ++rounds) {
        FUZZ_CHECK(rounds < ROUNDS_MAX);
        busy = poll_drives(0);
        controller_poll(&self.controller);
        busy = pass_frames() || busy;
    }
}

static void settle_in_wait(void *context)
{
    (void)context;
    (void)pass_frames();
}

static void beat(void)
{
    for (unsigned i = 0; i < DRIVES; ++i) {
        const struct fake_drive *drive = &self.drives[i];
        if (!drive->dead && !drive->silent_heart && drive->nmt.state != NMT_INITIALISING &&
            self.periods % BEAT_PERIODS == 0u) {
            struct can_msg frame;
            cob_frame(&frame, COB_HEARTBEAT + drive->node, 1);
            frame.data[0] = (uint8_t)drive->nmt.state;
            to_controller(&frame);
        }
    }
}

static void period(uint32_t late_us)
{
    const bool guard_over = fake_port_awaited_us() > 0u && !fake_port_ready();
    const uint32_t us = guard_over ? fake_port_awaited_us() : self.controller.config.period_us;
    self.was_on_path = on_path();
    fake_port_advance_us(us + late_us);
    fake_port_tick(late_us * 1000u);
    (void)pass_frames();
    beat();
    (void)poll_drives(us);
    settle();
    self.periods++;
}

/* An expedited download, as an honest host sends it. */
static void write(uint16_t index, uint8_t sub, uint32_t value, uint8_t size)
{
    struct can_msg frame;
    cob_frame(&frame, COB_SDO_REQUEST + self.controller.node, 8);
    frame.data[0] = (uint8_t)SDO_SIZE_CODE(size);
    cob_put(frame.data + 1, index, 2);
    frame.data[3] = sub;
    cob_put(frame.data + 4, value, 4);
    to_controller(&frame);
    settle();
}

/* What 0x2050 sub 2 does. */
static void confirm(void)
{
    self.controller.configured =
        (struct configured){.known = true, .crc32 = self.controller.config.crc32};
}

static void power_on(void)
{
    controller_init(&self.controller, 1);
    FUZZ_CHECK(controller_start(&self.controller) == 0);
    fake_port_on_wait(settle_in_wait, NULL);
    memset(self.target_known, 0, sizeof self.target_known);
    self.was_on_path = false;
}

static void switch_drives_on(void)
{
    fake_drive_init(&self.drives[0], 2, 10000000);
    fake_drive_init(&self.drives[1], 3, -5000000);
}

static void begin(void)
{
    memset(&self, 0, sizeof self);
    fake_port_reset();
    power_on();
    switch_drives_on();
    for (uint8_t axis = 1; axis <= DRIVES; ++axis) {
        write(0x2030, axis, VELOCITY_UM_S, 4);
    }
    confirm();
    self.first_crc32 = self.controller.config.crc32;
}

/* A program by the slot, as an upload leaves it there. */
static void upload(struct fuzz_input *in, uint8_t changes)
{
    uint8_t image[APP_IMAGE_SIZE];
    app_image_make(image, 10, -5);
    for (uint8_t i = 0; i < changes; ++i) {
        const uint32_t at = fuzz_number(in, 2) % APP_IMAGE_SIZE;
        image[at] = fuzz_byte(in);
    }
    app_image_seal(image);
    port_lock();
    const bool moving = machine_moving(&self.controller.machine);
    port_unlock();
    if (!moving && program_slot_begin(&self.controller.slot, sizeof image) == 0) {
        (void)program_slot_write(&self.controller.slot, 0, image, sizeof image);
        (void)program_slot_finish(&self.controller.slot, sizeof image, &self.controller.config);
    }
}

static void misbehave(struct fake_drive *drive, struct fuzz_input *in)
{
    const uint8_t what = fuzz_byte(in);
    drive->mute = (what & 1u) != 0u;
    drive->silent_heart = (what & 2u) != 0u;
    drive->dead = (what & 4u) != 0u;
    drive->late = (what & 8u) != 0u;
    drive->stuck = (what & 16u) != 0u;
    drive->drops = (what >> 5) & 3u;
    if ((what & 128u) != 0u) {
        (void)cia402_device_fault(&drive->state);
    }
}

static void power_cycle(struct fuzz_input *in)
{
    (void)fake_port_cut_store(0);
    fake_port_keep_store();
    if (fuzz_byte(in) > 128u) {
        fake_port_spoil_store(fuzz_byte(in) % PORT_STORE_BANKS_ALL, fuzz_number(in, 2) % 2048u);
    }
    power_on();
    settle();
}

static void command(struct fuzz_input *in)
{
    const uint8_t what = fuzz_byte(in);
    if ((what & 0x80u) != 0u) {
        confirm();
    }
    write(0x2001, 0, what & 15u, 1);
}

static void neighbour(struct fuzz_input *in, uint8_t what)
{
    struct can_msg frame;
    fuzz_frame(in, &frame);
    if ((what & 1u) != 0u) { /* one of the identifiers that somebody listens to */
        static const uint16_t functions[] = {COB_EMCY,  COB_TPDO2,        COB_TPDO1,
                                             COB_RPDO1, COB_SDO_RESPONSE, COB_HEARTBEAT,
                                             COB_TPDO3, COB_SDO_REQUEST};
        frame.id = functions[(frame.id >> 3) & 7u] + 1u + frame.id % (DRIVES + 1u);
    }
    to_drives(&frame);
    to_controller(&frame);
    settle();
}

/* ---- Block transfers of the program ---- */

static void send_request(const uint8_t request[8])
{
    struct can_msg frame;
    cob_frame(&frame, COB_SDO_REQUEST + self.controller.node, 8);
    memcpy(frame.data, request, 8);
    to_controller(&frame);
}

/* Whether the answer `expected` has come. */
static bool ask(const uint8_t request[8], uint8_t expected)
{
    client.expected = expected;
    client.answered = false;
    client.aborted = false;
    send_request(request);
    settle();
    client.expected = 0;
    return client.answered && !client.aborted;
}

/* What comes between two frames of the client; false: its own next frame is lost. */
static bool disturb(struct fuzz_input *in)
{
    const uint8_t what = fuzz_byte(in);
    const unsigned more = what < 0xC0u ? 0u : fuzz_byte(in);
    if (what < 0xC0u) {
        return true;
    }
    switch (what & 7u) {
    case 0:
        period(0);
        return true;
    case 1:
        write(0x2001, 0, COMMAND_STOP, 1);
        return true;
    case 2:
    case 3:
        neighbour(in, what);
        return true;
    case 4:
        self.lost += 1u + (more & 3u);
        return true;
    case 5:
        for (unsigned i = 0; i <= more && self.periods < PERIODS_MAX; ++i) {
            period(0);
        }
        return true;
    default:
        return false;
    }
}

/* Segments of one block from `offset` on; returns how many of them the controller has taken. */
static uint8_t send_block(struct fuzz_input *in, const uint8_t *image, uint32_t size,
                          uint32_t offset, uint8_t segments)
{
    uint8_t request[8];
    uint8_t sequence = 0;
    bool last = false;
    client.answered = false;
    client.expected = 0xA2;
    while (!last && sequence < segments) {
        const uint32_t left = size - offset;
        last = left <= SEGMENT_BYTES;
        sequence++;
        memset(request, 0, sizeof request);
        request[0] = (uint8_t)(sequence | (last ? 0x80u : 0u));
        memcpy(request + 1, image + offset, last ? left : SEGMENT_BYTES);
        offset += SEGMENT_BYTES;
        if (disturb(in)) {
            send_request(request);
            settle();
        }
    }
    for (unsigned i = 0; i < 2000u && !client.answered && !client.aborted; ++i) {
        period(0);
    }
    client.expected = 0;
    return client.answered && client.answer[1] <= segments ? client.answer[1] : 0u;
}

static bool download_ends(const uint8_t *image, uint32_t size)
{
    const uint32_t unused = (SEGMENT_BYTES - size % SEGMENT_BYTES) % SEGMENT_BYTES;
    uint8_t request[8] = {(uint8_t)(0xC1u | (unused << 2))};
    cob_put(request + 1, sdo_block_crc(0, image, size), 2);
    return ask(request, 0xA1);
}

static void block_download(struct fuzz_input *in)
{
    uint8_t image[APP_IMAGE_SIZE];
    uint8_t request[8] = {0xC6, 0x00, 0x20, 0x01};
    uint32_t offset = 0;
    app_image_make(image, (int32_t)(fuzz_byte(in) % 20u), -5);
    cob_put(request + 4, sizeof image, 4);
    if (!ask(request, 0xA0)) {
        return;
    }
    for (unsigned i = 0; i < BLOCKS_MAX && offset < sizeof image && !client.aborted; ++i) {
        offset += SEGMENT_BYTES * send_block(in, image, sizeof image, offset, client.answer[4]);
        client.answer[4] = client.answer[2];
    }
    if (offset >= sizeof image && !client.aborted && download_ends(image, sizeof image)) {
        const struct program_slot *slot = &self.controller.slot;
        FUZZ_CHECK(slot->present && slot->program.header.image_size == sizeof image);
        FUZZ_CHECK(memcmp(slot->program.image, image, sizeof image) == 0);
    }
}

/* Acknowledges what came in order until all has come; false: it does not. */
static bool take_blocks(struct fuzz_input *in)
{
    uint8_t request[8] = {0xA3};
    for (unsigned i = 0; i < BLOCKS_MAX && !client.aborted; ++i) {
        client.reading = true;
        client.good = 0;
        client.complete = false;
        send_request(request);
        settle();
        client.reading = false;
        const bool complete = client.complete;
        request[0] = 0xA2;
        request[1] = client.good;
        request[2] = (uint8_t)(127u - fuzz_byte(in) % 127u);
        if (complete) {
            return ask(request, 0xC1);
        }
        client.block_start += SEGMENT_BYTES * client.good;
        (void)disturb(in);
    }
    return false;
}

static void block_upload(struct fuzz_input *in)
{
    const struct program_slot *slot = &self.controller.slot;
    const uint8_t first = (uint8_t)(127u - fuzz_byte(in) % 127u);
    const uint8_t request[8] = {0xA4, 0x00, 0x20, 0x01, first};
    const uint8_t done[8] = {0xA1};
    client.block_start = 0;
    if (!ask(request, 0xC2)) {
        return;
    }
    const uint32_t size = (uint32_t)cob_get(client.answer + 4, 4);
    FUZZ_CHECK(slot->present && size == slot->program.header.image_size);
    if (take_blocks(in)) {
        const uint16_t crc = (uint16_t)cob_get(client.answer + 1, 2);
        FUZZ_CHECK(crc == sdo_block_crc(0, client.data, size));
        FUZZ_CHECK(memcmp(client.data, slot->program.image, size) == 0);
        send_request(done);
        settle();
        FUZZ_CHECK(self.controller.server.state == SDO_SERVER_IDLE);
    }
}

static void refuse(struct fuzz_input *in)
{
    struct can_match match;
    match.id = (uint16_t)fuzz_number(in, 2);
    match.mask = (uint16_t)fuzz_number(in, 2);
    fake_port_refuse(&match, fuzz_byte(in) & 15u);
}

static void step(struct fuzz_input *in)
{
    const uint8_t what = fuzz_byte(in);
    const struct od_entry *entry;
    if (what < 0x60u) {
        for (unsigned i = 0; i <= what && self.periods < PERIODS_MAX; ++i) {
            period(0);
        }
        return;
    }
    switch (what & 15u) {
    case 0:
    case 1:
    case 2:
        command(in);
        break;
    case 3:
    case 4:
        neighbour(in, what);
        break;
    case 5:
        entry = &od_controller_table.entries[fuzz_byte(in) % od_controller_table.entry_count];
        if (entry->size >= 1u && entry->size <= 4u) {
            write(entry->index, entry->sub, fuzz_number(in, 4), (uint8_t)entry->size);
        }
        break;
    case 6:
        if (what < 0xC0u) {
            upload(in, what < 0xA0u ? 0u : fuzz_byte(in) & 7u);
        } else if (what < 0xE0u) {
            block_download(in);
        } else {
            block_upload(in);
        }
        break;
    case 7:
        misbehave(&self.drives[what >> 7], in);
        break;
    case 8:
        self.lost = fuzz_byte(in);
        break;
    case 9:
        refuse(in);
        break;
    case 10:
        period(fuzz_number(in, 3) & 0x1FFFFFu);
        break;
    case 11:
        power_cycle(in);
        break;
    case 12:
        (void)fake_port_cut_store(fuzz_number(in, 2));
        break;
    case 13:
        fake_drive_init(&self.drives[what >> 7], what >> 7 != 0u ? 3 : 2, fuzz_byte(in) * 100000);
        break;
    case 14:
        write(0x2010, 1, fuzz_byte(in), 2);
        break;
    default:
        fake_port_set_timing((enum port_timing)(fuzz_byte(in) % 3u));
        break;
    }
}

/* The bus is sound and the drives were switched on anew: with resets, OFF is reached. */
static void leads_back(void)
{
    const struct can_match nothing = {0x7FF, 0x7FF};
    const struct machine *machine = &self.controller.machine;
    if (self.controller.config.crc32 != self.first_crc32 || self.controller.node != 1u) {
        return;
    }
    fake_port_refuse(&nothing, 0);
    fake_port_fail_send(false);
    (void)fake_port_cut_store(0);
    self.lost = 0;
    switch_drives_on();
    confirm();
    for (unsigned i = 0; i < BACK_PERIODS && (i < 10u || machine->state != MACHINE_OFF); ++i) {
        period(0);
        if (i % 3000u == 2999u && machine->state != MACHINE_OFF) {
            write(0x2001, 0, COMMAND_QUICK_STOP, 1);
            write(0x2001, 0, COMMAND_RESET, 1);
        }
    }
    FUZZ_CHECK(machine->state == MACHINE_OFF);
}

static void harness(struct fuzz_input *in)
{
    begin();
    while (fuzz_left(in)) {
        step(in);
    }
    leads_back();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    return fuzz_run(harness, data, size);
}
