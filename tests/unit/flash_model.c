/* SPDX-License-Identifier: MIT */
/* Implements flash_model.h (see there): a register model of the flash of an STM32G474. Part of the C tests; no I/O. */
#include "flash_model.h"

#include <string.h>

#include "stm32g4_chip.h"

#define REGISTERS 0x40022000u
#define MEMORY    0x08040000u
#define PAGE      2048u
#define PAGES     (FLASH_MODEL_BYTES / PAGE)
#define WORD      8u

enum { ACR = 0x00, KEYR = 0x08, SR = 0x10, CR = 0x14, ECCR = 0x18, OPTR = 0x20 };

#define LATENCY_RESET 0x00000600u /* both caches on */
#define DCEN          (1u << 10)
#define DCRST         (1u << 12)
#define PG            (1u << 0)
#define PER           (1u << 1)
#define BKER          (1u << 11)
#define STRT          (1u << 16)
#define LOCK          (1u << 31)
#define BSY           (1u << 16)
#define PROGERR       (1u << 3)
#define PGAERR        (1u << 5)
#define PGSERR        (1u << 7)
#define OPERR         (1u << 1)
#define ERRORS        0xC3FAu
#define BUSY_LOOKS    4u

static struct flash {
    uint8_t memory[FLASH_MODEL_BYTES];
    bool spoiled[FLASH_MODEL_BYTES / WORD];
    unsigned erased[PAGES];
    uint32_t operations;
    uint32_t cut_at;
    enum flash_model_remains remains;
    uint32_t seed;
    jmp_buf *where;
    bool dual;
    /* lost with the power */
    uint32_t acr;
    uint32_t cr;
    uint32_t sr;
    uint32_t eccr;
    unsigned keys; /* right ones so far */
    bool locked_out;
    unsigned busy;
    bool half_written; /* the first word of two */
    uint32_t half_at;
    uint32_t half;
    bool stale;
    bool refuse;
} self, saved;

void flash_model_power_on(void)
{
    self.acr = LATENCY_RESET;
    self.cr = LOCK;
    self.sr = 0;
    self.eccr = 0;
    self.keys = 0;
    self.locked_out = false;
    self.busy = 0;
    self.half_written = false;
    self.stale = false;
    self.refuse = false;
}

void flash_model_new(void)
{
    memset(&self, 0, sizeof self);
    memset(self.memory, 0xFF, sizeof self.memory);
    self.cut_at = UINT32_MAX;
    self.dual = true;
    flash_model_power_on();
}

void flash_model_save(void)
{
    saved = self;
}

void flash_model_restore(void)
{
    self = saved;
}

bool flash_model_covers(uint32_t address)
{
    return (address >= REGISTERS && address < REGISTERS + 0x400u) ||
           (address >= MEMORY && address < MEMORY + FLASH_MODEL_BYTES);
}

uint32_t flash_model_operations(void)
{
    return self.operations;
}

void flash_model_cut(uint32_t operation, enum flash_model_remains remains, uint32_t seed,
                     jmp_buf *where)
{
    self.cut_at = operation;
    self.remains = remains;
    self.seed = seed * 2654435761u + 1u;
    self.where = where;
}

static uint8_t random_byte(void)
{
    self.seed = self.seed * 1664525u + 1013904223u;
    return (uint8_t)(self.seed >> 24);
}

/* Bytes between what was there and what should be: every bit that changes may have done so or not. */
static void change_partly(uint32_t at, const uint8_t *target, uint32_t size)
{
    for (uint32_t i = 0; i < size; ++i) {
        const uint8_t changing = (uint8_t)(self.memory[at + i] ^ target[i]);
        self.memory[at + i] ^= (uint8_t)(changing & random_byte());
        self.spoiled[(at + i) / WORD] = self.remains == FLASH_MODEL_HALF;
    }
}

static void change(uint32_t at, const uint8_t *target, uint32_t size)
{
    memcpy(&self.memory[at], target, size);
    memset(&self.spoiled[at / WORD], 0, size / WORD);
}

static void operate(uint32_t at, const uint8_t *target, uint32_t size)
{
    const bool cut = self.operations == self.cut_at;
    self.operations++;
    if (!cut || self.remains == FLASH_MODEL_AFTER) {
        change(at, target, size);
    } else if (self.remains != FLASH_MODEL_BEFORE) {
        change_partly(at, target, size);
    }
    self.busy = BUSY_LOOKS;
    self.stale = true;
    if (cut) {
        self.cut_at = UINT32_MAX;
        longjmp(*self.where, 1);
    }
}

static bool refused(uint32_t error)
{
    self.sr |= error;
    return error != 0u;
}

static uint32_t what_is_wrong(void)
{
    if (self.refuse) {
        self.refuse = false;
        return OPERR;
    }
    return (self.sr & ERRORS) != 0u ? PGSERR : 0u; /* those of before have to be cleared first */
}

static void check_cache(void)
{
    if ((self.acr & DCEN) != 0u) {
        chip_forbids("the data cache is on while the other bank is written", REGISTERS + ACR);
    }
}

static void erase(void)
{
    static uint8_t blank[PAGE];
    memset(blank, 0xFF, sizeof blank);
    check_cache();
    const uint32_t page = self.cr >> 3 & 127u;
    if ((self.cr & BKER) == 0u) {
        chip_forbids("erases a page of the bank that it runs from", REGISTERS + CR);
    }
    if (!refused(what_is_wrong())) {
        self.erased[page]++;
        operate(page * PAGE, blank, PAGE);
    }
}

static bool is_blank(uint32_t at)
{
    for (uint32_t i = 0; i < WORD; ++i) {
        if (self.memory[at + i] != 0xFFu) {
            return false;
        }
    }
    return !self.spoiled[at / WORD];
}

static void program(uint32_t at, uint32_t low, uint32_t high)
{
    uint8_t bytes[WORD];
    memcpy(bytes, &low, 4);
    memcpy(bytes + 4, &high, 4);
    check_cache();
    uint32_t wrong = what_is_wrong();
    if (wrong == 0u && !is_blank(at)) {
        wrong = PROGERR;
    }
    if (!refused(wrong)) {
        operate(at, bytes, WORD);
    }
}

static void write_memory(uint32_t at, uint32_t value)
{
    if ((self.cr & LOCK) != 0u || (self.cr & PG) == 0u || self.busy > 0u) {
        chip_forbids("memory is written while PG is not set or the flash is busy", MEMORY + at);
    }
    if (!self.half_written && at % WORD == 0u) {
        self.half_written = true;
        self.half_at = at;
        self.half = value;
    } else if (self.half_written && at == self.half_at + 4u) {
        self.half_written = false;
        program(self.half_at, self.half, value);
    } else {
        (void)refused(PGAERR);
    }
}

static void write_key(uint32_t value)
{
    static const uint32_t keys[2] = {0x45670123u, 0xCDEF89ABu};
    if ((self.cr & LOCK) == 0u || self.locked_out || value != keys[self.keys]) {
        self.locked_out = true;
        chip_forbids("a wrong key locks the flash until reset", REGISTERS + KEYR);
        return;
    }
    self.keys++;
    if (self.keys == 2u) {
        self.keys = 0;
        self.cr &= ~LOCK;
    }
}

static void write_control(uint32_t value)
{
    if ((self.cr & LOCK) != 0u) {
        chip_forbids("control is written while locked", REGISTERS + CR);
    }
    if (self.busy > 0u) {
        chip_forbids("control is written while busy", REGISTERS + CR);
    }
    self.cr = value & ~STRT;
    if ((value & STRT) != 0u && (value & PER) != 0u) {
        erase();
    }
}

static void write_cache_control(uint32_t value)
{
    if ((value & DCRST) != 0u) {
        if ((value & DCEN) != 0u) {
            chip_forbids("the data cache can be emptied only while it is off", REGISTERS + ACR);
        }
        self.stale = false;
    }
    self.acr = value;
}

void flash_model_write(uint32_t address, uint32_t value)
{
    if (address < REGISTERS) {
        write_memory(address - MEMORY, value);
        return;
    }
    switch (address - REGISTERS) {
    case ACR:
        write_cache_control(value);
        break;
    case KEYR:
        write_key(value);
        break;
    case SR:
        self.sr &= ~value;
        break;
    case CR:
        write_control(value);
        break;
    case ECCR:
        self.eccr &= ~(value & 3u << 30);
        break;
    default:
        chip_forbids("not to be written, or unknown to this model", address);
        break;
    }
}

static uint32_t read_status(void)
{
    if (self.busy > 0u) {
        self.busy--;
        return self.sr | BSY;
    }
    return self.sr;
}

uint32_t flash_model_read(uint32_t address)
{
    switch (address - REGISTERS) {
    case ACR:
        return self.acr;
    case SR:
        return read_status();
    case CR:
        return self.cr;
    case ECCR:
        return self.eccr;
    case OPTR:
        return self.dual ? 1u << 22 : 0u;
    default:
        chip_forbids("unknown to this model", address);
        return 0;
    }
}

const uint8_t *flash_model_memory(uint32_t address)
{
    const uint32_t at = address - MEMORY;
    if (at >= FLASH_MODEL_BYTES) {
        chip_forbids("outside bank 2", address);
        return self.memory;
    }
    return &self.memory[at];
}

uint32_t flash_model_spoiled(void)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < FLASH_MODEL_BYTES / WORD; ++i) {
        count += self.spoiled[i] ? 1u : 0u;
    }
    return count;
}

unsigned flash_model_erased(uint32_t page)
{
    return self.erased[page];
}

void flash_model_single_bank(void)
{
    self.dual = false;
}

bool flash_model_cache_is_stale(void)
{
    return self.stale;
}

void flash_model_refuse_next(void)
{
    self.refuse = true;
}

void flash_model_fail_word(unsigned bank)
{
    self.eccr |= 1u << 31 | (bank == 2u ? 1u << 21 : 0u);
}
