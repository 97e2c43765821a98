/* SPDX-License-Identifier: MIT */
/* Hosts: every kernel. */
#include "core/kernel.h"

const struct kernel *const kernels_linked[KERNELS] = {&kernel_fixed, &kernel_float, &kernel_double};
