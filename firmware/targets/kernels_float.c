/* SPDX-License-Identifier: MIT */
/* Targets with an FPU for single precision: fixed and float. */
#include "core/kernel.h"

const struct kernel *const kernels_linked[KERNELS] = {&kernel_fixed, &kernel_float};
