/* SPDX-License-Identifier: MIT */
/* Golden program images of tests/data for the C tests, which run in the root of the repository. Used by tests of
 * firmware/core, streaming, app/controller and port/stm32g4, and by harnesses of tests/fuzz. Reads files. */
#ifndef HODOGRAPH_TESTS_GOLDEN_H
#define HODOGRAPH_TESTS_GOLDEN_H

#include "core/coefficients.h"
#include "core/program_check.h"

/* An image on the heap, exactly as long as the file, so that the sanitizer sees any read beyond it. NULL when
 * there is no such file; the caller frees. */
uint8_t *golden_load(const char *name, uint32_t *size);

/* Writes the CRC that a changed image should have, when it is long enough to have one. */
void golden_seal(uint8_t *image, uint32_t size);

/* Travel as wide as the format, no other limits. */
struct program_limits golden_no_limits(void);

/* Loads and opens; fails the test when that does not work. Free p->image with golden_close. */
void golden_open(struct program *p, const char *name);
void golden_close(struct program *p);

/* A program with coefficient records on the heap. */
struct golden_precomputed {
    struct program program;
    void *records;
};

/* A copy of an opened program, with records for a kernel; ends the process when there is no memory. The image has to
 * stay. Free with golden_discard. */
void golden_precompute(struct golden_precomputed *out, const struct program *p,
                       enum kernel_number kernel);
void golden_discard(struct golden_precomputed *precomputed);

/* Seeded 64-bit generator (splitmix64), for tests with random cases. */
uint64_t golden_random(uint64_t *state);

#endif
