/* SPDX-License-Identifier: MIT */
/* Implements compact_image.h (see there): images with compact records, written field by field. Part of the C tests;
 * no I/O. */
#include "compact_image.h"

#include <string.h>

#include "canopen/cob.h"
#include "core/program.h"
#include "golden.h"

/* Reads fields of one width and writes the same of another; `fits`: no number has been cut. */
struct copy {
    const uint8_t *from;
    uint8_t *to;
    int fits;
};

static void take(struct copy *c, uint32_t count, uint32_t bytes, uint32_t fewer, int is_signed)
{
    for (uint32_t i = 0; i < count; i++) {
        const uint8_t rest = is_signed && (c->from[fewer - 1u] & 0x80u) != 0u ? 0xFFu : 0u;
        for (uint32_t k = fewer; k < bytes; k++) {
            c->fits = c->fits && c->from[k] == rest;
        }
        memcpy(c->to, c->from, fewer);
        c->from += bytes;
        c->to += fewer;
    }
}

static void numbers(struct copy *c, uint32_t count, uint32_t bytes, uint32_t fewer)
{
    take(c, count, bytes, fewer, 1);
}

static void times(struct copy *c, uint32_t count, uint32_t bytes, uint32_t fewer)
{
    take(c, count, bytes, fewer, 0);
}

static void segment(struct copy *c, uint32_t axes)
{
    const uint32_t curve_axes = program_curve_axes(axes);
    numbers(c, 1u + curve_axes, 8, 7);
    if (axes == PROGRAM_PLANE) {
        numbers(c, 6, 8, 6);
    } else {
        numbers(c, 12, 6, 6);
    }
    for (uint32_t i = 0; i < program_extra_axes(axes); i++) {
        numbers(c, 1, 8, 7);
        numbers(c, 5, 6, 6);
    }
}

static void piece(struct copy *c)
{
    times(c, 1, 8, 4);
    numbers(c, 1, 8, 7);
    numbers(c, 7, 8, 6);
    numbers(c, 1, 16, 16);
}

static void stop(struct copy *c)
{
    times(c, 1, 8, 6);
    times(c, 2, 4, 3);
}

uint32_t compact_image(uint8_t *out, const uint8_t *image)
{
    const uint32_t header = (uint32_t)cob_get(image + 6, 2);
    const uint32_t pieces = (uint32_t)cob_get(image + 24, 4);
    struct copy c = {image, out, 1};
    numbers(&c, 1, header, header);
    for (uint32_t i = 0; i < (uint32_t)cob_get(image + 20, 4); i++) {
        segment(&c, (uint32_t)cob_get(image + 30, 2));
    }
    for (uint32_t i = 0; i < pieces; i++) {
        piece(&c);
    }
    for (uint32_t i = 0; i < pieces; i++) {
        stop(&c);
    }
    numbers(&c, (uint32_t)cob_get(image + 76, 4), PROGRAM_EVENT_SIZE, PROGRAM_EVENT_SIZE);
    const uint32_t size = (uint32_t)(c.to - out);
    cob_put(out + 8, size, 4);
    cob_put(out + 28, cob_get(image + 28, 2) | PROGRAM_FLAG_COMPACT, 2);
    golden_seal(out, size);
    return c.fits ? size : 0u;
}
