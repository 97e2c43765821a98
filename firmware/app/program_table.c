/* SPDX-License-Identifier: MIT */
/* Implements app/program_table.h (see there): the coefficient records of the program in a bank of the store, right
 * after its image, for the kernel that the tick uses. Used by app/program_slot. Main loop. Reads and writes the bank of
 * the store that it is given. */
#include "app/program_table.h"

#include <string.h>

#include "app/bank_record.h"
#include "core/coefficients.h"
#include "core/program_rules.h"
#include "port/port.h"

struct place {
    unsigned bank;
    uint32_t offset;
    struct program_table_user user;
};

static int put_records(void *context, const uint8_t *bytes, uint32_t size)
{
    struct place *place = context;
    const int result = port_store_write(place->bank, place->offset, bytes, size);
    place->offset += size;
    program_table_attend(&place->user);
    return result;
}

static int compare_records(void *context, const uint8_t *bytes, uint32_t size)
{
    struct place *place = context;
    const int result = memcmp(port_store_data(place->bank) + place->offset, bytes, size);
    place->offset += size;
    program_table_attend(&place->user);
    return result == 0 ? 0 : PORT_ERR_STORE;
}

/* Sizes of header, segments and pieces are multiples of 8, and so is the image's. */
static struct place after_image(unsigned bank, const struct program *program,
                                struct program_table_user user)
{
    return (struct place){.bank = bank, .offset = program->header.image_size, .user = user};
}

static bool fits(unsigned bank, const struct program *program, const struct kernel *made_for)
{
    return program->header.image_size + coefficients_size(program, made_for) <=
           bank_record_room(bank);
}

static void attach(unsigned bank, struct program *program, const struct kernel *made_for)
{
    coefficients_attach(program, made_for, port_store_data(bank) + program->header.image_size);
}

int program_table_write(unsigned bank, struct program *program, uint32_t kernel,
                        struct program_table_user user)
{
    const struct kernel *made_for = kernel_find(kernel);
    struct place place = after_image(bank, program, user);
    if (made_for == NULL) {
        return PROGRAM_ERR_KERNEL;
    }
    if (!fits(bank, program, made_for)) {
        return PROGRAM_ERR_ROOM;
    }
    if (coefficients_make(program, made_for, put_records, &place) != 0) {
        return PROGRAM_ERR_STORE;
    }
    attach(bank, program, made_for);
    return 0;
}

bool program_table_find(unsigned bank, struct program *program, uint32_t kernel,
                        struct program_table_user user)
{
    const struct kernel *made_for = kernel_find(kernel);
    struct place place = after_image(bank, program, user);
    if (made_for == NULL) {
        return false;
    }
    if (program->coefficients_for == made_for) {
        return true;
    }
    if (!fits(bank, program, made_for) ||
        coefficients_make(program, made_for, compare_records, &place) != 0) {
        return false;
    }
    attach(bank, program, made_for);
    return true;
}
