/* SPDX-License-Identifier: MIT */
/* od_read: what the host reads: objects 0x2000 (but its image), 0x2002 ... 0x202C, PDO parameters.
 * Mainline. */
#ifndef APP_OD_READ_H
#define APP_OD_READ_H

#include "app/controller.h"

/* Brings the field of the entry up to date; entries of other objects are left alone. The read hook
 * of the dictionary: context is the controller; always SDO_OK. */
uint32_t od_read_hook(void *context, const struct od_entry *entry);

#endif
