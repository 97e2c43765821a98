/* SPDX-License-Identifier: MIT */
#include "core/kernel.h"

const struct kernel *kernel_find(uint32_t number)
{
    return number < KERNELS ? kernels_linked[number] : NULL;
}
