/* SPDX-License-Identifier: MIT */
/* The kernels of hosts: fixed, float and double. Used by core/kernel. Constant data. */
#include "core/kernel.h"

const struct kernel *const kernels_linked[KERNELS] = {&kernel_fixed, &kernel_float, &kernel_double};
