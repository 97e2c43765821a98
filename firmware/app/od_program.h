/* SPDX-License-Identifier: MIT */
/* od_program: the program image as the DOMAIN object 0x2000 sub 1: the DOMAIN hooks of the
 * dictionary. Mainline. */
#ifndef APP_OD_PROGRAM_H
#define APP_OD_PROGRAM_H

#include "app/controller.h"

/* Refused with SDO_ABORT_STATE while a program runs, SDO_ABORT_MEMORY when it cannot fit. */
uint32_t od_program_begin(void *context, const struct od_entry *entry, uint32_t size);
uint32_t od_program_write(void *context, const struct od_entry *entry, uint32_t offset,
                          const uint8_t *data, uint32_t size);
/* Checks the image; SDO_ABORT_VALUE when it is refused (0x2000 subs 3 and 4 say why). */
uint32_t od_program_end(void *context, const struct od_entry *entry, uint32_t size);
void od_program_abort(void *context, const struct od_entry *entry);

/* The active image goes back; SDO_ABORT_NO_DATA when there is none. */
uint32_t od_program_size(void *context, const struct od_entry *entry, uint32_t *size);
uint32_t od_program_read(void *context, const struct od_entry *entry, uint32_t offset,
                         uint8_t *data, uint32_t size);

#endif
