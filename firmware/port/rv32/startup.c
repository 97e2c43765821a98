/* SPDX-License-Identifier: MIT */
/* Implements port/rv32/startup.h (see there): what a RISC-V hart does between reset and main(). Called by the hardware
 * only, at reset and in traps. Writes the variables in RAM before main(); a trap ends the emulator. */
#include "port/rv32/startup.h"

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "port/semihost/semihost.h"

enum { STATUS_TRAP = 3 };

/* From the linker script. */
extern uint32_t startup_data_load[], startup_data_begin[], startup_data_end[];
extern uint32_t startup_bss_begin[], startup_bss_end[];

int main(int argc, char **argv);

/* Stack, global pointer, traps; then the part in C. */
__asm__(".section .text.startup_reset, \"ax\"\n"
        ".global startup_reset\n"
        ".type startup_reset, @function\n"
        "startup_reset:\n"
        ".option push\n"
        ".option norelax\n"
        "la gp, startup_global_pointer\n"
        ".option pop\n"
        "la sp, startup_stack_top\n"
        "la t0, startup_trap\n"
        "csrw mtvec, t0\n"
        "j startup_memory\n"
        ".text\n");

static size_t bytes(const uint32_t *begin, const uint32_t *end)
{
    return (size_t)((uintptr_t)end - (uintptr_t)begin);
}

void startup_memory(void)
{
    memcpy(startup_data_begin, startup_data_load, bytes(startup_data_begin, startup_data_end));
    memset(startup_bss_begin, 0, bytes(startup_bss_begin, startup_bss_end));
    semihost_exit(main(0, NULL));
}

/* mtvec holds addresses of words. */
__attribute__((aligned(4))) void startup_trap(void)
{
    semihost_print("trap\n");
    semihost_exit(STATUS_TRAP);
}
