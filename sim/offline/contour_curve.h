/* SPDX-License-Identifier: MIT */
/* contour_curve: the exact curve of a program: expands it once, and finds places on it near a point. Called by
 * offline/contour, offline/offline and host tools. All functions except contour_begin are pure. One thread for each
 * struct contour. */
#ifndef HODOGRAPH_OFFLINE_CONTOUR_CURVE_H
#define HODOGRAPH_OFFLINE_CONTOUR_CURVE_H

#include <stdbool.h>
#include <stdint.h>

#include "core/program.h"

/* One segment: position - origin = sum of r[k] xi^(k+1), k = 0 ... 4. Private to contour and contour_curve. */
struct contour_segment {
    double start_mm;
    double length_mm;
    double per_length;   /* 1 / length */
    double slope[2];     /* d(xi)/d(s / length) at both ends */
    double end_speed[2]; /* d(s)/d(xi) at both ends */
    double origin[3];
    double r[5][3];
};

struct contour {
    const struct contour_segment *segments;
    uint32_t count;
    uint32_t cursor; /* segment of the last commanded arc length: only to search faster */
    double length_mm;
    uint32_t axes; /* of the curve: 2, or 3 in space */
    bool closed;
};

/* A place on the curve. */
struct place {
    uint32_t segment;
    double xi;
};

/* The curve at a place, relative to a point: offset = point - curve, and the first two derivatives of the curve. */
struct view {
    double offset[3];
    double first[3];
    double second[3];
};

static inline double contour_q40(int64_t q40)
{
    return (double)q40 * (1.0 / 1099511627776.0);
}

/* In the plane the third components are 0 and change no bit. */
static inline double contour_dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Expands a checked program into segments[program->header.segment_count], which must outlive
 * *contour. */
void contour_begin(struct contour *contour, const struct program *program,
                   struct contour_segment *segments);

/* Brings an arc length into the program: modulo the length on a closed path, else clamped. */
double contour_wrap(const struct contour *c, double arc_length_mm);

/* The approximate place of an arc length within the program, as a first guess. `hint` is the segment that is searched
 * first. */
struct place contour_place(const struct contour *c, uint32_t hint, double arc_length_mm);

/* Fills the curve at a place, relative to a point. */
void contour_view(const struct contour *c, struct place place, const double point[3],
                  struct view *v);

/* Distance of a point from a place. */
double contour_gap(const struct contour *c, struct place place, const double point[3]);

/* Moves a place with a parameter outside [0, 1] to the adjacent segment, also over the start of a closed path. False at
 * the end of an open path: xi is limited. */
bool contour_cross(const struct contour *c, struct place *p);

#endif
