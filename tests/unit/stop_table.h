/* SPDX-License-Identifier: MIT */
/* stop_table: the stop table of an image that a test has made, with the bounds that the check wants. */
#ifndef TESTS_UNIT_STOP_TABLE_H
#define TESTS_UNIT_STOP_TABLE_H

#include <stdint.h>

/* The same six codes (hold: jerk, deceleration, jerk; then fault) for all pieces of an image that is right but for its
 * table; bounds, the longest of them in the header, CRC. Fails the test when the image does not open. */
void stop_table_write(uint8_t *image, uint32_t size, const uint8_t codes[6]);

#endif
