/* SPDX-License-Identifier: MIT */
/*
 * What follows from the rules of protocol.md 1.2 for the size of w, rounded up: docs/theory/numerics.md section 15.1.
 * cbmc_speed.c shows that check_speed lets nothing else through.
 */
#ifndef HODOGRAPH_SEGMENT_BOUNDS_H
#define HODOGRAPH_SEGMENT_BOUNDS_H

#include "core/program.h"

#define W_MOST_Q44  (((int64_t)1 << 50) - 1) /* 64 */
#define END_MOST    ((int64_t)129 << 40)     /* 8.0625: u, v of w0 and w2 in q44 */
#define MIDDLE_MOST ((int64_t)51 << 42)      /* 12.75: of w1 */

/* clang-format off */
/*@ predicate in_range(struct program_segment *g) =
      \forall integer k; 0 <= k < 3 ==> -W_MOST_Q44 <= g->u_q44[k] <= W_MOST_Q44 && -W_MOST_Q44 <= g->v_q44[k] <= W_MOST_Q44;
    predicate is_bounded(struct program_segment *g) =
      -END_MOST <= g->u_q44[0] <= END_MOST && -END_MOST <= g->v_q44[0] <= END_MOST &&
      -END_MOST <= g->u_q44[2] <= END_MOST && -END_MOST <= g->v_q44[2] <= END_MOST &&
      -MIDDLE_MOST <= g->u_q44[1] <= MIDDLE_MOST && -MIDDLE_MOST <= g->v_q44[1] <= MIDDLE_MOST;
*/
/* clang-format on */

#endif
