/* SPDX-License-Identifier: MIT */
/*
 * Fuzz harness of app/controller.h and app/bank_record.h: what a controller finds in its store at power-on. That is any
 * bytes, in banks with records that are right or wrong; and what a loss of power at any operation leaves. With a store
 * that it wrote itself the controller has the parameters from before a save or those of the save, and nothing else.
 *
 * Input: what is in the banks; then values to save, and when the power fails.
 *
 * Run by `make fuzz` with libFuzzer, and on its corpus by `make test` and `make unit` (replay.c). No I/O, except that a
 * broken rule is printed and aborts the process.
 */
#include <stdlib.h>
#include <string.h>

#include "app/bank_record.h"
#include "app/controller.h"
#include "app_image.h"
#include "canopen/cob.h"
#include "core/crc32.h"
#include "fake_port.h"
#include "fuzz.h"
#include "golden.h"

#define CONTENT_MAX 1024u

static struct controller controller;

static void power_on(void)
{
    fake_port_keep_store();
    controller_init(&controller, 1);
    FUZZ_CHECK(controller_start(&controller) == 0);
    controller_poll(&controller);
}

/* Any content; its CRC where there is one to be right, and perhaps the record. */
static void fill_bank(struct fuzz_input *in, unsigned bank)
{
    static uint8_t content[CONTENT_MAX];
    const uint8_t what = fuzz_byte(in);
    uint32_t size = fuzz_number(in, 2) % (CONTENT_MAX + 1u);
    fuzz_bytes(in, content, size);
    if (bank < PORT_STORE_BANKS && (what & 1u) != 0u) {
        app_image_make(content, 10, -5);
        content[what % APP_IMAGE_SIZE] ^= (uint8_t)(what >> 4);
        size = APP_IMAGE_SIZE;
    }
    if (bank < PORT_STORE_BANKS && (what & 2u) != 0u) {
        golden_seal(content, size);
    }
    const struct bank_record record = {
        .sequence = fuzz_byte(in),
        .size = (what & 4u) != 0u ? fuzz_number(in, 4) : size,
        .tag = bank < PORT_STORE_BANKS ? fuzz_byte(in) : crc32_update(0, content, size)};
    (void)port_store_erase(bank);
    (void)port_store_write(bank, 0, content, size);
    if ((what & 8u) == 0u) {
        (void)bank_record_write(bank, &record);
    }
}

/* Spoils what the controller itself has stored: the bytes are right but for these. */
static void spoil(struct fuzz_input *in)
{
    const unsigned count = fuzz_byte(in) & 3u;
    for (unsigned i = 0; i < count; ++i) {
        const unsigned bank = fuzz_byte(in) % PORT_STORE_BANKS_ALL;
        fake_port_spoil_store(bank, fuzz_number(in, 2) % PORT_STORE_PARAMETER_BYTES);
    }
}

/* Writes what the dictionary takes. */
static void change(struct fuzz_input *in)
{
    const struct od_entry *entry =
        &od_controller_table.entries[fuzz_number(in, 2) % od_controller_table.entry_count];
    uint8_t value[8];
    fuzz_bytes(in, value, sizeof value);
    if (config_contains(entry->index) && entry->size <= sizeof value) {
        (void)od_write(&controller.od, entry, value, entry->size);
    }
}

/* A save that the power may cut off. */
static void save(struct fuzz_input *in)
{
    const bool was_whole = controller.store.state == PARAMETER_STORE_WHOLE;
    const bool was_none = controller.store.state == PARAMETER_STORE_EMPTY;
    const uint32_t before = controller.store.config_crc32;
    change(in);
    const uint32_t after = controller.config.crc32;
    const uint32_t cut = fuzz_number(in, 2) % 1200u;
    (void)fake_port_cut_store(cut);
    const int result =
        parameter_store_save(&controller.store, &controller.od, after, fuzz_byte(in) != 0u);
    (void)fake_port_cut_store(0);
    power_on();
    const struct parameter_store *found = &controller.store;
    FUZZ_CHECK(result != 0 || found->state == PARAMETER_STORE_WHOLE);
    FUZZ_CHECK(result != 0 || found->config_crc32 == after);
    FUZZ_CHECK(!was_whole || (found->state == PARAMETER_STORE_WHOLE &&
                              (found->config_crc32 == before || found->config_crc32 == after)));
    FUZZ_CHECK(!was_none || found->state == PARAMETER_STORE_EMPTY ||
               (found->state == PARAMETER_STORE_WHOLE && found->config_crc32 == after));
    FUZZ_CHECK(found->state != PARAMETER_STORE_WHOLE ||
               controller.config.crc32 == found->config_crc32);
}

static void harness(struct fuzz_input *in)
{
    fake_port_reset();
    const uint8_t which = fuzz_byte(in);
    for (unsigned bank = 0; bank < PORT_STORE_BANKS_ALL; ++bank) {
        if ((which >> bank & 1u) != 0u) {
            fill_bank(in, bank);
        }
    }
    power_on();
    while (fuzz_left(in)) {
        save(in);
        if ((which & 0x80u) != 0u) {
            spoil(in);
            power_on();
        }
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    return fuzz_run(harness, data, size);
}
