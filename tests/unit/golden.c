/* SPDX-License-Identifier: MIT */
/* Implements golden.h (see there): golden program images of tests/data for the C tests, which run in the root of the
 * repository. Part of the C tests; reads files of tests/data. */
#include "golden.h"

#include <stdio.h>
#include <stdlib.h>

#include "core/crc32.h"
#include "unity.h"

uint8_t *golden_load(const char *name, uint32_t *size)
{
    char path[256];
    snprintf(path, sizeof path, "tests/data/programs/%s", name);
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        return NULL;
    }
    fseek(file, 0, SEEK_END);
    long length = ftell(file);
    rewind(file);
    uint8_t *image = malloc(length > 0 ? (size_t)length : 1u);
    *size = (uint32_t)fread(image, 1, (size_t)length, file);
    fclose(file);
    return image;
}

void golden_seal(uint8_t *image, uint32_t size)
{
    if (size >= 16) {
        uint32_t crc = crc32_update(0, image + 16, size - 16);
        for (int i = 0; i < 4; i++) {
            image[12 + i] = (uint8_t)(crc >> (8 * i));
        }
    }
}

struct program_limits golden_no_limits(void)
{
    const int64_t far = (int64_t)1 << 52;
    struct program_limits limits = {.axis_count = 0};
    for (uint32_t axis = 0; axis < PROGRAM_AXES; axis++) {
        limits.min_q40_mm[axis] = -far;
        limits.max_q40_mm[axis] = far;
    }
    return limits;
}

void golden_open(struct program *p, const char *name)
{
    uint32_t size = 0;
    uint8_t *image = golden_load(name, &size);
    TEST_ASSERT_NOT_NULL_MESSAGE(image, name);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, program_open(p, image, size), name);
}

void golden_close(struct program *p)
{
    free((void *)(uintptr_t)p->image);
    p->image = NULL;
}

void golden_precompute(struct golden_precomputed *out, const struct program *p,
                       enum kernel_number kernel)
{
    const struct kernel *made_for = kernel_find((uint32_t)kernel);
    const uint64_t size = coefficients_size(p, made_for);
    out->program = *p;
    out->records = malloc((size_t)size);
    if (out->records == NULL ||
        coefficients_make_in(&out->program, made_for, out->records, size) != 0) {
        abort();
    }
}

void golden_discard(struct golden_precomputed *precomputed)
{
    free(precomputed->records);
    precomputed->records = NULL;
}

uint64_t golden_random(uint64_t *state)
{
    uint64_t z = *state += 0x9E3779B97F4A7C15u;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}
