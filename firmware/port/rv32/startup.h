/* SPDX-License-Identifier: MIT */
/*
 * startup: what a RISC-V hart does between reset and main(): stack, global pointer, traps, memory. For QEMU's virt
 * machine and the images of tests/target, which have no interrupts: machine mode, one hart, exit by semihosting.
 *
 * Called by the hardware only, at reset and in traps. Writes the variables in RAM before main(). A trap of any kind
 * ends the emulator with status 3.
 */
#ifndef PORT_RV32_STARTUP_H
#define PORT_RV32_STARTUP_H

/* The entry; assembler, since there is no stack yet. */
void startup_reset(void);

/* The part in C: sets up the memory and calls main(). Does not return. */
void startup_memory(void);

/* Every trap; does not return, so nothing is saved. */
void startup_trap(void);

#endif
