/* SPDX-License-Identifier: MIT */
/* How an image of the tests ends: startup_exit() of port/cortex_m/startup.h. Part of all images of this folder; ends
 * the emulator. */
#include "port/cortex_m/startup.h"
#include "port/semihost/semihost.h"

void startup_exit(int status)
{
    semihost_exit(status);
}
