/* SPDX-License-Identifier: MIT */
/* reg_flash: registers of the flash memory, category 3 device in dual-bank mode: 2 banks of 128 pages of 2 KB (RM0440
 * chapter 3). Used by port/stm32g4 only. Constants for reg.h. */
#ifndef PORT_STM32G4_REG_FLASH_H
#define PORT_STM32G4_REG_FLASH_H

#include "port/stm32g4/reg.h"

#define FLASH_BASE 0x40022000u

#define FLASH_ACR         0x00u      /* access control */
#define FLASH_ACR_LATENCY BITS(0, 4) /* wait states of a read */
#define FLASH_ACR_PRFTEN  BIT(8)     /* prefetch: on */
#define FLASH_ACR_ICEN    BIT(9)     /* instruction cache: on */
#define FLASH_ACR_DCEN    BIT(10)    /* data cache: on */
#define FLASH_ACR_DCRST   BIT(12)    /* 1 empties the data cache; only while it is off */
#define FLASH_KEYR        0x08u      /* takes the keys that unlock FLASH_CR */
#define FLASH_SR          0x10u      /* status; a 1 clears a flag */
#define FLASH_SR_EOP      BIT(0)     /* an operation has ended (only if its interrupt is on) */
#define FLASH_SR_OPERR    BIT(1)     /* operation error */
#define FLASH_SR_PROGERR  BIT(3)     /* the double word was not erased */
#define FLASH_SR_WRPERR   BIT(4)     /* the page is write-protected */
#define FLASH_SR_PGAERR   BIT(5)     /* address not aligned */
#define FLASH_SR_SIZERR   BIT(6)     /* not written as 32-bit words */
#define FLASH_SR_PGSERR   BIT(7)     /* wrong sequence of operations */
#define FLASH_SR_MISERR   BIT(8)     /* fast programming: data came too late */
#define FLASH_SR_FASTERR  BIT(9)     /* fast programming: wrong sequence, or interrupted */
#define FLASH_SR_BSY      BIT(16)    /* an operation is under way (read only) */
#define FLASH_CR          0x14u      /* control */
#define FLASH_CR_PG       BIT(0)     /* programming: the next writes are programmed */
#define FLASH_CR_PER      BIT(1)     /* the next operation erases a page */
#define FLASH_CR_PNB      BITS(3, 7) /* number of the page in its bank */
#define FLASH_CR_BKER     BIT(11)    /* the page is in bank 2 */
#define FLASH_CR_STRT     BIT(16)    /* 1 begins to erase */
#define FLASH_CR_LOCK     BIT(31)    /* 1 locks FLASH_CR until the keys come */
#define FLASH_ECCR        0x18u      /* error correction; a 1 clears a flag */
#define FLASH_ECCR_BK_ECC BIT(21)    /* the word of the error is in bank 2 */
#define FLASH_ECCR_ECCD   BIT(31)    /* two wrong bits: not corrected, NMI */
#define FLASH_OPTR        0x20u      /* option bytes, as loaded at reset */
#define FLASH_OPTR_DBANK  BIT(22)    /* dual-bank mode */

/* The two words that unlock FLASH_CR. */
#define FLASH_KEY1 0x45670123u
#define FLASH_KEY2 0xCDEF89ABu

#define FLASH_BANK_2      0x08040000u /* address of its first byte */
#define FLASH_BANK_BYTES  0x40000u
#define FLASH_PAGE_BYTES  2048u /* the unit of erasing */
#define FLASH_WRITE_BYTES 8u    /* the unit of programming, which has its own error correction */

#endif
