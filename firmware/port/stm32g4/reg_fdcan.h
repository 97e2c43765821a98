/* SPDX-License-Identifier: MIT */
/* reg_fdcan: registers of FDCAN1, and the fixed layout of its message RAM (RM0440 chapter 44). Used by port/stm32g4
 * only. Constants for reg.h. */
#ifndef PORT_STM32G4_REG_FDCAN_H
#define PORT_STM32G4_REG_FDCAN_H

#include "port/stm32g4/reg.h"

#define FDCAN1_BASE 0x40006400u

#define FDCAN_CCCR        0x018u      /* control */
#define FDCAN_CCCR_INIT   BIT(0)      /* initialisation: off the bus; bus-off sets it too */
#define FDCAN_CCCR_CCE    BIT(1)      /* the configuration is open; only while INIT is set */
#define FDCAN_NBTP        0x01Cu      /* bit timing; every value is one less than what it means */
#define FDCAN_NBTP_NTSEG2 BITS(0, 7)  /* time quanta after the sample point */
#define FDCAN_NBTP_NTSEG1 BITS(8, 8)  /* time quanta before it, less the first */
#define FDCAN_NBTP_NBRP   BITS(16, 9) /* prescaler: clock periods in a time quantum */
#define FDCAN_NBTP_NSJW   BITS(25, 7) /* jump width: most quanta of a correction */
#define FDCAN_ECR         0x040u      /* error counters */
#define FDCAN_ECR_TEC     BITS(0, 8)  /* transmit errors, 0 ... 255 */
#define FDCAN_ECR_REC     BITS(8, 7)  /* receive errors, 0 ... 127 */
#define FDCAN_PSR         0x044u      /* protocol status */
#define FDCAN_PSR_EP      BIT(5)      /* the node is error passive */
#define FDCAN_PSR_BO      BIT(7)      /* the node is bus-off */
#define FDCAN_IR          0x050u      /* interrupt flags; a 1 clears */
#define FDCAN_IR_RF0N     BIT(0)      /* new frame in receive FIFO 0 */
#define FDCAN_IR_RF0L     BIT(2)      /* one was lost, the FIFO being full */
#define FDCAN_IR_TC       BIT(7)      /* a frame has been sent */
#define FDCAN_IR_EP       BIT(17)     /* error passive has begun or ended */
#define FDCAN_IR_BO       BIT(19)     /* bus-off has begun or ended */
#define FDCAN_IE          0x054u      /* interrupts of the flags: their names, and E */
#define FDCAN_IE_RF0NE    BIT(0)
#define FDCAN_IE_RF0LE    BIT(2)
#define FDCAN_IE_TCE      BIT(7)
#define FDCAN_IE_EPE      BIT(17)
#define FDCAN_IE_BOE      BIT(19)
#define FDCAN_ILS         0x058u /* which of the two lines each group of flags has; 0 after reset */
#define FDCAN_ILE         0x05Cu /* the two interrupt lines; 1: on */
#define FDCAN_ILE_EINT0   BIT(0) /* line 0 */
#define FDCAN_RXGFC       0x080u /* filters, and all frames that match none */
#define FDCAN_RXGFC_RRFE  BIT(0) /* rejects remote frames of 29-bit identifiers, */
#define FDCAN_RXGFC_RRFS  BIT(1) /* and of 11-bit ones */
#define FDCAN_RXGFC_ANFE  BITS(2, 2)  /* frames that match none: 29-bit identifiers, */
#define FDCAN_RXGFC_ANFS  BITS(4, 2)  /* and 11-bit ones */
#define FDCAN_RXGFC_LSS   BITS(16, 5) /* number of filters for 11-bit identifiers */
#define FDCAN_RXF0S       0x090u      /* receive FIFO 0: fill level, get index */
#define FDCAN_RXF0S_F0FL  BITS(0, 4)  /* fill level: elements that wait */
#define FDCAN_RXF0S_F0GI  BITS(8, 2)  /* get index: the oldest of them */
#define FDCAN_RXF0A       0x094u      /* the element with this index has been read */
#define FDCAN_TXBC        0x0C0u      /* transmit buffers: configuration */
#define FDCAN_TXBC_TFQM   BIT(24)     /* 0: FIFO, in the order of the requests */
#define FDCAN_TXFQS       0x0C4u      /* transmit FIFO: free elements, put index */
#define FDCAN_TXFQS_TFFL  BITS(0, 3)  /* free elements */
#define FDCAN_TXFQS_TFQPI BITS(16, 2) /* put index: the element for the next frame */
#define FDCAN_TXBAR       0x0CCu      /* requests, a bit for each buffer */
#define FDCAN_TXBTIE      0x0DCu      /* whose completion sets TC */

/* Values of RXGFC.ANFE and ANFS: what matches no filter is rejected. */
#define FDCAN_REJECT 2u

/* --- Message RAM: 32-bit accesses only --- */

#define FDCANRAM1_BASE 0x4000A400u

#define FDCANRAM_FLSSA   0x000u /* filters for 11-bit identifiers, a word each */
#define FDCANRAM_RXFIFO0 0x0B0u /* elements of receive FIFO 0 */
#define FDCANRAM_TXBUF   0x278u /* elements of the transmit FIFO */
#define FDCANRAM_SIZE    0x350u /* bytes, all parts */

#define FDCAN_FILTERS       28u   /* for 11-bit identifiers */
#define FDCAN_FIFO_ELEMENTS 3u    /* of each FIFO */
#define FDCAN_ELEMENT_SIZE  0x48u /* 18 words: two of header, up to 64 bytes */

/* Words 0 and 1 of a received or sent element. */
#define FDCAN_ELEMENT0_XTD BIT(30)      /* the identifier has 29 bits */
#define FDCAN_ELEMENT0_RTR BIT(29)      /* remote frame */
#define FDCAN_ELEMENT0_ID  BITS(18, 11) /* of an 11-bit identifier */
#define FDCAN_ELEMENT1_DLC BITS(16, 4)  /* data length code: bytes up to 8, more of CAN FD */

/* A filter. */
#define FDCAN_FILTER_SFT   BITS(30, 2)  /* kind of filter */
#define FDCAN_FILTER_SFEC  BITS(27, 3)  /* where a frame that matches goes */
#define FDCAN_FILTER_SFID1 BITS(16, 11) /* first number of the filter, by SFT */
#define FDCAN_FILTER_SFID2 BITS(0, 11)  /* second number */
#define FDCAN_SFT_MASK     2u           /* SFID1 is the identifier, SFID2 the mask */
#define FDCAN_SFEC_FIFO0   1u           /* to receive FIFO 0 */

#define IRQ_FDCAN1_IT0 21u /* interrupt of line 0, by its number in the vector table */

#endif
