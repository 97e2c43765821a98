/* SPDX-License-Identifier: MIT */
/*
 * Support of the fuzz harnesses. A harness is tests/fuzz/fuzz_NAME.c: it defines LLVMFuzzerTestOneInput, which reads
 * the bytes of an input as a script (what happens next) and aborts where a rule is broken. It is linked twice: with
 * libFuzzer and coverage by clang (`make fuzz`), and with replay.c by the compiler of the tests, which runs the corpus
 * in tests/data/fuzz/NAME. An input must give the same run each time. Used by the harnesses. Any context; no I/O.
 */
#ifndef HODOGRAPH_TESTS_FUZZ_H
#define HODOGRAPH_TESTS_FUZZ_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "can/can_frame.h"

/* The remainder of an input. After its end every byte is 0. */
struct fuzz_input {
    const uint8_t *data;
    size_t size;
    size_t at;
};

bool fuzz_left(const struct fuzz_input *in);
uint8_t fuzz_byte(struct fuzz_input *in);
uint32_t fuzz_number(struct fuzz_input *in, unsigned bytes); /* little-endian, 1 to 4 bytes */
uint64_t fuzz_wide(struct fuzz_input *in);                   /* 8 bytes */
void fuzz_bytes(struct fuzz_input *in, uint8_t *to, size_t size);

/* A frame: length (up to 8) in the low bits of one byte, two bytes of identifier, data. */
void fuzz_frame(struct fuzz_input *in, struct can_msg *frame);

/* Runs the harness on an input; a failed assertion of Unity inside, as those of the fakes, aborts. Returns 0. */
int fuzz_run(void (*harness)(struct fuzz_input *in), const uint8_t *data, size_t size);

/* A rule that has to hold: if it does not, prints it and aborts. */
#define FUZZ_CHECK(rule) ((rule) ? (void)0 : fuzz_broken(#rule, __FILE__, __LINE__))
void fuzz_broken(const char *rule, const char *file, int line) __attribute__((noreturn));

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#endif
