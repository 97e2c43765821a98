/* SPDX-License-Identifier: MIT */
/*
 * What follows from the rules of protocol.md 1.2 for the size of the preimage, rounded up: docs/theory/numerics.md
 * section 15.1. cbmc_speed.c shows that check_speed lets nothing else through in a planar program; in a spatial one no
 * component has more than 48 bits, which is less. Included by cbmc_speed.c, eva_interpolator.c, eva_product.c and
 * eva_segment.c; never executed, touches nothing.
 */
#ifndef HODOGRAPH_SEGMENT_BOUNDS_H
#define HODOGRAPH_SEGMENT_BOUNDS_H

#include "core/program.h"

#define W_MOST_Q44  (((int64_t)1 << 50) - 1) /* 64 */
#define END_MOST    ((int64_t)129 << 40)     /* 8.0625: components of A0 and A2 in q44 */
#define MIDDLE_MOST ((int64_t)51 << 42)      /* 12.75: of A1 */
#define POINT_MOST  ((int64_t)1 << 52)       /* below this */

/* clang-format off */
/*@ predicate component_in_range(struct program_segment *g, integer c) =
      -W_MOST_Q44 <= g->a_q44[c][0] <= W_MOST_Q44 && -W_MOST_Q44 <= g->a_q44[c][1] <= W_MOST_Q44 &&
      -W_MOST_Q44 <= g->a_q44[c][2] <= W_MOST_Q44;
    predicate component_is_bounded(struct program_segment *g, integer c) =
      -END_MOST <= g->a_q44[c][0] <= END_MOST && -MIDDLE_MOST <= g->a_q44[c][1] <= MIDDLE_MOST &&
      -END_MOST <= g->a_q44[c][2] <= END_MOST;
    predicate in_range(struct program_segment *g) =
      component_in_range(g, PROGRAM_U) && component_in_range(g, PROGRAM_V) &&
      component_in_range(g, PROGRAM_P) && component_in_range(g, PROGRAM_Q);
    predicate is_bounded(struct program_segment *g) =
      component_is_bounded(g, PROGRAM_U) && component_is_bounded(g, PROGRAM_V) &&
      component_is_bounded(g, PROGRAM_P) && component_is_bounded(g, PROGRAM_Q);
    predicate point_in_range(struct program_segment *g) =
      -POINT_MOST < g->point_q40_mm[0] < POINT_MOST && -POINT_MOST < g->point_q40_mm[1] < POINT_MOST &&
      -POINT_MOST < g->point_q40_mm[2] < POINT_MOST;
*/
/* clang-format on */

#endif
