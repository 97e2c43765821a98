/* SPDX-License-Identifier: MIT */
/* od_write: what the host writes: commands, configuration, the cleared error history. Mainline. */
#ifndef APP_OD_WRITE_H
#define APP_OD_WRITE_H

#include "app/controller.h"

/* The write hook of the dictionary: SDO_OK, or SDO_ABORT_STATE when the command or change is not
 * possible now, SDO_ABORT_VALUE when the value makes no sense. Commands are executed here. */
uint32_t od_write_hook(void *context, const struct od_entry *entry, const uint8_t *value,
                       uint32_t size);

/* The urgent hook: hold, stop and quick stop wait for no transfer of another client. */
bool od_urgent_hook(const struct od_entry *entry, uint8_t value);

/* The written hook: a new configuration takes effect. */
void od_written_hook(void *context, const struct od_entry *entry);

#endif
