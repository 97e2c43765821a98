/* SPDX-License-Identifier: MIT */
/* Implements app/machine/tpdo_monitor.h (see there): which SYNCs a drive has answered with its TPDO1, and which it
 * has left unanswered. */
#include "app/machine/tpdo_monitor.h"

#include <string.h>

void tpdo_monitor_init(struct tpdo_monitor *answers)
{
    memset(answers, 0, sizeof *answers);
}

void tpdo_monitor_take(struct tpdo_monitor *answers, uint32_t now_us)
{
    if (answers->count < UINT8_MAX) {
        answers->count++;
    }
    answers->present = true;
    answers->lost = false;
    answers->last_us = now_us;
}

void tpdo_monitor_restart(struct tpdo_monitor *answers)
{
    const struct tpdo_monitor before = *answers;
    tpdo_monitor_init(answers);
    answers->present = before.present;
    answers->last_us = before.last_us;
}

/* The oldest absent one turns out to be late, or missed. */
static void settle(struct tpdo_monitor *answers)
{
    answers->first = (uint8_t)((answers->first + 1u) % TPDO_MONITOR_UNSETTLED);
    answers->unsettled--;
}

static uint32_t note_absent(struct tpdo_monitor *answers, uint32_t sync_us)
{
    uint32_t missed = 0;
    if (answers->unsettled == TPDO_MONITOR_UNSETTLED) {
        settle(answers);
        missed = 1;
    }
    answers->absent_us[(answers->first + answers->unsettled) % TPDO_MONITOR_UNSETTLED] = sync_us;
    answers->unsettled++;
    if (answers->absent_in_row < UINT32_MAX) {
        answers->absent_in_row++;
    }
    return missed;
}

static void note_present(struct tpdo_monitor *answers)
{
    for (uint32_t late = answers->count - 1u; late > 0u && answers->unsettled > 0u; --late) {
        settle(answers);
    }
    answers->absent_in_row = 0;
}

uint32_t tpdo_monitor_close_sync(struct tpdo_monitor *answers, uint32_t now_us, uint32_t sync_us,
                                 uint32_t wait_us, uint8_t missed_max)
{
    uint32_t missed = 0;
    if (!answers->present) {
        return 0;
    }
    if (answers->count == 0u) {
        missed = note_absent(answers, sync_us);
    } else {
        note_present(answers);
    }
    answers->count = 0;
    answers->lost = answers->absent_in_row > missed_max && now_us - answers->last_us > wait_us;
    while (answers->unsettled > 0u &&
           (answers->lost || now_us - answers->absent_us[answers->first] >= wait_us)) {
        settle(answers);
        missed++;
    }
    answers->missed += missed;
    return missed;
}
