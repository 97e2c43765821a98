/* SPDX-License-Identifier: MIT */
/* Implements port/semihost/semihost.h (see there): semihosting: files, console and exit of an emulated board. Used by
 * port/mps2, port/rv32 and tests/target. Any context; each call waits. Reads and writes files of the computer that
 * emulates the board, and ends the emulator. */
#include "port/semihost/semihost.h"

#include <string.h>

enum {
    SYS_OPEN = 0x01,
    SYS_CLOSE = 0x02,
    SYS_WRITE0 = 0x04,
    SYS_WRITE = 0x05,
    SYS_READ = 0x06,
    SYS_GET_CMDLINE = 0x15,
    SYS_EXIT_EXTENDED = 0x20,
};

#define ADP_STOPPED_APPLICATION_EXIT 0x20026u

/* The argument is a block of words, or the address of a text. */
static intptr_t call(uint32_t operation, const void *argument)
{
#if defined(__riscv)
    register intptr_t a0 __asm__("a0") = (intptr_t)operation;
    register const void *a1 __asm__("a1") = argument;
    __asm__ volatile(".option push\n.option norelax\n.option norvc\n.balign 16\n"
                     "slli zero, zero, 0x1f\nebreak\nsrai zero, zero, 7\n.option pop"
                     : "+r"(a0)
                     : "r"(a1)
                     : "memory");
    return a0;
#else
    register intptr_t r0 __asm__("r0") = (intptr_t)operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
#endif
}

int semihost_open(const char *path, enum semihost_mode mode)
{
    const uintptr_t block[3] = {(uintptr_t)path, (uintptr_t)mode, strlen(path)};
    return (int)call(SYS_OPEN, block);
}

/* Read and write return the number of remaining bytes; a pipe may transfer less than requested. */
static int transfer(uint32_t operation, int handle, uintptr_t data, size_t size)
{
    while (size > 0u) {
        const uintptr_t block[3] = {(uintptr_t)handle, data, size};
        const intptr_t left = call(operation, block);
        if (left < 0 || (size_t)left >= size) {
            return -1;
        }
        data += size - (size_t)left;
        size = (size_t)left;
    }
    return 0;
}

int semihost_read(int handle, void *data, size_t size)
{
    return transfer(SYS_READ, handle, (uintptr_t)data, size);
}

int semihost_read_some(int handle, void *data, size_t size)
{
    const uintptr_t block[3] = {(uintptr_t)handle, (uintptr_t)data, size};
    const intptr_t left = call(SYS_READ, block);
    return left < 0 || (size_t)left >= size ? -1 : (int)(size - (size_t)left);
}

int semihost_write(int handle, const void *data, size_t size)
{
    return transfer(SYS_WRITE, handle, (uintptr_t)data, size);
}

int semihost_close(int handle)
{
    const uintptr_t block[1] = {(uintptr_t)handle};
    return (int)call(SYS_CLOSE, block);
}

int semihost_command_line(char *line, size_t size)
{
    const uintptr_t block[2] = {(uintptr_t)line, size};
    return (int)call(SYS_GET_CMDLINE, block);
}

void semihost_print(const char *text)
{
    (void)call(SYS_WRITE0, text);
}

void semihost_exit(int status)
{
    const uintptr_t block[2] = {ADP_STOPPED_APPLICATION_EXIT, (uintptr_t)status};
    for (;;) {
        (void)call(SYS_EXIT_EXTENDED, block);
    }
}
