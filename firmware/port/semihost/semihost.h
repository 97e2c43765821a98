/* SPDX-License-Identifier: MIT */
/*
 * Semihosting: the emulator (or a debugger) does a file operation for the program and the clock of the guest stands
 * still meanwhile. Arm IHI 0100 (Semihosting for AArch32 and AArch64); RISC-V uses the same numbers.
 *
 * On hardware without a debugger the first call is a fault. Any context; each call waits.
 */
#ifndef PORT_SEMIHOST_SEMIHOST_H
#define PORT_SEMIHOST_SEMIHOST_H

#include <stddef.h>
#include <stdint.h>

enum semihost_mode { /* fopen's, always binary */
                     SEMIHOST_READ = 1,
                     SEMIHOST_WRITE = 5,
};

/* Returns a handle, or a negative number when the host cannot open it. */
int semihost_open(const char *path, enum semihost_mode mode);

/* All of it, however many operations that takes. 0, or -1 when the file ends or fails first. */
int semihost_read(int handle, void *data, size_t size);
int semihost_write(int handle, const void *data, size_t size);

/* What is there, at least one byte: it waits for that. Returns how many bytes, or -1 when the file has ended or
 * failed. */
int semihost_read_some(int handle, void *data, size_t size);

/* Closes it. 0, or -1 when the host could not write what was left. */
int semihost_close(int handle);

/* The words that the emulator was given to hand on, joined by blanks. 0, or -1 when there are none or they do not
 * fit. */
int semihost_command_line(char *line, size_t size);

/* Text for the host's console. */
void semihost_print(const char *text);

/* Ends the emulator with this exit status. Does not return. */
void semihost_exit(int status);

#endif
