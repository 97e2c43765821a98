/* SPDX-License-Identifier: MIT */
/* Prints the setpoints of a program, a line for each period, over and over. For boards with 32-bit processors. program.h
 * holds the image; `hodograph compile` makes others, `xxd -i` writes them as C. Compiled by the Arduino IDE, and
 * by tests/tools/test_library.py. Writes to the serial port only; no drives. */
#include <hodograph.h>

#include "program.h"

static uint64_t records[2048];
static struct program program;
static struct interpolator interpolator;
static struct feed_override feed;
static uint32_t next_us;

static int load()
{
    struct program_limits limits = {};
    struct program_fault fault = {};
    for (int axis = 0; axis < (int)PROGRAM_AXES; axis++) {
        limits.min_q40_mm[axis] = -((int64_t)4096 << 40);
        limits.max_q40_mm[axis] = (int64_t)4096 << 40;
    }
    int error = program_open(&program, program_image, sizeof program_image);
    if (error == 0) {
        error = program_check(&program, &limits, &fault);
    }
    if (error == 0) {
        error = coefficients_make_in(&program, kernel_find(KERNEL_FIXED), records, sizeof records);
    }
    if (error == 0) {
        error = interpolator_begin(&interpolator, &program);
    }
    if (error == 0) {
        feed_override_begin(&feed, &program, program.header.period_us, 0);
    }
    return error;
}

void setup()
{
    Serial.begin(115200);
    const int error = load();
    while (error != 0) {
        Serial.println(program_error_text(error));
        delay(1000);
    }
    next_us = micros();
}

void loop()
{
    struct interpolator_point point;
    while ((int32_t)(micros() - next_us) < 0) {
    }
    next_us += program.header.period_us;
    if (feed_override_next(&feed, &interpolator, &point) != 0) {
        return;
    }
    Serial.print(counts_from_q40_mm(point.position_q40[0], 1000000));
    Serial.print(' ');
    Serial.println(counts_from_q40_mm(point.position_q40[1], 1000000));
    if (feed_override_state(&feed) == FEED_ENDED) {
        feed_override_begin(&feed, &program, program.header.period_us, 0);
        interpolator_begin(&interpolator, &program);
    }
}
