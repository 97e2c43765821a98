/* SPDX-License-Identifier: MIT */
/* Points of PH segments by each kernel, for comparison with exact arithmetic. Each line of the input is a segment and
 * an arc length: axis_count, start, x, y, z, the 4 x 3 coefficients of the preimage, component by component, for each
 * extra axis its start and five coefficients, the arc length. An axis_count of 0 ends the input. Each line of the
 * output has the coordinates by the fixed, the float and the double kernel. Run by test_space_kernels.py, which builds
 * it. Reads stdin, writes stdout. */
#include <inttypes.h>
#include <stdio.h>

#include "core/coefficients.h"

static int64_t next(void)
{
    int64_t value = 0;
    return scanf("%" SCNd64, &value) == 1 ? value : 0;
}

static void read_segment(struct program_segment *g)
{
    g->start_q40_mm = next();
    for (int axis = 0; axis < 3; axis++) {
        g->point_q40_mm[axis] = next();
    }
    for (int k = 0; k < 12; k++) {
        g->a_q44[k / 3][k % 3] = next();
    }
    for (uint32_t i = 0; i < program_extra_axes(g->axis_count); i++) {
        g->extra[i].start_q40 = next();
        for (int k = 0; k < 5; k++) {
            g->extra[i].b_q40[k] = next();
        }
    }
}

int main(void)
{
    static struct program_segment g;
    static struct ph_segment ph;
    static struct coefficients_segment record;
    for (g.axis_count = (uint32_t)next(); g.axis_count != 0; g.axis_count = (uint32_t)next()) {
        int64_t position_q40[PROGRAM_AXES];
        read_segment(&g);
        const int64_t arc_length_q40_mm = next();
        ph_segment_expand(&ph, &g);
        for (uint32_t number = 0; number < KERNELS; number++) {
            const struct kernel_path *path = kernel_path(kernel_find(number), g.axis_count);
            path->segment_set(&record.path, &ph);
            path->segment_at(&record.path, position_q40, arc_length_q40_mm);
            for (uint32_t axis = 0; axis < g.axis_count; axis++) {
                printf("%" PRId64 " ", position_q40[axis]);
            }
        }
        printf("\n");
    }
    return 0;
}
