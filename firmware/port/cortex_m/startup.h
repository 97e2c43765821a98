/* SPDX-License-Identifier: MIT */
/*
 * startup: what every Cortex-M does between reset and main(): vectors, stack, memory, FPU. ARMv6-M to ARMv8-M. Called
 * by the hardware, at reset and in interrupts; a board defines those that it needs. Writes the variables in RAM and the
 * control registers of the core before main().
 *
 * At its start the core has to be in the state after reset: thread mode, MSP, no interrupt enabled. A boot loader must
 * leave this state, and may load the image anywhere: startup sets VTOR to the vector table. A Cortex-M0 has no VTOR;
 * its table is at address 0.
 *
 * Vectors: the 16 of the core are here; the board's own follow in section .vectors.board, an array of startup_vector in
 * the board's file in the order of its interrupt numbers, as far as the last one that it enables. NULL stands for one
 * that is never enabled. The table is aligned for 240 of them (port/cortex_m/sections.ld).
 *
 * Stack: main loop and interrupts use the main stack only. It is at the lowest addresses of RAM. So an overflow is a
 * fault and changes no variable, if there is no memory below. A Cortex-M33 has the limit in MSPLIM too.
 * tools/analysis/stack.py proves for each linked image that the stack is large enough.
 *
 * FPU: on for all modes, with lazy stacking as after reset (FPCCR: ASPEN and LSPEN are 1). So interrupts and main loop
 * may both use floats. Interrupt entry reserves 72 bytes more on the stack for s0 to s15 and FPSCR. The hardware saves
 * them there when the handler first uses the FPU. A handler without floats costs no more than without an FPU. The tick
 * with the float kernel stores 17 words more, if it has interrupted a main loop that has used floats. Functions that
 * use s16 to s31 save them. Rounding is to nearest, and subnormals are kept: FPSCR and FPDSCR are 0 after reset and
 * never written. This gives the float kernel the same bits as on the host.
 */
#ifndef PORT_CORTEX_M_STARTUP_H
#define PORT_CORTEX_M_STARTUP_H

typedef void (*startup_vector)(void);

/* The entry. Variables are set up here; nothing of C runs before. */
void startup_reset(void);

/* Loops for ever, for a watchdog or a debugger. All handlers that the board does not define end here. */
void startup_halt(void);

/* Interrupt handlers of the core. Defined by the board if it needs them. */
void startup_nmi(void);        /* interrupt that cannot be masked */
void startup_hard_fault(void); /* and all faults that have no handler of their own enabled */
void startup_systick(void);    /* SysTick has reached 0 */

/* After main(), once. Defined by the board: takes the exit status of main(). May return: the core then halts. */
void startup_exit(int status);

#endif
