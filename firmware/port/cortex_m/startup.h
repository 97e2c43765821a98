/* SPDX-License-Identifier: MIT */
/*
 * What every Cortex-M does between reset and main(): vectors, stack, memory, FPU. ARMv6-M to ARMv8-M.
 *
 * Before it the core is as after its reset: thread mode, MSP, nothing enabled. A boot loader must leave it so, and may
 * put the image anywhere: the vector table is made known (VTOR) except on a Cortex-M0, which has it at address 0.
 *
 * Vectors: the 16 of the core are here; the board's own follow in section .vectors.board, an array of startup_vector in
 * the board's file in the order of its interrupt numbers, as far as the last one that it enables. NULL stands for one
 * that is never enabled. The table is aligned for 240 of them (port/cortex_m/sections.ld).
 *
 * Stack: only the main one, for main loop and interrupts. It is the lowest thing in RAM, so that where nothing lies
 * below, an overflow is a fault and not a changed variable; a Cortex-M33 has the limit in MSPLIM besides. That it does
 * not come to that is proven for each image when it is linked (tools/analysis/stack.py).
 *
 * FPU: on for all modes, and lazy stacking as after reset (FPCCR: ASPEN and LSPEN are 1). So interrupts may compute
 * with floats while the main loop does: entry leaves room for s0 to s15 and FPSCR on the stack (72 bytes more), which
 * are saved only when the handler first touches the FPU, by hardware. A handler without floats costs no more than
 * without an FPU; the tick with the float kernel pays for 17 words when it has interrupted a main loop that has used
 * floats since it began. s16 to s31 are saved by the functions that use them. Rounding is to nearest and subnormals are
 * kept (FPSCR and FPDSCR are 0 after reset and nobody writes them): that is what makes the float kernel's bits those of
 * the host.
 */
#ifndef PORT_CORTEX_M_STARTUP_H
#define PORT_CORTEX_M_STARTUP_H

typedef void (*startup_vector)(void);

/* The entry. Variables are set up here; nothing of C runs before. */
void startup_reset(void);

/* Stays for ever, for a watchdog or a debugger to find. What is not defined by the board ends here. */
void startup_halt(void);

/* The board's, where it wants them. */
void startup_nmi(void);
void startup_hard_fault(void); /* and all faults that have no handler of their own enabled */
void startup_systick(void);

/* The board's: what becomes of the exit status of main(). May return: the core then halts. */
void startup_exit(int status);

#endif
