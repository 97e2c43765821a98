/* SPDX-License-Identifier: MIT */
/* print_bits FILE KERNEL: prints the CRC-32 of all points of a program, with a hold near its end. Run by
 * test_same_bits.py, which builds it; reads FILE. */
#include <stdio.h>
#include <stdlib.h>

#include "core/crc32.h"
#include "core/interpolator.h"
#include "core/override_plan.h"
#include "core/program_check.h"

static uint8_t image[1 << 20];
static uint64_t records[1 << 20];

static uint32_t add(uint32_t crc, int64_t value)
{
    uint8_t bytes[8];
    for (int i = 0; i < 8; i++) {
        bytes[i] = (uint8_t)((uint64_t)value >> (8 * i));
    }
    return crc32_update(crc, bytes, 8);
}

int main(int argc, char **argv)
{
    static struct program p;
    static struct interpolator it;
    static struct program_clock clock;
    static struct override_plan plan;
    struct interpolator_point point;
    FILE *file = argc == 3 ? fopen(argv[1], "rb") : NULL;
    if (file == NULL) {
        return 2;
    }
    uint32_t size = (uint32_t)fread(image, 1, sizeof image, file);
    fclose(file);
    const struct kernel *kernel = kernel_find((uint32_t)atoi(argv[2]));
    if (kernel == NULL || program_open(&p, image, size) != 0 ||
        coefficients_make_in(&p, kernel, records, sizeof records) != 0 ||
        interpolator_begin(&it, &p) != 0) {
        return 2;
    }
    uint32_t crc = 0;
    uint32_t ticks = program_ticks(&p);
    program_clock_begin(&clock, &p, p.header.period_us, 0);
    override_plan_begin(&plan, &p);
    for (uint32_t tick = 0; tick < ticks; tick++) {
        if (tick == ticks - ticks / 4) {
            override_plan_hold(&plan);
        }
        if (interpolator_at_q42(&it, override_plan_tick(&plan, &clock), &point) < 0) {
            return 3;
        }
        for (uint32_t axis = 0; axis < p.header.axis_count; axis++) {
            crc = add(crc, point.position_q40[axis]);
        }
        crc = add(add(crc, point.arc_length_q40_mm), point.feed_q32_mm_s);
    }
    printf("%08lx\n", (unsigned long)crc);
    return 0;
}
