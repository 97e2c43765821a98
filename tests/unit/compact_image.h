/* SPDX-License-Identifier: MIT */
/* An image with compact records, made of one without them; docs/reference/protocol.md 1.7.1. Used by chunked.c and
 * test_program.c. Writes only `out`. */
#ifndef TESTS_UNIT_COMPACT_IMAGE_H
#define TESTS_UNIT_COMPACT_IMAGE_H

#include <stdint.h>

/* Writes the compact image to `out`, which has room for as many bytes as `image`, a whole one. Returns its size; 0: a
 * number does not fit. */
uint32_t compact_image(uint8_t *out, const uint8_t *image);

#endif
