/* SPDX-License-Identifier: MIT */
/* Implements core/kernel.h (see there): finding a kernel of this image by its number. Used by firmware,
 * sim/offline/stream and host tools: core/coefficients precomputes (main loop), core/interpolator evaluates (tick), the
 * others select or list kernels. Pure, any context. */
#include "core/kernel.h"

const struct kernel *kernel_find(uint32_t number)
{
    return number < KERNELS ? kernels_linked[number] : NULL;
}
