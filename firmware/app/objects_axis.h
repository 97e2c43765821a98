/* SPDX-License-Identifier: MIT */
/*
 * objects_axis: handlers of objects that have one value for each axis, and of the outputs, for the table in objects.c.
 *
 *   0x200A ... 0x200E, 0x2017, 0x201B, 0x201C, 0x2024, 0x2026 ... 0x202C
 *               sub i + 1: axis i: values of its drive, reported or sent last
 *   0x1400 + i  TPDO1 of its drive      0x1800 + i  its RPDO1; third object 0x202B where the drive maps a torque offset
 *                                       0x1806 + i  its RPDO2, where the drive maps a velocity offset
 *   0x180C, 0x1A0C, 0x2036, 0x2058        outputs of the I/O module
 *
 * PDO parameters describe the frames on the bus. PDOs of axes that are not configured, and of offsets that are not
 * sent, have bit 31 of the COB-ID set.
 *
 * Readers return the value of the entry, two's complement in 64 bits, and change nothing. The one writer changes the
 * outputs at standstill. Called by objects.c only. Main loop: readers under the lock, the writer takes it.
 */
#ifndef APP_OBJECTS_AXIS_H
#define APP_OBJECTS_AXIS_H

#include <stdint.h>

#include "app/controller_state.h"

/* Process data. */
uint64_t object_read_statusword(struct controller *controller, const struct od_entry *entry);
uint64_t object_read_position(struct controller *controller, const struct od_entry *entry);
uint64_t object_read_error_code(struct controller *controller, const struct od_entry *entry);
uint64_t object_read_target(struct controller *controller, const struct od_entry *entry);
uint64_t object_read_controlword(struct controller *controller, const struct od_entry *entry);
uint64_t object_read_torque_offset(struct controller *controller, const struct od_entry *entry);
uint64_t object_read_velocity_offset(struct controller *controller, const struct od_entry *entry);

/* State of the axis and of its drive. */
uint64_t object_read_homed(struct controller *controller, const struct od_entry *entry);
uint64_t object_read_inputs(struct controller *controller, const struct od_entry *entry);
uint64_t object_read_following_error(struct controller *controller, const struct od_entry *entry);
uint64_t object_read_missed(struct controller *controller, const struct od_entry *entry);
uint64_t object_read_drive_state(struct controller *controller, const struct od_entry *entry);

/* 0x2027 ... 0x202A: 0x1018 subs 1 ... 4 of the drive. */
uint64_t object_read_identity(struct controller *controller, const struct od_entry *entry);

/* PDO parameters: COB-IDs (sub 1), number of mapped objects (sub 0), mapped objects that depend on the drive. */
uint64_t object_read_actual_cob_id(struct controller *controller, const struct od_entry *entry);
uint64_t object_read_setpoint_cob_id(struct controller *controller, const struct od_entry *entry);
uint64_t object_read_velocity_cob_id(struct controller *controller, const struct od_entry *entry);
uint64_t object_read_setpoint_count(struct controller *controller, const struct od_entry *entry);
uint64_t object_read_setpoint_torque(struct controller *controller, const struct od_entry *entry);
uint64_t object_read_velocity_count(struct controller *controller, const struct od_entry *entry);
uint64_t object_read_velocity_mapped(struct controller *controller, const struct od_entry *entry);

/* TPDO13, which is RPDO1 of the I/O module, and the outputs in it (0x2036). */
uint64_t object_read_outputs_cob_id(struct controller *controller, const struct od_entry *entry);
uint64_t object_read_outputs_mapping(struct controller *controller, const struct od_entry *entry);
uint64_t object_read_outputs(struct controller *controller, const struct od_entry *entry);

/* 0x2058 subs 1 ... 5 and 7: the outputs at standstill. */
uint64_t object_read_rest_outputs(struct controller *controller, const struct od_entry *entry);
uint32_t object_write_rest_outputs(struct controller *controller, const struct od_entry *entry,
                                   uint64_t number);

#endif
