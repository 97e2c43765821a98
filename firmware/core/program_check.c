/* SPDX-License-Identifier: MIT */
#include "core/program_check.h"

#include "core/crossing_check.h"
#include "core/limit_check.h"
#include "core/piece_check.h"
#include "core/segment_check.h"
#include "core/stop_check.h"

#define NAME_FROM 80u
#define NAME_SIZE 32u

static int bytes_are_zero(const uint8_t *b, uint32_t size)
{
    for (uint32_t i = 0; i < size; i++) {
        if (b[i] != 0) {
            return 0;
        }
    }
    return 1;
}

static int name_is_padded(const uint8_t *name)
{
    uint32_t i = 0;
    while (i < NAME_SIZE && name[i] != 0) {
        i++;
    }
    return bytes_are_zero(name + i, NAME_SIZE - i);
}

static int check_period(uint32_t period_us, uint32_t configured_us)
{
    if (period_us != 1000 && period_us != 2000 && period_us != 4000 && period_us != 8000) {
        return PROGRAM_ERR_PERIOD;
    }
    return configured_us == 0 || configured_us == period_us ? 0 : PROGRAM_ERR_PERIOD_USED;
}

static int check_header(const struct program *p, const struct program_limits *limits)
{
    const struct program_header *h = &p->header;
    int code = check_period(h->period_us, limits->period_us);
    if (code != 0) {
        return code;
    }
    if ((h->flags & ~PROGRAM_FLAG_CLOSED) != 0 || !bytes_are_zero(p->image + 76, 4)) {
        return PROGRAM_ERR_FLAGS;
    }
    if (h->axis_count != 2) {
        return PROGRAM_ERR_AXES;
    }
    if (h->length_q40_mm <= 0 || h->length_q40_mm >= (int64_t)1 << 62) {
        return PROGRAM_ERR_LENGTH;
    }
    return name_is_padded(p->image + NAME_FROM) ? 0 : PROGRAM_ERR_NAME;
}

int program_check(const struct program *p, const struct program_limits *limits,
                  struct program_fault *fault)
{
    fault->index = 0;
    fault->code = check_header(p, limits);
    if (fault->code == 0) {
        fault->code = segment_check_all(p, limits, &fault->index);
    }
    if (fault->code == 0) {
        fault->code = piece_check_all(p, limits, &fault->index);
    }
    if (fault->code == 0) {
        fault->code = crossing_check_all(p, &fault->index);
    }
    if (fault->code == 0) {
        fault->code = limit_check_all(p, limits, &fault->index);
    }
    if (fault->code == 0) {
        fault->code = stop_check_all(p, limits, &fault->index);
    }
    return fault->code;
}
