/* SPDX-License-Identifier: MIT */
/*
 * chunked: a program cut into the chunks of a job, for tests. Each chunk has the pieces of the program from one to its
 * joint, and after them a tail: a quintic to rest at the end of a segment, inside the limits of the program. It has the
 * events of the program on its segments. Used by test_chunk.c, test_stream_cuts.c and fuzz_chunk.c. No I/O.
 */
#ifndef TESTS_UNIT_CHUNKED_H
#define TESTS_UNIT_CHUNKED_H

#include "core/chunk.h"
#include "override_program.h"

#define CHUNKED_TAIL   8u  /* pieces of a tail, at most */
#define CHUNKED_MOST   32u /* chunks of a chain, at most */
#define CHUNKED_EVENTS 64u

/* Where a chunk is cut, in numbers of the whole program. */
struct chunked_cut {
    uint32_t first; /* its first piece, */
    uint32_t
        joint; /* and the first that it does not have; as many as the program has: the last chunk */
    uint32_t segment;  /* its first segment, */
    uint32_t segments; /* and the first that it does not have */
    uint32_t tail_count;
    uint8_t tail[CHUNKED_TAIL][PROGRAM_PIECE_SIZE];
};

/* The program in chunks; free with chunked_close. */
struct chunked {
    const struct override_program *whole; /* with its limits set */
    uint32_t count;
    struct chunked_cut cuts[CHUNKED_MOST];
    uint8_t *bytes[CHUNKED_MOST];
    uint32_t sizes[CHUNKED_MOST];
};

/* The program with pieces of at most this duration, as many as OVERRIDE_PIECES allows: the same motion but for
 * rounding. Its limits are to be set again. */
void chunked_refine(struct override_program *p, double longest_s);

/* The program with so many events of analogue output 0, whose values are their numbers from 1 on: at random places, at
 * both ends, at starts of segments, and some at the same place as the one before. */
void chunked_add_events(struct override_program *p, uint32_t count, uint64_t *random);

/* Cuts with the joints and first pieces given: 1, or 0 where there is no tail inside the limits. */
int chunked_make(struct chunked *out, const struct override_program *whole, const uint32_t firsts[],
                 const uint32_t joints[], uint32_t count);

/* Cuts at random: two chunks at least, where there are tails. 0: there are none. */
int chunked_random(struct chunked *out, const struct override_program *whole, uint64_t *random);

/* Chunk `number` gets compact records. 0: its numbers do not fit them, and it stays. */
int chunked_make_compact(struct chunked *c, uint32_t number);

/* A copy of wide chunks or compact ones, to be closed too. */
void chunked_copy(struct chunked *out, const struct chunked *from);

/* Instead of its later chunks, which have to be wide: the first once more, at rest at the end of the first. */
void chunked_make_rest(struct chunked *c);

void chunked_close(struct chunked *c);

/* Writes the CRCs that a changed chunk should have: of the image, and of the whole. */
void chunked_seal(uint8_t *bytes, uint32_t size);

#endif
