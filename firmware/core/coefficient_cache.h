/* SPDX-License-Identifier: MIT */
/*
 * The coefficient cache: records for the few pieces and segments near the motion, so that chunks need no memory for
 * theirs (docs/theory/numerics.md section 12, "Coefficient cache").
 *
 * The memory has two halves. The motion uses the records in one of them, a window of a program (core/coefficients.h),
 * which never changes while it does. The main loop makes the next window in the other half, further on in the same
 * program or in the next chunk, and the motion goes on with that between two ticks (feed_override_use,
 * feed_override_take_over). So a tick never waits for records, and sees none that is half made. Where the main loop
 * comes too late, the window ends before the motion does: the tick is refused (INTERPOLATOR_ERR_JUMP).
 *
 * Use: coefficient_cache_begin; then in each round feed_override_place, coefficient_cache_prepare, feed_override_use
 * and, where that has given 1, coefficient_cache_used. Main loop only; no heap, no globals.
 */
#ifndef HODOGRAPH_CORE_COEFFICIENT_CACHE_H
#define HODOGRAPH_CORE_COEFFICIENT_CACHE_H

#include <stdint.h>

#include "core/coefficients.h"
#include "core/feed_override.h"

/* records of pieces, and of segments, that a half must have room for */
#define COEFFICIENT_CACHE_LEAST 3u

/* One half. Contents private. */
struct coefficient_half {
    uint8_t *memory;
    const struct program *program; /* NULL: nothing of use in it */
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

/* 1: has room for the records that a motion of a program with so many path axes needs at least. */
int coefficient_cache_fits(const struct coefficient_cache *cache, const struct kernel *kernel,
                           uint32_t axis_count);

/* Records from the start of a program on, for interpolator_begin_window; forgets all others. The cache must fit. Linear
 * in the number of records. */
const struct coefficients_window *coefficient_cache_begin(struct coefficient_cache *cache,
                                                          const struct program *p,
                                                          const struct kernel *kernel);

/* Records of a program for a place in it, in the half that the motion does not use; those that the other one has are
 * copied. NULL: the motion has all that there would be in it, and nothing has been done. Linear in the number of
 * records. */
const struct coefficients_window *coefficient_cache_prepare(struct coefficient_cache *cache,
                                                            const struct program *p,
                                                            const struct feed_place *place);

/* The motion uses what has been prepared: the other half may be overwritten. */
void coefficient_cache_used(struct coefficient_cache *cache);

#endif
