/* SPDX-License-Identifier: MIT */
/* Implements fuzz.h (see there): support of the fuzz harnesses. Part of each fuzz harness. No I/O, except that
 * fuzz_broken writes the broken rule to stderr and aborts the process. */
#include "fuzz.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "unity.h"

/* Of Unity's runner, which only the replay uses. */
void setUp(void)
{
}

void tearDown(void)
{
}

bool fuzz_left(const struct fuzz_input *in)
{
    return in->at < in->size;
}

uint8_t fuzz_byte(struct fuzz_input *in)
{
    return fuzz_left(in) ? in->data[in->at++] : 0u;
}

uint32_t fuzz_number(struct fuzz_input *in, unsigned bytes)
{
    uint32_t number = 0;
    for (unsigned i = 0; i < bytes; ++i) {
        number |= (uint32_t)fuzz_byte(in) << (8u * i);
    }
    return number;
}

uint64_t fuzz_wide(struct fuzz_input *in)
{
    const uint64_t low = fuzz_number(in, 4);
    return low | (uint64_t)fuzz_number(in, 4) << 32;
}

void fuzz_bytes(struct fuzz_input *in, uint8_t *to, size_t size)
{
    for (size_t i = 0; i < size; ++i) {
        to[i] = fuzz_byte(in);
    }
}

void fuzz_frame(struct fuzz_input *in, struct can_msg *frame)
{
    memset(frame, 0, sizeof *frame);
    const uint8_t length = fuzz_byte(in) & 15u;
    frame->len = length < CAN_DATA_MAX ? length : CAN_DATA_MAX;
    frame->id = fuzz_number(in, 2) & CAN_ID_MAX;
    fuzz_bytes(in, frame->data, frame->len);
}

void fuzz_broken(const char *rule, const char *file, int line)
{
    fprintf(stderr, "%s:%d: broken: %s\n", file, line, rule);
    abort();
}

int fuzz_run(void (*harness)(struct fuzz_input *in), const uint8_t *data, size_t size)
{
    struct fuzz_input in = {.data = data, .size = size, .at = 0};
    if (TEST_PROTECT()) {
        harness(&in);
        return 0;
    }
    (void)fflush(stdout); /* Unity has said what failed */
    abort();
}
