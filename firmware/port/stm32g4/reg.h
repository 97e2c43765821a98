/* SPDX-License-Identifier: MIT */
/*
 * reg: access to the registers and memories of the chip, of port/stm32g4. Used by port/stm32g4 only. Any context:
 * reg_read, reg_write and reg_memory are single accesses; the functions that read, change and write a register need the
 * lock of their caller.
 *
 * On the chip each access is one load or store. On any other machine the tests replace the chip: they define
 * reg_read, reg_write and reg_memory as a model of the peripherals (tests/unit/stm32g4_*.c). The reg_*.h headers hold
 * what this port uses of reference manual RM0440, named PERIPHERAL_REGISTER_FIELD; tools/check_registers.py compares
 * them with an independent table.
 */
#ifndef PORT_STM32G4_REG_H
#define PORT_STM32G4_REG_H

#include <stdint.h>

/* A field of a register is named by its mask. */
#define BIT(position)         (1u << (position))
#define BITS(position, count) (((1u << (count)) - 1u) << (position))

#if defined(__arm__)

static inline uint32_t reg_read(uint32_t address)
{
    return *(const volatile uint32_t *)(uintptr_t)address;
}

static inline void reg_write(uint32_t address, uint32_t value)
{
    *(volatile uint32_t *)(uintptr_t)address = value;
}

/* Memory of the chip as it is now: the compiler may not reuse values read before registers changed it. */
static inline const uint8_t *reg_memory(uint32_t address)
{
    __asm__ volatile("" ::: "memory");
    return (const uint8_t *)(uintptr_t)address;
}

#else

uint32_t reg_read(uint32_t address);
void reg_write(uint32_t address, uint32_t value);
const uint8_t *reg_memory(uint32_t address);

#endif

/* A value at the place of a field, and back. */
static inline uint32_t reg_field(uint32_t field, uint32_t value)
{
    return (value * (field & (0u - field))) & field;
}

static inline uint32_t reg_get(uint32_t word, uint32_t field)
{
    return (word & field) / (field & (0u - field));
}

static inline void reg_set(uint32_t address, uint32_t bits)
{
    reg_write(address, reg_read(address) | bits);
}

static inline void reg_clear(uint32_t address, uint32_t bits)
{
    reg_write(address, reg_read(address) & ~bits);
}

/* Changes one field. */
static inline void reg_put(uint32_t address, uint32_t field, uint32_t value)
{
    reg_write(address, (reg_read(address) & ~field) | reg_field(field, value));
}

#endif
