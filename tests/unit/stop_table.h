/* SPDX-License-Identifier: MIT */
/* stop_table: the stop table of a program image that a test has made, with the bounds that core/stop_check requires.
 * Used by app_image.c, chunk_image.c, chunked.c and override_program.c of this folder. Changes the image and the header
 * of the opened program; no I/O. */
#ifndef TESTS_UNIT_STOP_TABLE_H
#define TESTS_UNIT_STOP_TABLE_H

#include "core/program.h"

/* The same six codes (hold: jerk, deceleration, jerk; then fault) for all pieces of a program that is right but for its
 * table; bounds, and the longest of them in the header. */
void stop_table_fill(struct program *p, uint8_t *image, const uint8_t codes[6]);

/* The same of the bytes alone, and the CRC. Fails the test when they do not open. */
void stop_table_write(uint8_t *image, uint32_t size, const uint8_t codes[6]);

#endif
