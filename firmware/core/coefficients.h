/* SPDX-License-Identifier: MIT */
/*
 * A program made ready for one kernel: records that the tick reads where they are, so that it expands nothing when it
 * crosses the end of a segment or of a piece (docs/theory/numerics.md section 12, "Precomputed coefficients").
 *
 * The records are made by the controller itself from a program that has passed program_check; they are never uploaded.
 * Layout: those of the pieces, then those of the segments, each of one size. They hold native structs: for the binary
 * that made them and no other. Any context but where it says otherwise.
 */
#ifndef HODOGRAPH_CORE_COEFFICIENTS_H
#define HODOGRAPH_CORE_COEFFICIENTS_H

#include <stddef.h>
#include <stdint.h>

#include "core/feed_piece.h"
#include "core/kernel.h"
#include "core/kernel_double.h"
#include "core/kernel_fixed.h"
#include "core/kernel_float.h"
#include "core/override_ramp.h"
#include "core/program.h"

#define COEFFICIENTS_ALIGNMENT 8u /* of the first record */

#define COEFFICIENTS_ERR_SIZE (-1) /* the memory is too small */

/* A record ends behind the kernel's own part. */
struct coefficients_piece {
    uint64_t start_q42_s;
    uint64_t end_q42_s;                              /* of the last piece the duration */
    struct program_override ahead[OVERRIDE_WINDOWS]; /* of the windows that begin with it */
    union {
        struct feed_piece integers;
        struct kernel_double_piece doubles;
    } feed;
};

struct coefficients_segment {
    int64_t from_q40_mm; /* arc lengths that belong to it: from here, INT64_MIN in the first, */
    int64_t to_q40_mm;   /* to below here, INT64_MAX in the last */
    union {
        struct kernel_fixed_segment fixed;
        struct kernel_float_segment floats;
        struct kernel_double_segment doubles;
        struct kernel_fixed_space fixed_space;
        struct kernel_float_space floats_space;
        struct kernel_double_space doubles_space;
    } path;
};

/* Bytes of a record. */
static inline uint32_t coefficients_piece_size(const struct kernel *kernel)
{
    return (uint32_t)(offsetof(struct coefficients_piece, feed) + kernel->piece_size);
}

static inline uint32_t coefficients_segment_size(const struct kernel *kernel, uint32_t axis_count)
{
    const struct kernel_path *path = kernel_path(kernel, axis_count);
    return (uint32_t)(offsetof(struct coefficients_segment, path) + path->segment_size +
                      path->extra_size * program_extra_axes(axis_count));
}

/* Bytes of all records of a program; may be above 2^32. */
uint64_t coefficients_size(const struct program *p, const struct kernel *kernel);

/* Takes the next bytes of the records; 0 or a negative error. */
typedef int coefficients_sink(void *context, const uint8_t *bytes, uint32_t size);

/* Makes all records, in order. Gives the sink's first error, or 0. Main loop; linear. */
int coefficients_make(const struct program *p, const struct kernel *kernel, coefficients_sink *sink,
                      void *context);

/* From now on the program has these records, which must stay; aligned to COEFFICIENTS_ALIGNMENT. */
void coefficients_attach(struct program *p, const struct kernel *kernel, const uint8_t *records);

/* Makes all records in this memory, aligned to COEFFICIENTS_ALIGNMENT, and attaches them. Returns 0, or
 * COEFFICIENTS_ERR_SIZE where `size` is below coefficients_size. Main loop; linear. */
int coefficients_make_in(struct program *p, const struct kernel *kernel, void *memory,
                         uint64_t size);

/* A record of a program that has them for this kernel. */
static inline const struct coefficients_piece *
coefficients_piece_at(const struct program *p, const struct kernel *kernel, uint32_t i)
{
    const void *at = p->coefficients + (size_t)i * coefficients_piece_size(kernel);
    return (const struct coefficients_piece *)at; /* C++ wants the cast */
}

static inline const struct coefficients_segment *
coefficients_segment_at(const struct program *p, const struct kernel *kernel, uint32_t i)
{
    const void *at = p->coefficients +
                     (size_t)p->header.piece_count * coefficients_piece_size(kernel) +
                     (size_t)i * coefficients_segment_size(kernel, p->header.axis_count);
    return (const struct coefficients_segment *)at;
}

/* The piece behind one that is not the last. */
static inline const struct coefficients_piece *
coefficients_piece_next(const struct coefficients_piece *piece, const struct kernel *kernel)
{
    const void *at = (const uint8_t *)piece + coefficients_piece_size(kernel);
    return (const struct coefficients_piece *)at;
}

#endif
