/* SPDX-License-Identifier: MIT */
/* setpoints IMAGE [COUNTS_PER_MM]: prints the setpoints of a program in counts, a line for each period. Built and run
 * by hand (docs/guides/embed.md) and by tests. Reads IMAGE, prints to stdout and stderr; no bus and no drives. */
#include <hodograph.h>

#include <stdio.h>
#include <stdlib.h>

#define FAR_Q40_MM ((int64_t)4096 << 40) /* travel: as far as the format allows */

static uint8_t image[1u << 20];
static uint64_t records[1u << 17];
static struct program program;
static struct interpolator interpolator;
static struct feed_override feed;

/* Makes a program ready; 0 or a negative error. */
static int load(uint32_t size)
{
    struct program_limits limits = {0};
    struct program_fault fault = {0, 0};
    for (uint32_t axis = 0; axis < PROGRAM_AXES; axis++) {
        limits.min_q40_mm[axis] = -FAR_Q40_MM;
        limits.max_q40_mm[axis] = FAR_Q40_MM;
    }
    int error = program_open(&program, image, size);
    if (error == 0) {
        error = program_check(&program, &limits, &fault);
    }
    if (error != 0) {
        fprintf(stderr, "refused at %lu: %s\n", (unsigned long)fault.index,
                program_error_text(error));
        return error;
    }
    error = coefficients_make_in(&program, kernel_find(KERNEL_FIXED), records, sizeof records);
    if (error == 0) {
        error = interpolator_begin(&interpolator, &program);
    }
    if (error == 0) {
        feed_override_begin(&feed, &program, program.header.period_us, 0);
    }
    return error;
}

int main(int argc, char **argv)
{
    FILE *file = argc > 1 ? fopen(argv[1], "rb") : NULL;
    if (file == NULL) {
        fprintf(stderr, "usage: setpoints IMAGE [COUNTS_PER_MM]\n");
        return 2;
    }
    const uint32_t counts_per_mm = argc > 2 ? (uint32_t)strtoul(argv[2], NULL, 10) : 1000000u;
    const uint32_t size = (uint32_t)fread(image, 1, sizeof image, file);
    fclose(file);
    if (load(size) != 0) {
        return 1;
    }
    while (feed_override_state(&feed) != FEED_ENDED) { /* what a timer does once in each period: */
        struct interpolator_point point;
        if (feed_override_next(&feed, &interpolator, &point) != 0) {
            return 1;
        }
        for (uint32_t axis = 0; axis < program.header.axis_count; axis++) {
            const int32_t counts = counts_from_q40_mm(point.position_q40[axis], counts_per_mm);
            printf("%s%ld", axis > 0 ? " " : "", (long)counts);
        }
        printf("\n");
    }
    return 0;
}
