/* SPDX-License-Identifier: MIT */
/*
 * The proof of the stops of a program (core/brake_check.h), to count what it costs: piece by piece, hold and fault
 * stop, with the stop parameters that the program has. Exit status 0, whether or not they are proved. Run on an
 * emulated board by `make bench` (tools/analysis/checking.py); reads the store.
 */
#include <stdint.h>

#include "checked.h"
#include "core/brake_check.h"

enum { STATUS_FILE = 5 };

int main(void)
{
    const struct program_limits limits = checked_limits();
    struct program program;
    struct brake_check check;
    if (checked_open(&program) != 0) {
        return STATUS_FILE;
    }
    brake_check_begin(&check, &program, &limits);
    for (uint32_t piece = 0; piece < program.header.piece_count; piece++) {
        for (int kind = PROGRAM_STOP_HOLD; kind <= PROGRAM_STOP_FAULT; kind++) {
            struct program_stop stop;
            program_stop_get(&program, piece, (enum program_stop_kind)kind, &stop);
            (void)brake_check_piece(&check, piece, (enum program_stop_kind)kind, &stop);
        }
    }
    return 0;
}
