/* SPDX-License-Identifier: MIT */
/* Implements plant/overload.h (see there): thermal model of a motor and its power stage (I2t). Used by node/supervision
 * and node/servo. The functions change their struct only; any thread. */
#include "plant/overload.h"

void overload_init(struct overload *overload, double peak, double time_s)
{
    overload->heat_s = 0.0;
    overload->level_s = peak > 1.0 && time_s > 0.0 ? (peak * peak - 1.0) * time_s : 0.0;
}

void overload_step(struct overload *overload, double load, double time_s)
{
    const double heat_s = overload->heat_s + (load * load - 1.0) * time_s;
    overload->heat_s = heat_s > 0.0 ? heat_s : 0.0;
}

bool overload_above(const struct overload *overload, double part)
{
    return overload->level_s > 0.0 && overload->heat_s > part * overload->level_s;
}

uint16_t overload_permille(const struct overload *overload)
{
    if (overload->level_s <= 0.0) {
        return 0;
    }
    const double permille = 1000.0 * overload->heat_s / overload->level_s;
    return permille < 65535.0 ? (uint16_t)permille : UINT16_MAX;
}
