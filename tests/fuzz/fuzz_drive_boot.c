/* SPDX-License-Identifier: MIT */
/*
 * Fuzz harness of app/drives/drive_boot.h: the SDO client and the boot of the drives on a bus where anything may happen
 * to requests and answers, with any configuration. A boot that ends has found drives of the expected identity.
 * Afterwards, on a bus that is sound and with drives that were switched on anew, it ends.
 *
 * Input: writes to the configuration, then what becomes of each frame.
 *
 * Run by `make fuzz` with libFuzzer, and on its corpus by `make test` and `make unit` (replay.c). No I/O, except that a
 * broken rule is printed and aborts the process.
 */
#include <string.h>

#include "app/drives/drive_boot.h"
#include "app/machine/config.h"
#include "canopen/cob.h"
#include "canopen/nmt.h"
#include "canopen/od.h"
#include "canopen/sdo_abort.h"
#include "fake_drive.h"
#include "fuzz.h"
#include "od_controller.h"

#define DRIVES     2u
#define CONTROLLER 1u
#define HONEST_MS  20000u /* of time: longer than all time-outs of an attempt */

static struct {
    struct od od;
    struct od_controller values;
    struct config config;
    struct drive_boot boot;
    struct fake_drive drives[DRIVES];
    struct can_msg answers[8]; /* under way to the controller */
    unsigned answer_count;
} self;

/* Writes that the dictionary takes; what makes no sense is refused as the controller does. */
static void configure(struct fuzz_input *in)
{
    const unsigned writes = fuzz_byte(in) & 15u;
    self.values = od_controller_defaults;
    od_init(&self.od, &od_controller_table, &self.values, NULL, NULL);
    for (unsigned i = 0; i < writes; ++i) {
        const struct od_entry *entry =
            &od_controller_table.entries[fuzz_byte(in) % od_controller_table.entry_count];
        uint8_t value[8];
        fuzz_bytes(in, value, sizeof value);
        if (config_contains(entry->index) && entry->size <= sizeof value &&
            config_value_allowed(entry->index, entry->sub, cob_get(value, entry->size))) {
            (void)od_write(&self.od, entry, value, entry->size);
        }
    }
    config_read(&self.config, &self.od);
    self.config.own_node = CONTROLLER;
}

static void switch_drives_on(void)
{
    for (unsigned i = 0; i < DRIVES; ++i) {
        fake_drive_init(&self.drives[i], self.config.node[i], 0);
    }
    self.answer_count = 0;
}

static void queue(const struct can_msg *answer)
{
    if (self.answer_count < sizeof self.answers / sizeof self.answers[0]) {
        self.answers[self.answer_count++] = *answer;
    }
}

static void to_drives(const struct can_msg *frame)
{
    for (unsigned i = 0; i < DRIVES; ++i) {
        struct can_msg out[2];
        const int count = fake_drive_receive(&self.drives[i], frame, out);
        for (int k = 0; k < count; ++k) {
            queue(&out[k]);
        }
    }
}

/* What the controller sends: SDO requests to its drives, and NMT. */
static void check_sent(const struct can_msg *frame)
{
    bool to_a_drive = false;
    for (unsigned i = 0; i < self.config.axis_count; ++i) {
        const uint8_t node = self.config.node[i];
        to_a_drive = to_a_drive || (frame->id == COB_SDO_REQUEST + node && frame->len == 8u) ||
                     (frame->id == COB_NMT && frame->len == 2u && frame->data[1] == node);
    }
    FUZZ_CHECK(to_a_drive);
}

/* Changes a frame, or not: lost, other bytes, of another kind, an abort. `false`: it is lost. */
static bool spoil(struct fuzz_input *in, struct can_msg *frame)
{
    const uint8_t what = fuzz_byte(in);
    switch (what & 15u) {
    case 8:
        return false;
    case 9:
        frame->data[what >> 5] ^= fuzz_byte(in);
        return true;
    case 10:
        fuzz_bytes(in, frame->data, 8);
        return true;
    case 11:
        frame->len = what >> 4 < 8u ? what >> 4 : 8u;
        return true;
    case 12:
        frame->data[0] = 0x80;
        cob_put(frame->data + 4, SDO_ABORT_NO_OBJECT + (what >> 4), 4);
        return true;
    case 13:
        fuzz_bytes(in, frame->data + 4, 4);
        return true;
    case 14:
        queue(frame); /* twice */
        return true;
    default:
        return true;
    }
}

static void send(const struct can_msg *out, struct fuzz_input *in)
{
    struct can_msg frame = *out;
    check_sent(out);
    if (in == NULL || fuzz_byte(in) < 0xF0u || spoil(in, &frame)) {
        to_drives(&frame);
    }
}

static void pass_time(uint32_t us, struct fuzz_input *in)
{
    struct can_msg out;
    unsigned sent = 0;
    while (drive_boot_process(&self.boot, us, &out) != 0) {
        FUZZ_CHECK(++sent < 2000u);
        send(&out, in);
        us = 0;
    }
}

static void deliver(struct fuzz_input *in)
{
    struct can_msg waiting[sizeof self.answers / sizeof self.answers[0]];
    const unsigned count = self.answer_count;
    memcpy(waiting, self.answers, sizeof waiting);
    self.answer_count = 0;
    for (unsigned i = 0; i < count; ++i) {
        struct can_msg out;
        if ((in == NULL || spoil(in, &waiting[i])) &&
            drive_boot_receive(&self.boot, &waiting[i], &out) != 0) {
            send(&out, in);
        }
    }
}

/* As expected, or nothing was expected. */
static bool identity_fits(unsigned axis)
{
    const struct config_axis *expected = &self.config.axis[axis];
    const struct drive_properties *properties = &self.boot.properties[axis];
    const uint32_t wanted[3] = {expected->expected_vendor, expected->expected_product,
                                expected->expected_revision};
    bool fits = true;
    for (unsigned i = 0; i < 3u; ++i) {
        fits = fits &&
               (wanted[i] == 0u || (properties->known[(unsigned)DRIVE_VENDOR + i] &&
                                    properties->value[(unsigned)DRIVE_VENDOR + i] == wanted[i]));
    }
    return fits;
}

static bool finished(void)
{
    const bool done = drive_boot_finished(&self.boot);
    for (unsigned i = 0; i < self.config.axis_count && done; ++i) {
        FUZZ_CHECK(identity_fits(i));
    }
    return done;
}

static void round_of_bus(struct fuzz_input *in, uint32_t us)
{
    struct can_msg out;
    for (unsigned i = 0; i < DRIVES; ++i) {
        if (fake_drive_process(&self.drives[i], us, &out) != 0) {
            queue(&out);
        }
    }
    pass_time(us, in);
    deliver(in);
}

/* Whether fake drives can do what the configuration requires. */
static bool possible(void)
{
    const struct config *config = &self.config;
    bool fine = config->axis_count <= DRIVES;
    for (unsigned i = 0; i < config->axis_count && fine; ++i) {
        const struct config_axis *axis = &config->axis[i];
        fine = config->node[i] != CONTROLLER && (i == 0u || config->node[i] != config->node[0]) &&
               axis->expected_vendor == 0u && axis->expected_product == 0u &&
               axis->expected_revision == 0u;
    }
    return fine;
}

static void boots_on_a_sound_bus(void)
{
    bool done = false;
    switch_drives_on();
    drive_boot_begin(&self.boot, &self.config);
    for (unsigned ms = 0; ms < HONEST_MS && !done; ++ms) {
        round_of_bus(NULL, 1000);
        done = finished();
    }
    FUZZ_CHECK(done || self.boot.trouble.abort_code != SDO_ABORT_TIMEOUT);
    FUZZ_CHECK(done || self.boot.trouble.node != 0u);
}

static void harness(struct fuzz_input *in)
{
    memset(&self, 0, sizeof self);
    configure(in);
    switch_drives_on();
    drive_boot_init(&self.boot);
    drive_boot_begin(&self.boot, &self.config);
    while (fuzz_left(in)) {
        const uint8_t what = fuzz_byte(in);
        struct can_msg frame;
        if (what < 0xE0u) {
            round_of_bus(in, what < 0xC0u ? 1000u : (what - 0xBFu) * 20000u);
        } else if (what < 0xF8u) {
            fuzz_frame(in, &frame);
            frame.id = COB_SDO_RESPONSE + self.config.node[what & 1u];
            queue(&frame);
        } else {
            switch_drives_on();
        }
        if (finished()) {
            drive_boot_begin(&self.boot, &self.config);
        }
    }
    if (possible()) {
        boots_on_a_sound_bus();
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    return fuzz_run(harness, data, size);
}
