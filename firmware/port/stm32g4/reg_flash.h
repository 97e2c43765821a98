/* SPDX-License-Identifier: MIT */
/* reg_flash: registers of the flash memory, category 3 device in dual-bank mode: 2 banks of 128 pages of 2 KB (RM0440
 * chapter 3). Used by port/stm32g4 only. Constants for reg.h. */
#ifndef PORT_STM32G4_REG_FLASH_H
#define PORT_STM32G4_REG_FLASH_H

#include "port/stm32g4/reg.h"

#define FLASH_BASE 0x40022000u

#define FLASH_ACR         0x00u
#define FLASH_ACR_LATENCY BITS(0, 4)
#define FLASH_ACR_PRFTEN  BIT(8)
#define FLASH_ACR_ICEN    BIT(9)
#define FLASH_ACR_DCEN    BIT(10)
#define FLASH_ACR_DCRST   BIT(12)
#define FLASH_KEYR        0x08u
#define FLASH_SR          0x10u
#define FLASH_SR_EOP      BIT(0)
#define FLASH_SR_OPERR    BIT(1)
#define FLASH_SR_PROGERR  BIT(3)
#define FLASH_SR_WRPERR   BIT(4)
#define FLASH_SR_PGAERR   BIT(5)
#define FLASH_SR_SIZERR   BIT(6)
#define FLASH_SR_PGSERR   BIT(7)
#define FLASH_SR_MISERR   BIT(8)
#define FLASH_SR_FASTERR  BIT(9)
#define FLASH_SR_BSY      BIT(16)
#define FLASH_CR          0x14u
#define FLASH_CR_PG       BIT(0)
#define FLASH_CR_PER      BIT(1)
#define FLASH_CR_PNB      BITS(3, 7)
#define FLASH_CR_BKER     BIT(11)
#define FLASH_CR_STRT     BIT(16)
#define FLASH_CR_LOCK     BIT(31)
#define FLASH_ECCR        0x18u
#define FLASH_ECCR_BK_ECC BIT(21)
#define FLASH_ECCR_ECCD   BIT(31)
#define FLASH_OPTR        0x20u
#define FLASH_OPTR_DBANK  BIT(22)

/* The two words that unlock FLASH_CR. */
#define FLASH_KEY1 0x45670123u
#define FLASH_KEY2 0xCDEF89ABu

#define FLASH_BANK_2      0x08040000u
#define FLASH_BANK_BYTES  0x40000u
#define FLASH_PAGE_BYTES  2048u
#define FLASH_WRITE_BYTES 8u

#endif
