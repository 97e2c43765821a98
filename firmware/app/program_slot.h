/* SPDX-License-Identifier: MIT */
/*
 * program_slot: the active program and the upload of its successor (object 0x2000).
 *
 * An upload goes to the spare bank of the port's store. Only a complete image that passes every check becomes the
 * active program. A broken or refused upload leaves the active program unchanged. The commit record of a bank
 * (bank_record.h) is written last. So after a loss of power at any moment the new program or its predecessor is found.
 *
 * The commit record also holds the CRC-32 of the configuration that the program was checked against. Under another
 * configuration, and once after each power-on, the program is checked again before it may run.
 *
 * Called by app/commands, app/objects, app/objects_program and app/controller.c. Main loop. The program must not run
 * when an upload ends (see machine_moving). Erases and writes the program banks of the store, and changes its struct.
 */
#ifndef APP_PROGRAM_SLOT_H
#define APP_PROGRAM_SLOT_H

#include <stdbool.h>
#include <stdint.h>

#include "app/machine/config.h"
#include "app/program_table.h"
#include "core/program.h"
#include "core/program_rules.h"

/* Values of object 0x2000 sub 2. */
enum program_slot_state {
    PROGRAM_SLOT_NONE = 0,      /* no program */
    PROGRAM_SLOT_RECEIVING = 1, /* an upload is under way; a program may be active as well */
    PROGRAM_SLOT_READY = 2,     /* a program is active */
};

struct program_slot {
    /* Its `attend` is called at each step of the check of a program, and while one is copied or its records are
     * written, so that the main loop can send heartbeats. */
    struct program_table_user user;
    struct program program;       /* active, when present */
    struct program_fault refused; /* last refusal; code 0: none */
    int32_t start_counts
        [AXES_MAX]; /* first and last setpoint with the present configuration, by axis of the machine */
    int32_t end_counts[AXES_MAX];
    unsigned bank;         /* of the active program */
    uint32_t sequence;     /* of the newest record */
    uint32_t config_crc32; /* of the configuration it was last checked against */
    bool present;
    bool receiving;
    bool
        checked; /* since power-on, under config_crc32; else start, end and `acceptable` are not valid */
    bool acceptable; /* within the limits of that configuration */
};

void program_slot_init(struct program_slot *slot);

/* Makes the newest complete program of the store the active one: after power-on, before the first upload. Costs a whole
 * check of each program that it tries. If a newer one is not complete, `refused` holds the reason. */
void program_slot_recover(struct program_slot *slot);

/* Object 0x2041, in bytes: number 1 a bank for image and records; for a kernel the record of 2 a segment in the plane,
 * 3 a piece, 4 a segment in space, 5 each extra axis of it. */
uint64_t program_slot_memory(uint32_t kernel, uint8_t number);

enum program_slot_state program_slot_state(const struct program_slot *slot);

/* An upload: begin, write in order, then finish or abandon. 0 or PORT_ERR_STORE; finish: 0 or the
 * code that is then in slot->refused. */
int program_slot_begin(struct program_slot *slot, uint32_t size);
int program_slot_write(struct program_slot *slot, uint32_t offset, const uint8_t *data,
                       uint32_t size);
int program_slot_finish(struct program_slot *slot, uint32_t size, const struct config *config);
void program_slot_abandon(struct program_slot *slot);

/* Whether the program has been checked under this configuration since power-on: program_slot_refresh then costs
 * nothing. Without a program: true. Pure. */
bool program_slot_is_checked(const struct program_slot *slot, const struct config *config);

/* Brings start, end, `acceptable` and the coefficient records up to date. Costs a whole check if the configuration has
 * changed, and a copy of the program to the other bank if the kernel has changed. */
void program_slot_refresh(struct program_slot *slot, const struct config *config);

#endif
