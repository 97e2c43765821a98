/* SPDX-License-Identifier: MIT */
/* Implements app/machine/outputs.h: the effect of the machine's state, the delay by ticks, and the frame. Called by
 * app/tick after the machine's step. Timer; outputs_init in the main loop. Changes its struct and the outputs of the
 * machine's motion. */
#include "app/machine/outputs.h"

#include <string.h>

#include "canopen/pdo.h"

void outputs_init(struct outputs *outputs)
{
    memset(outputs, 0, sizeof *outputs);
}

/* ---- Effect of the machine's state ---- */

enum outputs_mode {
    OUTPUTS_FOLLOW,  /* as the path has switched them */
    OUTPUTS_MASKED,  /* off now; as the path has switched them when the motion continues */
    OUTPUTS_CLEARED, /* off, and the path's own state is cleared */
};

static enum outputs_mode follow_or(bool follow, enum outputs_mode otherwise)
{
    return follow ? OUTPUTS_FOLLOW : otherwise;
}

/* Whether this is the first tick after a motion whose end switches the outputs off. A host can switch them on again at
 * standstill. A feed hold that begins just before the end changes nothing. */
static bool ends_now(enum machine_state before, const struct machine *machine)
{
    if (before == MACHINE_READY ||
        (machine->config.outputs.behaviour & CONFIG_OUTPUTS_OFF_AT_END) == 0u) {
        return false;
    }
    const bool at_end = before == MACHINE_RUNNING || before == MACHINE_HOLDING;
    return !at_end || !machine->outputs_stay;
}

static enum outputs_mode mode_of(enum machine_state before, const struct machine *machine)
{
    const uint32_t behaviour = machine->config.outputs.behaviour;
    switch (machine->state) {
    case MACHINE_RUNNING: /* a motion that waits for a chunk counts as held */
        return follow_or((behaviour & CONFIG_OUTPUTS_OFF_IN_HOLD) == 0u ||
                             !motion_misses_chunk(&machine->motion),
                         OUTPUTS_MASKED);
    case MACHINE_HOLDING:
    case MACHINE_HELD:
        return follow_or((behaviour & CONFIG_OUTPUTS_OFF_IN_HOLD) == 0u, OUTPUTS_MASKED);
    case MACHINE_STOPPING:
        return follow_or((behaviour & CONFIG_OUTPUTS_KEEP_AT_STOP) != 0u, OUTPUTS_CLEARED);
    case MACHINE_READY:
        return follow_or(!ends_now(before, machine), OUTPUTS_CLEARED);
    case MACHINE_BOOT: /* the configuration of a module begins with its outputs off */
        return OUTPUTS_CLEARED;
    default:
        return follow_or((behaviour & CONFIG_OUTPUTS_KEEP_AT_FAULT) != 0u, OUTPUTS_CLEARED);
    }
}

/* ---- Delay ---- */

static void put(struct outputs *outputs, const struct path_outputs_values *values)
{
    outputs->newest = (outputs->newest + 1u) % CONFIG_OUTPUTS_DELAY_MAX;
    outputs->delayed[outputs->newest] = *values;
}

/* Makes the outputs of `delay_ticks` SYNCs ago the present ones. */
static void delay(struct outputs *outputs, const struct path_outputs_values *values,
                  uint32_t delay_ticks)
{
    if (delay_ticks == 0u) {
        outputs->present = *values;
        return;
    }
    const uint32_t from = outputs->newest + CONFIG_OUTPUTS_DELAY_MAX + 1u - delay_ticks;
    outputs->present = outputs->delayed[from % CONFIG_OUTPUTS_DELAY_MAX];
    put(outputs, values);
}

static void switch_off(struct outputs *outputs)
{
    memset(outputs->delayed, 0, sizeof outputs->delayed);
    memset(&outputs->present, 0, sizeof outputs->present);
}

/* Executes the events up to the last setpoint. During a rest before a program the last setpoint belongs to its
 * predecessor: an event at the start acts with the first setpoint of the program. */
static void follow_path(struct motion *motion)
{
    if (motion->setpoints > 0u && !motion->precedes && path_outputs_active(&motion->outputs) != 0) {
        path_outputs_step(&motion->outputs, motion->point.arc_length_q40_mm,
                          feed_override_feed_q32(&motion->feed));
    }
}

void outputs_step(struct outputs *outputs, struct machine *machine, bool synced)
{
    const enum outputs_mode mode = mode_of(outputs->state_before, machine);
    outputs->state_before = machine->state;
    if (mode != OUTPUTS_CLEARED) {
        follow_path(&machine->motion);
    }
    if (mode != OUTPUTS_FOLLOW) {
        switch_off(outputs);
    } else if (synced) {
        delay(outputs, &machine->motion.outputs.values, machine->config.outputs.delay_ticks);
    }
    if (mode == OUTPUTS_CLEARED) {
        path_outputs_clear(&machine->motion.outputs);
    }
    if (machine->state == MACHINE_BOOT) {
        outputs->refresh_ticks = 0;
    } else if (outputs->refresh_ticks > 0u) {
        outputs->refresh_ticks--;
    }
}

/* ---- The frame ---- */

static bool same(const struct path_outputs_values *a, const struct path_outputs_values *b)
{
    bool equal = a->digital == b->digital;
    for (uint32_t i = 0; i < PROGRAM_ANALOGUES; ++i) {
        equal = equal && a->analogue[i] == b->analogue[i];
    }
    return equal;
}

bool outputs_due(const struct outputs *outputs, const struct config_outputs *config,
                 struct can_msg *out)
{
    if (outputs->refresh_ticks > 0u && same(&outputs->present, &outputs->sent)) {
        return false;
    }
    const struct pdo_outputs outputs_pdo = {
        .digital = outputs->present.digital,
        .analogue = outputs->present.analogue,
        .digital_bytes = config->digital_count / 8u,
        .analogue_count = config->analogue_count,
    };
    pdo_encode_outputs(config->node, &outputs_pdo, out);
    return true;
}

void outputs_sent(struct outputs *outputs)
{
    outputs->sent = outputs->present;
    outputs->refresh_ticks = OUTPUTS_REFRESH_TICKS;
}
