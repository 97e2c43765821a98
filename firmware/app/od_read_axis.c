/* SPDX-License-Identifier: MIT */
#include "app/od_read_axis.h"

static uint64_t drive_state(const struct axis *axis)
{
    return axis->answers.present ? (uint64_t)axis->state + 1u : 0u;
}

uint64_t od_read_axis(const struct axis *axis, uint16_t index)
{
    switch (index) {
    case 0x2017:
        return axis->homed ? 1u : 0u;
    case 0x201B:
        return axis->digital_inputs;
    case 0x201C:
        return (uint64_t)(int64_t)axis->following_error_counts;
    case 0x202B:
        return (uint64_t)(int64_t)axis->torque_offset_permille;
    case 0x202C:
        return (uint64_t)(int64_t)axis->velocity_offset_counts_s;
    case 0x2024:
        return axis->answers.missed;
    case 0x2026:
        return drive_state(axis);
    case 0x200A:
        return axis->statusword;
    case 0x200B:
        return (uint64_t)(int64_t)axis->position_counts;
    case 0x200C:
        return axis->error_code;
    case 0x200D:
        return (uint64_t)(int64_t)axis->target_sent_counts;
    default:
        return axis->controlword;
    }
}
