/* SPDX-License-Identifier: MIT */
#include "port/cortex_m/startup.h"
#include "port/semihost/semihost.h"

void startup_exit(int status)
{
    semihost_exit(status);
}
