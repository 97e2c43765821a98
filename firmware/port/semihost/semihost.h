/* SPDX-License-Identifier: MIT */
/*
 * semihost: file operations, console and exit by semihosting: the emulator (or a debugger) executes them for the
 * program while the clock of the guest is stopped. Arm IHI 0100 (Semihosting for AArch32 and AArch64); RISC-V uses the
 * same numbers. Used by port/mps2, port/rv32 and tests/target. Reads and writes files of the computer that emulates the
 * board, and ends the emulator.
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

/* Reads or writes all bytes, in as many operations as necessary. 0, or -1 if the file ends or fails first. */
int semihost_read(int handle, void *data, size_t size);
int semihost_write(int handle, const void *data, size_t size);

/* Waits for at least one byte and reads what is available. Returns the number of bytes, or -1 if the file has ended or
 * failed. */
int semihost_read_some(int handle, void *data, size_t size);

/* Closes the file. 0, or -1 if the host could not write all of it. */
int semihost_close(int handle);

/* The command line that the emulator passes on, joined by blanks. 0, or -1 if there is none or it does not fit. */
int semihost_command_line(char *line, size_t size);

/* Text for the host's console. */
void semihost_print(const char *text);

/* Ends the emulator with this exit status. Does not return. */
void semihost_exit(int status);

#endif
