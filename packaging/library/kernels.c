/* SPDX-License-Identifier: MIT */
/*
 * The kernels that are linked: fixed always, float and double unless HODOGRAPH_KERNEL_FLOAT or HODOGRAPH_KERNEL_DOUBLE is
 * 0. By default a Cortex-M has float where its FPU has single precision, and no double; every other target has all three. Compiled into the library, in
 * place of firmware/core/kernels_all.c; used by core/kernel. Constant data.
 */
#include "hodograph/kernel.h"

#if defined(__ARM_ARCH_PROFILE) && __ARM_ARCH_PROFILE == 'M'
#define ON_CORTEX_M 1
#else
#define ON_CORTEX_M 0
#endif

#ifndef HODOGRAPH_KERNEL_FLOAT
#if ON_CORTEX_M && !defined(__ARM_FP)
#define HODOGRAPH_KERNEL_FLOAT 0
#else
#define HODOGRAPH_KERNEL_FLOAT 1
#endif
#endif

#ifndef HODOGRAPH_KERNEL_DOUBLE
#if ON_CORTEX_M
#define HODOGRAPH_KERNEL_DOUBLE 0
#else
#define HODOGRAPH_KERNEL_DOUBLE 1
#endif
#endif

const struct kernel *const kernels_linked[KERNELS] = {
    &kernel_fixed,
#if HODOGRAPH_KERNEL_FLOAT
    &kernel_float,
#else
    NULL,
#endif
#if HODOGRAPH_KERNEL_DOUBLE
    &kernel_double,
#else
    NULL,
#endif
};
