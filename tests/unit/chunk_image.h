/* SPDX-License-Identifier: MIT */
/*
 * chunk_image: chunks of a job that is small enough to be written by hand: straight along x, from rest to 16 mm/s in
 * 0.5 s (4 mm), then pieces of 1/32 s (0.5 mm) at 16 mm/s. The end of each chunk brakes to rest in 0.5 s (4 mm).
 * Segments of 4 mm. Pieces allow an override of 150 %. Used by test_app_stream.c and test_app_stream_outputs.c. Pure.
 */
#ifndef TESTS_UNIT_CHUNK_IMAGE_H
#define TESTS_UNIT_CHUNK_IMAGE_H

#include <stdint.h>

#include "core/program.h"

#define CHUNK_IMAGE_SIZE_MAX 32768u

/* Pieces are counted through the job: 0 is the one from rest, all others go on at 16 mm/s. */
struct chunk_plan {
    uint32_t previous; /* first piece of the predecessor; not of a first chunk */
    uint32_t from;     /* first piece of this one; 0: of a first chunk, or a second one */
    uint32_t joint;    /* the pieces before this one are shared with the predecessor */
    uint32_t to;       /* the pieces before this one, then the end; 1 more than a multiple of 8 */
    uint32_t flags;    /* CHUNK_FLAG_... */
    uint32_t job;
    uint32_t sequence;
    uint32_t whole_to;   /* `to` of the job, for its remaining time; 0: not known */
    uint32_t rest_ms;    /* with CHUNK_FLAG_REST, whose `from` is 0: dwell before it, */
    uint32_t rest_flags; /* and what kind of stop */
    uint32_t job_mm;     /* where it begins then, in the job */
};

/* Makes the chunk; the path begins at (x_mm, y_mm). Returns its size. */
uint32_t chunk_image_make(uint8_t *bytes, const struct chunk_plan *plan, int32_t x_mm,
                          int32_t y_mm);

/* Adds those of these events that are on the path of the chunk, in their order; places are arc lengths of the job.
 * Returns the new size. */
uint32_t chunk_image_switch(uint8_t *bytes, const struct program_event *events, uint32_t count);

/* Puts the right CRCs into a chunk that was changed. */
void chunk_image_seal(uint8_t *bytes);

#endif
