/* SPDX-License-Identifier: MIT */
/*
 * app_image: a program small enough to be written by hand: straight along x, 4 mm in 0.5 s, with F = 4 (10 tau^3 - 15
 * tau^4 + 6 tau^5) mm. 501 setpoints at 1 ms; peaks 15 mm/s, 92.4 mm/s^2, 1920 mm/s^3. A hold brakes with 91 mm/s^2, a
 * fault stop with 181. Used by the tests of firmware/app and by harnesses of tests/fuzz. The functions write the
 * caller's image only. No I/O.
 */
#ifndef TESTS_UNIT_APP_IMAGE_H
#define TESTS_UNIT_APP_IMAGE_H

#include <stdint.h>

#define APP_IMAGE_SIZE  304u
#define APP_IMAGE_TICKS 501u

/* Fills the image of a move from (x_mm, y_mm) to (x_mm + 4, y_mm). */
void app_image_make(uint8_t image[APP_IMAGE_SIZE], int32_t x_mm, int32_t y_mm);

/* Puts the right CRC into an image that was changed. */
void app_image_seal(uint8_t image[APP_IMAGE_SIZE]);

#endif
