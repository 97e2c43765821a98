/* SPDX-License-Identifier: MIT */
/* Implements app/program_slot.h (see there): the active program and the upload of its successor (object 0x2000). Called
 * by app/commands, app/objects, app/objects_program and app/controller.c. Main loop. Erases and writes the program
 * banks of the store, and changes its struct. */
#include "app/program_slot.h"

#include <string.h>

#include "app/bank_record.h"
#include "app/machine/path_counts.h"
#include "app/program_table.h"
#include "core/coefficients.h"
#include "core/first_axis.h"
#include "core/program_check.h"
#include "port/port.h"

#define COPY_BYTES 256u /* written at once, between two calls of program_table_attend */

void program_slot_init(struct program_slot *slot)
{
    memset(slot, 0, sizeof *slot);
}

enum program_slot_state program_slot_state(const struct program_slot *slot)
{
    if (slot->receiving) {
        return PROGRAM_SLOT_RECEIVING;
    }
    return slot->present ? PROGRAM_SLOT_READY : PROGRAM_SLOT_NONE;
}

static unsigned spare_bank(const struct program_slot *slot)
{
    return 1u - slot->bank;
}

uint64_t program_slot_memory(uint32_t kernel, uint8_t number)
{
    const struct kernel *made_for = kernel_find(kernel);
    switch (number) {
    case 1:
        return bank_record_room(0);
    case 2:
        return made_for != NULL ? coefficients_segment_size(made_for, PROGRAM_PLANE) : 0u;
    case 4:
        return made_for != NULL ? coefficients_segment_size(made_for, PROGRAM_SPACE) : 0u;
    case 5:
        return made_for != NULL ? coefficients_segment_size(made_for, PROGRAM_SPACE + 1u) -
                                      coefficients_segment_size(made_for, PROGRAM_SPACE)
                                : 0u;
    default:
        return made_for != NULL ? coefficients_piece_size(made_for) : 0u;
    }
}

int program_slot_begin(struct program_slot *slot, uint32_t size)
{
    if (size > bank_record_room(spare_bank(slot)) || port_store_erase(spare_bank(slot)) != 0) {
        return PORT_ERR_STORE;
    }
    slot->receiving = true;
    return 0;
}

int program_slot_write(struct program_slot *slot, uint32_t offset, const uint8_t *data,
                       uint32_t size)
{
    return port_store_write(spare_bank(slot), offset, data, size);
}

void program_slot_abandon(struct program_slot *slot)
{
    slot->receiving = false;
}

static int check(const struct program_slot *slot, const struct program *program,
                 const struct config *config, struct program_fault *fault)
{
    struct program_limits limits;
    if (first_axis_end(&program->header) > config->axis_count) {
        *fault = (struct program_fault){.code = PROGRAM_ERR_AXES, .index = 0};
        return fault->code;
    }
    config_limits(config, first_axis(&program->header), &limits);
    limits.attend = slot->user.attend;
    limits.self = slot->user.self;
    return program_check(program, &limits, fault);
}

static void adopt(struct program_slot *slot, const struct program *program, unsigned bank,
                  const struct bank_record *record)
{
    slot->program = *program;
    slot->bank = bank;
    slot->sequence = record->sequence;
    slot->config_crc32 = record->tag;
    slot->present = true;
}

/* Makes the image in a bank the active program: coefficient records for the kernel, then the commit record. */
static int seal(struct program_slot *slot, struct program *program, unsigned bank,
                const struct config *config)
{
    const struct bank_record record = {
        .sequence = slot->sequence + 1u, .size = program->header.image_size, .tag = config->crc32};
    const int result = program_table_write(bank, program, config->kernel, slot->user);
    if (result != 0) {
        return result;
    }
    if (bank_record_write(bank, &record) != 0) {
        return PROGRAM_ERR_STORE;
    }
    adopt(slot, program, bank, &record);
    return 0;
}

int program_slot_finish(struct program_slot *slot, uint32_t size, const struct config *config)
{
    const unsigned bank = spare_bank(slot);
    struct program candidate;
    slot->refused.index = 0;
    slot->refused.code = program_open(&candidate, port_store_data(bank), size);
    if (slot->refused.code == 0 && candidate.header.image_size != size) {
        slot->refused.code = PROGRAM_ERR_SIZE;
    }
    if (slot->refused.code == 0) {
        (void)check(slot, &candidate, config, &slot->refused);
    }
    if (slot->refused.code == 0) {
        slot->refused.code = seal(slot, &candidate, bank, config);
    }
    slot->receiving = false;
    if (slot->refused.code != 0) {
        return slot->refused.code;
    }
    slot->acceptable = true;
    slot->checked = true;
    path_counts_ends(&slot->program, config, slot->start_counts, slot->end_counts);
    return 0;
}

/* Checks with the limits of the format only; those of a configuration may change. */
static int check_format(const struct program *program, struct program_fault *fault)
{
    struct program_limits none = {.period_us = 0};
    for (uint32_t i = 0; i < PROGRAM_AXES; ++i) {
        none.min_q40_mm[i] = INT64_MIN;
        none.max_q40_mm[i] = INT64_MAX;
    }
    return program_check(program, &none, fault);
}

/* The program of a bank with a record, or why it is none. */
static int open_stored(struct program *program, unsigned bank, const struct bank_record *record,
                       struct program_fault *fault)
{
    fault->index = 0;
    fault->code = program_open(program, port_store_data(bank), record->size);
    if (fault->code == 0 && program->header.image_size != record->size) {
        fault->code = PROGRAM_ERR_SIZE;
    }
    return fault->code == 0 ? check_format(program, fault) : fault->code;
}

static void recover_bank(struct program_slot *slot, unsigned bank)
{
    struct bank_record record;
    struct program candidate;
    struct program_fault fault = {.code = 0, .index = 0};
    const struct bank_record best = {.sequence = slot->sequence, .size = 0, .tag = 0};
    if (!bank_record_read(bank, &record) || (slot->present && !bank_record_newer(&record, &best))) {
        return;
    }
    if (open_stored(&candidate, bank, &record, &fault) == 0) {
        adopt(slot, &candidate, bank, &record);
    } else {
        slot->refused = fault;
    }
}

/* The next upload is to be the newest for each firmware, also for one that takes a program which this one refuses. */
static void note_newest(struct program_slot *slot)
{
    bool known = slot->present;
    for (unsigned bank = 0; bank < PORT_STORE_BANKS; ++bank) {
        struct bank_record record;
        const struct bank_record newest = {.sequence = slot->sequence, .size = 0, .tag = 0};
        if (bank_record_read(bank, &record) && (!known || bank_record_newer(&record, &newest))) {
            slot->sequence = record.sequence;
            known = true;
        }
    }
}

void program_slot_recover(struct program_slot *slot)
{
    for (unsigned bank = 0; bank < PORT_STORE_BANKS; ++bank) {
        recover_bank(slot, bank);
    }
    const uint32_t active = slot->sequence;
    note_newest(slot);
    if (slot->present && slot->sequence == active) {
        slot->refused = (struct program_fault){.code = 0, .index = 0};
    }
    if (slot->refused.code != 0) {
        port_log(PORT_WARNING, "the newest program of the store is not whole, code",
                 slot->refused.code);
    }
    slot->checked = false;
}

/* A board erases and writes a block of it in less than 100 ms. */
static int copy_image(const struct program_slot *slot, unsigned bank)
{
    const uint32_t size = slot->program.header.image_size;
    int result = 0;
    for (uint32_t at = 0; at < size && result == 0; at += COPY_BYTES) {
        const uint32_t left = size - at;
        result = port_store_write(bank, at, slot->program.image + at,
                                  left < COPY_BYTES ? left : COPY_BYTES);
        program_table_attend(&slot->user);
    }
    return result;
}

/* Copies the program to the spare bank, with records for another kernel; the bank it was in stays as it is. */
static int move(struct program_slot *slot, const struct config *config)
{
    const unsigned bank = spare_bank(slot);
    struct program moved = slot->program;
    if (slot->receiving || port_store_erase(bank) != 0 || copy_image(slot, bank) != 0) {
        return PROGRAM_ERR_STORE;
    }
    moved.image = port_store_data(bank);
    return seal(slot, &moved, bank, config);
}

static int prepare(struct program_slot *slot, const struct config *config)
{
    const bool found = program_table_find(slot->bank, &slot->program, config->kernel, slot->user);
    return found ? 0 : move(slot, config);
}

bool program_slot_is_checked(const struct program_slot *slot, const struct config *config)
{
    return !slot->present || (slot->checked && slot->config_crc32 == config->crc32);
}

void program_slot_refresh(struct program_slot *slot, const struct config *config)
{
    if (program_slot_is_checked(slot, config)) {
        return;
    }
    struct program_fault fault = {.code = 0, .index = 0};
    if (check(slot, &slot->program, config, &fault) == 0) {
        fault.code = prepare(slot, config);
    }
    slot->acceptable = fault.code == 0;
    if (!slot->acceptable) {
        slot->refused = fault;
    }
    path_counts_ends(&slot->program, config, slot->start_counts, slot->end_counts);
    slot->config_crc32 = config->crc32;
    slot->checked = true;
}
