/* SPDX-License-Identifier: MIT */
/* The kernels of targets with an FPU for single precision: fixed and float. Used by core/kernel. Constant data. */
#include "core/kernel.h"

const struct kernel *const kernels_linked[KERNELS] = {&kernel_fixed, &kernel_float};
