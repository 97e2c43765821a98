/* SPDX-License-Identifier: MIT */
/*
 * Lets user-mode Linux 6.1 start on processors whose register state is larger than it knows (Intel AMX). Loaded by
 * linux.uml, for which vcan/user_mode sets LD_PRELOAD. Replaces ptrace() of that process.
 *
 * User-mode Linux restores the registers of its processes by PTRACE_SETREGSET with NT_X86_XSTATE, and always writes
 * 2696 bytes: all of it up to AVX-512 and PKRU. Linux refuses fewer bytes than the processor's whole state, which has
 * 11008 bytes with AMX, and user-mode Linux then panics in put_fp_registers(). Here the bytes that are missing are
 * added. They are zero: the state of AMX as no process has used it, since a process may use it only after
 * arch_prctl(), which user-mode Linux does not have. On other processors each call passes through unchanged.
 */
#include <elf.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/syscall.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

enum { LARGEST_BYTES = 1 << 16 };

/* Not on the stack: that of user-mode Linux has 16 KiB. It has one thread that calls ptrace(). */
static unsigned char state[LARGEST_BYTES];
static size_t state_bytes; /* of the processor; 0: not known yet */

static long set_registers(pid_t pid, struct iovec *given)
{
    if (state_bytes == 0) {
        struct iovec all = {.iov_base = state, .iov_len = sizeof state};
        if (syscall(SYS_ptrace, PTRACE_GETREGSET, pid, NT_X86_XSTATE, &all) != 0)
            return -1;
        state_bytes = all.iov_len;
        memset(state, 0, sizeof state);
    }
    struct iovec whole = *given;
    if (given->iov_len < state_bytes) {
        memcpy(state, given->iov_base, given->iov_len);
        whole = (struct iovec){.iov_base = state, .iov_len = state_bytes};
    }
    return syscall(SYS_ptrace, PTRACE_SETREGSET, pid, NT_X86_XSTATE, &whole);
}

/* As in the C library: a request that reads a word returns it. */
long ptrace(enum __ptrace_request request, ...)
{
    va_list rest;
    va_start(rest, request);
    const pid_t pid = va_arg(rest, pid_t);
    void *address = va_arg(rest, void *);
    void *data = va_arg(rest, void *);
    va_end(rest);

    if (request == PTRACE_SETREGSET && (size_t)address == NT_X86_XSTATE)
        return set_registers(pid, data);
    long word = 0;
    const int is_read = request >= PTRACE_PEEKTEXT && request <= PTRACE_PEEKUSER;
    const long status = syscall(SYS_ptrace, request, pid, address, is_read ? &word : data);
    return is_read && status >= 0 ? word : status;
}
