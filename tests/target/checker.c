/* SPDX-License-Identifier: MIT */
/* An image that checks the program in the store, to count what the check costs. Exit status 0: accepted. Run on an
 * emulated board by `make bench` (tools/analysis/checking.py); reads the store. */
#include "checked.h"

enum { STATUS_REFUSED = 1, STATUS_FILE = 5 };

int main(void)
{
    const struct program_limits limits = checked_limits();
    struct program program;
    struct program_fault fault;
    if (checked_open(&program) != 0) {
        return STATUS_FILE;
    }
    return program_check(&program, &limits, &fault) == 0 ? 0 : STATUS_REFUSED;
}
