/* SPDX-License-Identifier: MIT */
/*
 * stop_path: the path of a program as a table: rows of its curve at places close to each other. The search of stop
 * parameters follows many path stops along it. Used by offline/stop_search, offline/stop_usage, the other files of this
 * search and host tools.
 *
 * Rows: STOP_ROWS for each segment, ascending in arc length, with tangent and curvature (planar programs) or the first
 * three derivatives of all axes by arc length (spatial ones), and the greatest feed there. Groups of 4, 16, 64, ...
 * rows have the greatest magnitudes of their rows, so that bounds of a long stretch cost a logarithm of its length.
 *
 * stop_rows() fills the table once. stop_lookup_open() makes the struct that the look-ups use; each thread needs its
 * own. mm, s. No heap: the caller lends all arrays. Any thread of a host; the functions change their arguments only.
 */
#ifndef HODOGRAPH_OFFLINE_STOP_PATH_H
#define HODOGRAPH_OFFLINE_STOP_PATH_H

#include <stdint.h>

#include "core/program.h"
#include "offline/stop_limits.h"

#define STOP_ROWS        33u /* of the path, for each segment */
#define STOP_MOST_LEVELS 16

/* The path at an arc length, ascending; two rows with one arc length where segments meet. */
struct stop_row {
    double s_mm;
    double tangent[2]; /* of a planar program */
    double curvature;  /* 1/mm; of a spatial program without sign */
    double slope; /* of the curvature, 1/mm^2; in space the third derivative across the tangent */
    double feed_mm_s; /* greatest feed here: feed zones and centripetal acceleration */
};

/* How the axes of a spatial program move there: first to third derivative by arc length. */
struct stop_bend {
    double by_mm[3][PROGRAM_AXES];
};

/* The greatest magnitudes on a stretch of the path, and its least feed. */
struct stop_stretch {
    double curvature;
    double slope;
    double tangent[2];
    double feed_mm_s;
    uint32_t bent, bending; /* rows with this curvature, and with this slope */
    struct stop_bend bend;
};

/* The path of a program: segment_count * STOP_ROWS rows and bends. */
struct stop_path {
    struct stop_row *rows;
    struct stop_bend *bends; /* of a spatial program; not used for a planar one */
    /* stop_groups() of 4, 16, 64, ... rows: bounds of a long stretch are quick */
    struct stop_stretch *groups;
};

/* What look-ups found last. The next ones begin with it, because they are near: only their time depends on it. */
struct stop_last {
    uint32_t row; /* after the stretch */
    /* of a stretch whose bounds exceeded a limit: rows of greatest slope and curvature; 0: none */
    uint32_t sharp[2];
};

/* The same with what look-ups need; borrows the path. */
struct stop_lookup {
    uint32_t axis_count;
    uint32_t row_count;
    const struct stop_row *rows;
    const struct stop_bend *bends;                      /* of a spatial program */
    const struct stop_stretch *group[STOP_MOST_LEVELS]; /* of 4, 16, ... rows, at each level */
    int levels;
    struct stop_last *last; /* changed by look-ups */
};

/* Number of groups of rows of a program: the length of stop_path.groups. */
uint32_t stop_groups(uint32_t segment_count);

/* Fills the path; the program has passed program_open. */
void stop_rows(const struct program *p, const struct stop_limits *limits,
               const struct stop_path *path);

/* Fills *lookup for a path that stop_rows() has filled. */
void stop_lookup_open(struct stop_lookup *lookup, const struct program *p,
                      const struct stop_path *path, struct stop_last *last);

/* The last row at or before an arc length. */
uint32_t stop_row_at(const struct stop_lookup *lookup, double s);

/* Raises `row` to the last row at or before an arc length. */
void stop_pass_rows(const struct stop_lookup *lookup, double s, uint32_t *row);

/* Fills the bounds of a single row, */
void stop_stretch_of_row(const struct stop_lookup *lookup, uint32_t row,
                         struct stop_stretch *stretch);

/* and those of the path from a row up to an arc length. */
void stop_stretch_from(const struct stop_lookup *lookup, uint32_t row, double to_mm,
                       struct stop_stretch *stretch);

/* --- Small numbers, inline: the innermost loops --- */

static inline double stop_greater(double a, double b)
{
    return a > b ? a : b;
}

static inline double stop_lesser(double a, double b)
{
    return a < b ? a : b;
}

static inline double stop_between(double a, double b, double share)
{
    return a + (b - a) * share;
}

#endif
