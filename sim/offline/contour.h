/* SPDX-License-Identifier: MIT */
/* contour: the contour error, the distance of a point from the exact curve of a program. Used by offline/offline and
 * host_tools/hodograph/native. Changes only its struct and the lent array; no I/O.
 *
 * The curve is that of the program image (docs/reference/protocol.md 1.2), every segment expanded once to powers of its
 * parameter. The foot of the perpendicular is found by Newton steps from the commanded arc length, across segment ends
 * and, on a closed path, across its start; beyond the ends of an open path the end point is the nearest. Only feet
 * within four times the point's distance from the commanded place count. So at a self-crossing the branch that is
 * executed is used. Method and accuracy: docs/theory/drives.md section 14.
 *
 * The error of one point does not depend on earlier points. Double arithmetic and sqrt, the same bits on every IEEE 754
 * target. No heap: the caller lends the array of segments. One thread for each struct contour.
 */
#ifndef HODOGRAPH_OFFLINE_CONTOUR_H
#define HODOGRAPH_OFFLINE_CONTOUR_H

#include <stdbool.h>
#include <stdint.h>

#include "core/program.h"
#include "offline/contour_curve.h"

/* Distance in mm of a point (x, y, z in mm, machine coordinates; in the plane z is ignored) from the curve near the
 * commanded arc length, which is limited to the program. */
double contour_distance_mm(struct contour *contour, double arc_length_mm, const double point_mm[3]);

/* n points in bus counts at once: errors in um. arc_length_q40_mm as the interpolator gives it; act_counts
 * holds `stride` numbers for each point, one for each path axis of the program. Those after z are ignored: the
 * contour is that of the curve. counts_per_unit: per mm, or per degree, by axis. */
void contour_errors_um(struct contour *contour, uint32_t n, const int64_t *arc_length_q40_mm,
                       const int32_t *act_counts, uint32_t stride, const uint32_t *counts_per_unit,
                       double *errors_um);

/* Errors of the extra axes of a program: actual position less exact position at the foot of the perpendicular, n rows
 * of axis_count - 3 differences, in mm or degrees. act_counts holds all path axes of each point, counts_per_unit the
 * counts per mm or degree by axis; *program is that of *contour. */
void contour_extra_errors(struct contour *contour, const struct program *program, uint32_t n,
                          const int64_t *arc_length_q40_mm, const int32_t *act_counts,
                          const uint32_t *counts_per_unit, double *errors);

#endif
