/* SPDX-License-Identifier: MIT */
/* Implements core/kernel.h (see there): finding a kernel of this image by its number. */
#include "core/kernel.h"

const struct kernel *kernel_find(uint32_t number)
{
    return number < KERNELS ? kernels_linked[number] : NULL;
}
