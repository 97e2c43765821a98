/* SPDX-License-Identifier: MIT */
/* What the check of the stop table stands on; eva_curve.c and eva_stops.c (docs/theory/proofs.md section 15.5).
 * Included by eva_curve.c and eva_stops.c; never executed, touches nothing. */
#ifndef HODOGRAPH_STOP_CONTRACTS_H
#define HODOGRAPH_STOP_CONTRACTS_H

#include "core/stop_check.h"
#include "qmath_contracts.h"

#define STOP_MOST_RISE ((int64_t)1 << 60)

/*@ requires \initialized(from) && \initialized(&stop->jerk_down) && \initialized(&stop->jerk_up);
    requires \initialized(&stop->deceleration);
    requires from->rising_um <= STOP_MOST_RISE && from->slope_um <= STOP_MOST_RISE;
    assigns \result \from *from, *stop; */
struct stop_bound stop_curve(const struct stop_start *from, const struct program_stop *stop);

#endif
