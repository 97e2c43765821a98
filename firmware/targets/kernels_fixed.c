/* SPDX-License-Identifier: MIT */
/* The kernels of targets without an FPU: fixed. Used by core/kernel. Constant data. */
#include "core/kernel.h"

const struct kernel *const kernels_linked[KERNELS] = {&kernel_fixed};
