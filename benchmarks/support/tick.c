/* SPDX-License-Identifier: MIT */
/*
 * Repeats the motion part of the tick, so that benchmarks/kernels.py can count its instructions.
 * Usage: tick FILE KERNEL RUNS [LOW HIGH]; KERNEL is a number. Compiled by benchmarks/kernels.py, which runs it under
 * callgrind. Reads FILE, a compiled program, and prints the number of ticks of all runs; writes no file.
 *
 * The coefficient records are made once, before the first run. If LOW and HIGH differ, the override changes between
 * them, in per cent, every 40 ticks.
 */
#include <stdio.h>
#include <stdlib.h>

#include "core/coefficients.h"
#include "core/counts.h"
#include "core/interpolator.h"
#include "core/override_plan.h"

enum { COUNTS_PER_MM = 1000000, SWITCH_TICKS = 40 };

static uint64_t image[1 << 17], records[1 << 17];

static int prepare(struct program *p, uint32_t number)
{
    const struct kernel *kernel = kernel_find(number);
    return kernel == NULL ? -1 : coefficients_make_in(p, kernel, records, sizeof records);
}

int main(int argc, char **argv)
{
    struct program p;
    struct interpolator it;
    struct program_clock clock;
    struct override_plan plan;
    struct interpolator_point point;
    volatile int64_t sum = 0;
    unsigned long ticks = 0;
    FILE *file = argc > 3 ? fopen(argv[1], "rb") : NULL;
    const size_t size = file != NULL ? fread(image, 1, sizeof image, file) : 0;
    if (program_open(&p, (const uint8_t *)image, (uint32_t)size) != 0 ||
        prepare(&p, (uint32_t)atoi(argv[2])) != 0) {
        return 1;
    }
    const uint32_t low = argc > 5 ? (uint32_t)atoi(argv[4]) : 100u;
    const uint32_t high = argc > 5 ? (uint32_t)atoi(argv[5]) : 100u;
    for (int run = atoi(argv[3]); run > 0; run--) {
        (void)interpolator_begin(&it, &p);
        program_clock_begin(&clock, &p, p.header.period_us, 0);
        override_plan_begin(&plan, &p);
        override_plan_set(&plan, high);
        for (unsigned k = 1; clock.time_q42_s != clock.duration_q42_s; k++) {
            if (low != high && k % SWITCH_TICKS == 0) {
                override_plan_set(&plan, k % (2u * SWITCH_TICKS) == 0 ? high : low);
            }
            const uint64_t time_q42_s = override_plan_tick(&plan, &clock);
            (void)interpolator_at_piece(&it, clock.record, time_q42_s, &point);
            sum += counts_from_q40_mm(point.position_q40[0], COUNTS_PER_MM);
            sum += counts_from_q40_mm(point.position_q40[1], COUNTS_PER_MM);
            ticks++;
        }
    }
    printf("%lu\n", ticks);
    return 0;
}
