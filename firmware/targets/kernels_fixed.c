/* SPDX-License-Identifier: MIT */
/* Targets without an FPU: the fixed kernel. */
#include "core/kernel.h"

const struct kernel *const kernels_linked[KERNELS] = {&kernel_fixed};
