/* SPDX-License-Identifier: MIT */
/* decimal: an integer as text, for the console of a board without printf. Used by the ports. Pure. */
#ifndef PORT_COMMON_DECIMAL_H
#define PORT_COMMON_DECIMAL_H

#include <stdint.h>

#define DECIMAL_SIZE 12u /* sign, ten digits, end */

/* The number as text: a pointer into `text`. Any context. */
const char *decimal(int32_t value, char text[DECIMAL_SIZE]);

#endif
