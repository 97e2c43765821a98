/* SPDX-License-Identifier: MIT */
/*
 * coefficient_cache: coefficient records of the few pieces and segments near the motion, so that the chunks of a job
 * need no memory for all their records (docs/theory/numerics.md section 12, "Coefficient cache"). Used by
 * app/chunk_records and sim/offline/stream. Changes only its struct and its memory; no I/O.
 *
 * The memory has two halves. The motion uses the records in one of them, a window of a program (core/coefficients.h).
 * They do not change while it does. The main loop makes the next window in the other half, further on in the same
 * program or in the next chunk. Between two ticks the motion changes to that half (feed_override_use,
 * feed_override_take_over). So a tick never waits for records, and every record that it reads is complete. If the main
 * loop is too late, the motion reaches the end of the window, and the tick fails (INTERPOLATOR_ERR_JUMP).
 *
 * Use: coefficient_cache_begin; then in each round feed_override_place, coefficient_cache_prepare, feed_override_use
 * and, where that has given 1, coefficient_cache_used. Main loop only; no heap, no globals.
 */
#ifndef HODOGRAPH_CORE_COEFFICIENT_CACHE_H
#define HODOGRAPH_CORE_COEFFICIENT_CACHE_H

#include <stdint.h>

#include "core/coefficients.h"
#include "core/feed_override.h"

/* A half must have room for so many records of pieces, and of segments. */
#define COEFFICIENT_CACHE_LEAST 3u

/* One half. Contents private. */
struct coefficient_half {
    uint8_t *memory;
    const struct program *program; /* NULL: no records in it */
    struct coefficients_window window;
};

/* Contents private. */
struct coefficient_cache {
    uint32_t size; /* of a half */
    uint32_t used; /* number of the half that the motion uses */
    struct coefficient_half half[2];
};

/* Memory of `size` bytes, aligned to COEFFICIENTS_ALIGNMENT. */
void coefficient_cache_init(struct coefficient_cache *cache, uint8_t *memory, uint32_t size);

/* 1: it has room for the least number of records that a program with so many path axes needs. */
int coefficient_cache_fits(const struct coefficient_cache *cache, const struct kernel *kernel,
                           uint32_t axis_count);

/* Records from the start of a program on, for interpolator_begin_window; forgets all others. The cache must fit. Linear
 * in the number of records. */
const struct coefficients_window *coefficient_cache_begin(struct coefficient_cache *cache,
                                                          const struct program *p,
                                                          const struct kernel *kernel);

/* Makes records of a program for a place in it, in the half that the motion does not use. Records that the other half
 * has are copied. NULL: the motion has all these records already, and nothing has been done. Linear in the number of
 * records. */
const struct coefficients_window *coefficient_cache_prepare(struct coefficient_cache *cache,
                                                            const struct program *p,
                                                            const struct feed_place *place);

/* The motion uses the prepared half: the other half may be overwritten. */
void coefficient_cache_used(struct coefficient_cache *cache);

#endif
