/* SPDX-License-Identifier: MIT */
#include "node/home_seek.h"

#include <stddef.h>

#include "node/equipment.h"

struct home_seek_method {
    uint32_t inputs_switch;
    int8_t method;
    bool entering;
    int direction;
};

static const struct home_seek_method methods[] = {
    {EQUIPMENT_INPUT_NEGATIVE, 17, false, -1},
    {EQUIPMENT_INPUT_POSITIVE, 18, false, 1},
    {EQUIPMENT_INPUT_HOME, 19, false, 1},
    {EQUIPMENT_INPUT_HOME, 20, true, 1},
    {EQUIPMENT_INPUT_HOME, 21, false, -1},
    {EQUIPMENT_INPUT_HOME, 22, true, -1},
    {0, 35, false, 0},
    {0, 37, false, 0},
};

static const struct home_seek_method *home_seek_find(int8_t method)
{
    for (size_t i = 0; i < sizeof methods / sizeof methods[0]; i++) {
        if (methods[i].method == method) {
            return &methods[i];
        }
    }
    return NULL;
}

bool home_seek_supports(int8_t method)
{
    return home_seek_find(method) != NULL;
}

void home_seek_begin(struct home_seek *homing, int8_t method)
{
    const struct home_seek_method *found = home_seek_find(method);
    homing->method = method;
    if (found == NULL) {
        homing->phase = HOME_SEEK_FAILED;
        return;
    }
    homing->inputs_switch = found->inputs_switch;
    homing->direction = found->direction;
    homing->entering = found->entering;
    homing->phase = found->direction == 0 ? HOME_SEEK_STOP : HOME_SEEK_SEARCH;
}

static int home_seek_direction(const struct home_seek *homing)
{
    return homing->phase == HOME_SEEK_BACK ? -homing->direction : homing->direction;
}

/* Against a limit switch that is not the method's own: the home switch is not where it should be. */
static bool home_seek_at_end(const struct home_seek *homing, uint32_t inputs)
{
    const uint32_t end =
        home_seek_direction(homing) > 0 ? EQUIPMENT_INPUT_POSITIVE : EQUIPMENT_INPUT_NEGATIVE;
    return (inputs & end) != 0 && end != homing->inputs_switch;
}

static enum home_seek_event home_seek_home(struct home_seek *homing)
{
    homing->phase = HOME_SEEK_STOP;
    return HOME_SEEK_EDGE;
}

static enum home_seek_event home_seek_back(struct home_seek *homing, bool on)
{
    if (on) {
        return HOME_SEEK_NOTHING;
    }
    if (!homing->entering) {
        return home_seek_home(homing);
    }
    homing->phase = HOME_SEEK_APPROACH;
    return HOME_SEEK_NOTHING;
}

enum home_seek_event home_seek_look(struct home_seek *homing, uint32_t inputs)
{
    const bool on = (inputs & homing->inputs_switch) != 0;
    if (homing->phase < HOME_SEEK_SEARCH || homing->phase > HOME_SEEK_APPROACH) {
        return HOME_SEEK_NOTHING;
    }
    if (home_seek_at_end(homing, inputs)) {
        homing->phase = HOME_SEEK_FAILED;
        return HOME_SEEK_NOTHING;
    }
    if (homing->phase == HOME_SEEK_SEARCH) {
        homing->phase = on ? HOME_SEEK_BACK : HOME_SEEK_SEARCH;
        return HOME_SEEK_NOTHING;
    }
    if (homing->phase == HOME_SEEK_BACK) {
        return home_seek_back(homing, on);
    }
    return on ? home_seek_home(homing) : HOME_SEEK_NOTHING;
}

int home_seek_speed(const struct home_seek *homing)
{
    switch (homing->phase) {
    case HOME_SEEK_SEARCH:
        return 2 * homing->direction;
    case HOME_SEEK_BACK:
        return -homing->direction;
    case HOME_SEEK_APPROACH:
        return homing->direction;
    default:
        return 0;
    }
}
