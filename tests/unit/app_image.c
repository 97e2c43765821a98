/* SPDX-License-Identifier: MIT */
/* Implements app_image.h (see there): a program small enough to be written by hand. Used by the tests of firmware/app
 * and by harnesses of tests/fuzz. The functions write the caller's image only. No I/O. */
#include "app_image.h"

#include <string.h>

#include "canopen/cob.h"
#include "core/crc32.h"
#include "core/program.h"
#include "stop_table.h"

#define Q32 (INT64_C(1) << 32)
#define Q40 (INT64_C(1) << 40)
#define Q44 (INT64_C(1) << 44)

static void put_i64(uint8_t *at, int64_t value)
{
    cob_put(at, (uint64_t)value, 8);
}

static void put_segment(uint8_t *at, int32_t x_mm, int32_t y_mm)
{
    put_i64(at, 0);
    put_i64(at + 8, x_mm * Q40);
    put_i64(at + 16, y_mm * Q40);
    for (uint32_t k = 0; k < 3; ++k) {
        put_i64(at + 24 + 16u * k, 2 * Q44); /* w = 2: 4 mm */
    }
}

static void put_piece(uint8_t *at)
{
    put_i64(at, Q32 / 2);
    put_i64(at + 32, 40 * Q40);
    put_i64(at + 40, -60 * Q40);
    put_i64(at + 48, 24 * Q40);
    cob_put(at + 72, 1u << 14, 2);
    memset(at + 74, 152, PROGRAM_LEVELS); /* 8 /s */
    memset(at + 81, 125, PROGRAM_LEVELS); /* 198 /s^2 */
}

void app_image_seal(uint8_t image[APP_IMAGE_SIZE])
{
    cob_put(image + 12, crc32_update(0, image + 16, APP_IMAGE_SIZE - 16u), 4);
}

void app_image_make(uint8_t image[APP_IMAGE_SIZE], int32_t x_mm, int32_t y_mm)
{
    static const uint8_t stops[6] = {102, 116, 102, 118, 124, 118};
    memset(image, 0, APP_IMAGE_SIZE);
    memcpy(image, "HDGP", 4);
    cob_put(image + 4, 2, 2);
    cob_put(image + 6, 128, 2);
    cob_put(image + 8, APP_IMAGE_SIZE, 4);
    cob_put(image + 16, 1000, 4);
    cob_put(image + 20, 1, 4);
    cob_put(image + 24, 1, 4);
    cob_put(image + 30, 2, 2);
    put_i64(image + 32, Q32 / 2);
    put_i64(image + 40, 4 * Q40);
    put_segment(image + 128, x_mm, y_mm);
    put_piece(image + 200);
    stop_table_write(image, APP_IMAGE_SIZE, stops);
}
