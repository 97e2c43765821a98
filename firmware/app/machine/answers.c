/* SPDX-License-Identifier: MIT */
#include "app/machine/answers.h"

#include <string.h>

void answers_init(struct answers *answers)
{
    memset(answers, 0, sizeof *answers);
}

void answers_take(struct answers *answers, uint32_t now_us)
{
    if (answers->count < UINT8_MAX) {
        answers->count++;
    }
    answers->present = true;
    answers->lost = false;
    answers->last_us = now_us;
}

void answers_restart(struct answers *answers)
{
    const struct answers before = *answers;
    answers_init(answers);
    answers->present = before.present;
    answers->last_us = before.last_us;
}

static void note_absent(struct answers *answers, uint32_t sync_us)
{
    if (answers->unsettled == 0u) {
        answers->unsettled_us = sync_us;
    }
    answers->unsettled++;
    if (answers->absent_in_row < UINT32_MAX) {
        answers->absent_in_row++;
    }
}

static void note_present(struct answers *answers)
{
    const uint32_t late = answers->count - 1u;
    answers->unsettled -= late < answers->unsettled ? late : answers->unsettled;
    answers->absent_in_row = 0;
}

uint32_t answers_close_sync(struct answers *answers, uint32_t now_us, uint32_t sync_us,
                            uint32_t wait_us, uint8_t missed_max)
{
    if (!answers->present) {
        return 0;
    }
    if (answers->count == 0u) {
        note_absent(answers, sync_us);
    } else {
        note_present(answers);
    }
    answers->count = 0;
    answers->lost = answers->absent_in_row > missed_max && now_us - answers->last_us > wait_us;
    if (now_us - answers->unsettled_us < wait_us) {
        return 0;
    }
    const uint32_t missed = answers->unsettled;
    answers->missed += missed;
    answers->unsettled = 0;
    return missed;
}
