/* SPDX-License-Identifier: MIT */
/*
 * What every Cortex-M does between reset and main(): vectors of the core, memory, FPU.
 *
 * The board's own interrupts follow startup_vectors in section .vectors.board (an array of startup_vector in the
 * board's file, in the order of its interrupt numbers). The handlers below may be defined by the board; where it does
 * not, the core halts in startup_halt(), for a watchdog or a debugger to find.
 */
#ifndef PORT_CORTEX_M_STARTUP_H
#define PORT_CORTEX_M_STARTUP_H

typedef void (*startup_vector)(void);

void startup_reset(void);
void startup_halt(void);
void startup_nmi(void);
void startup_hard_fault(void);
void startup_systick(void);

/* The board's: what becomes of the exit status of main(). May return: the core then waits for ever. */
void startup_exit(int status);

#endif
