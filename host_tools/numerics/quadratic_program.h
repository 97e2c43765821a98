/* SPDX-License-Identifier: MIT */
/*
 * quadratic_program: solves convex quadratic programs along a chain of intervals, for the feed planner:
 * docs/theory/feed.md 5.6. Called by host_tools/hodograph/native. Writes only the caller's arrays; no I/O.
 *
 * Each of n + 1 knots has two unknowns. Every row bounds a linear function of the four unknowns at both ends of one
 * interval, and the objective couples no others:
 *
 *     least  gradient x + x hessian x / 2   where  low <= x <= high,  least <= coefficient x <= most
 *
 * An interior-point method (Mehrotra's predictor and corrector: Wright, Primal-Dual Interior-Point Methods, SIAM 1997,
 * chapter 10). Its equations are condensed to the unknowns: a matrix with the main diagonal and three on each side. So
 * an iteration takes time proportional to the rows.
 *
 * Double arithmetic without contraction: the same bits on every computer. No heap: the caller lends all arrays, and no
 * others are written. Any thread.
 */
#ifndef HODOGRAPH_NUMERICS_QUADRATIC_PROGRAM_H
#define HODOGRAPH_NUMERICS_QUADRATIC_PROGRAM_H

#include <stddef.h>
#include <stdint.h>

enum quadratic_status {
    QUADRATIC_SOLVED = 0,
    QUADRATIC_NEAR = 1,        /* rounding allowed no better: all residuals below 1e-3 */
    QUADRATIC_INFEASIBLE = -1, /* no x is inside all bounds and rows */
    QUADRATIC_STUCK = -2,      /* neither a solution nor a proof of infeasibility found */
};

/* A program; inf and -inf: no bound. Unknowns 2 k and 2 k + 1 belong to knot k.
 *
 * penalty    0: rows are kept. Above 0: the rows of each interval may be exceeded by a share t >= 0 of its own, on
 *            either side, which costs penalty t
 * curvature  above 0, added to the hessian's diagonal and to that of the shares: the solution is unique
 * tolerance  of rows and bounds, of the gradient, and of the objective as a share of itself
 */
struct quadratic_program {
    uint32_t intervals, rows; /* n at least 1, m */
    double penalty, curvature, tolerance;
    const double *gradient;     /* [2 n + 2] */
    const double *hessian;      /* [n][4][4], symmetric, positive semidefinite */
    const double *low, *high;   /* [2 n + 2], low <= high; where they are equal that is the value */
    const double *coefficient;  /* [m][4] */
    const int64_t *interval;    /* [m], 0 to n - 1, in any order */
    const double *least, *most; /* [m] */
};

/* How solving ended. */
struct quadratic_report {
    uint32_t iterations;
    double violated; /* the most by which a row or bound is exceeded */
    double gradient; /* the greatest entry of the residual of the gradient */
    double gap;      /* upper bound of objective less its minimum, as a share of itself or of 1 */
};

/* Numbers that `work` has to hold. */
size_t quadratic_work(uint32_t intervals, uint32_t rows);

/* Solves from a first guess: at the call `unknown` (2 n + 2) has an estimate of the unknowns, or 0. Returns an enum
 * quadratic_status; below 0 the unknowns are not valid. Unknowns, rows and gradient should be scaled to about 1. About
 * 0.03 ms for each iteration and thousand rows; at most 100 iterations, 15 to 30 as a rule. */
int quadratic_solve(const struct quadratic_program *program, double *unknown, double *work,
                    struct quadratic_report *report);

#endif
