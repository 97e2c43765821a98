/* SPDX-License-Identifier: MIT */
/*
 * od_read_pdo: the controller's PDO parameters, which say what is on the bus: by axis
 *
 *   0x1400 + i  TPDO1 of its drive      0x1800 + i  its RPDO1; third object 0x202B where the drive maps a torque offset
 *                                       0x1806 + i  its RPDO2, where the drive maps a velocity offset
 *
 * Those of axes that are not configured, and offsets that are not sent, have bit 31 of the COB-ID set.
 * Pure, under the lock.
 */
#ifndef APP_OD_READ_PDO_H
#define APP_OD_READ_PDO_H

#include <stdbool.h>
#include <stdint.h>

#include "app/machine/machine.h"
#include "canopen/od.h"

/* The value of an entry that depends on configuration and drives: true, and it is in *number. False: its default holds. */
bool od_read_pdo(const struct machine *machine, const struct od_entry *entry, uint64_t *number);

#endif
