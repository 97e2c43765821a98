/* SPDX-License-Identifier: MIT */
/* Implements port/stm32g4/faults.h (see there): hard faults and uncorrectable words of the flash. Used by
 * port_stm32g4.c. Main loop; the reactions run in the interrupt handlers of the faults. Writes a line to the console,
 * and restarts the chip. */
#include "port/stm32g4/faults.h"

#include <stdbool.h>

#include "port/cortex_m/startup.h"
#include "port/stm32g4/console.h"
#include "port/stm32g4/cpu.h"
#include "port/stm32g4/flash.h"
#include "port/stm32g4/reg.h"

static struct {
    volatile bool running;
    uint32_t spoiled_words;
} self;

void faults_begin(void)
{
    self.running = false;
    self.spoiled_words = 0;
}

uint32_t faults_from_now_on(void)
{
    self.running = true;
    return self.spoiled_words;
}

/* Before the start the store is searched for a complete program. A word whose write was interrupted by a loss of power
 * is found then, and a CRC refuses its content. Later only checked content is read, so the memory itself has failed. */
void startup_nmi(void)
{
    if (flash_take_ecc_error() && !self.running) {
        self.spoiled_words++;
        return;
    }
    console_number("the flash memory has failed", 0);
    cpu_reset();
}

/* SYNC stops, so the drives stop by themselves. */
void startup_hard_fault(void)
{
    console_hex("hard fault, CFSR", reg_read(0xE000ED28u));
    cpu_reset();
}

void startup_exit(int status)
{
    console_number("ends with status", status);
}
