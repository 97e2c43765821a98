/* SPDX-License-Identifier: MIT */
#include "canopen/sdo_abort.h"
#include "node/drive_node_private.h"

enum { MOTOR, SHAFT }; /* 0x6091 subs 1, 2 */
enum { FEED, TURNS };  /* 0x6092 subs 1, 2 */

static double drive_node_mm_per_turn(const struct drive_node *node)
{
    return 6.283185307179586476925 * node->axis.config.plant.screw_mm_rad;
}

double drive_node_scale_feed(const struct drive_node *node)
{
    return drive_node_mm_per_turn(node) * (double)node->axis.config.counts_per_mm;
}

/* The feed constant that the model comes with, as whole counts. */
static uint64_t drive_node_own_feed(const struct drive_node *node)
{
    return (uint64_t)(drive_node_scale_feed(node) + 0.5);
}

/* Counts per mm; 0: as the model comes, which no ratio of whole numbers gives exactly. */
static double drive_node_scale(const struct drive_node *node, const uint32_t gear[2],
                               const uint32_t feed[2])
{
    if (gear[MOTOR] == gear[SHAFT] && feed[FEED] == drive_node_own_feed(node) * feed[TURNS]) {
        return 0.0;
    }
    const double shaft = (double)gear[SHAFT] / (double)gear[MOTOR];
    return (double)feed[FEED] / (double)feed[TURNS] * shaft / drive_node_mm_per_turn(node);
}

/* The encoder is part of the motor: it can be confirmed, not changed. */
static uint32_t drive_node_encoder_write(const struct drive_node *node, uint8_t sub, uint32_t value)
{
    const uint32_t own = sub == 1 ? node->axis.config.encoder_counts_per_rev : 1u;
    return value == own ? SDO_OK : SDO_ABORT_VALUE;
}

uint32_t drive_node_scale_write(struct drive_node *node, const struct od_entry *entry,
                                uint32_t value)
{
    const bool is_gear = entry->index == OD_DRIVE_GEAR_RATIO;
    uint32_t gear[2] = {node->values.gear_ratio[MOTOR], node->values.gear_ratio[SHAFT]};
    uint32_t feed[2] = {node->values.feed_constant[FEED], node->values.feed_constant[TURNS]};
    uint32_t *changed = &(is_gear ? gear : feed)[entry->sub == 2 ? 1 : 0];
    if (entry->index == OD_DRIVE_POSITION_ENCODER_RESOLUTION) {
        return drive_node_encoder_write(node, entry->sub, value);
    }
    if (!is_gear && entry->index != OD_DRIVE_FEED_CONSTANT) {
        return SDO_OK;
    }
    if (*changed == value) {
        return SDO_OK;
    }
    if (cia402_device_action(&node->device) != CIA402_POWER_OFF ||
        !axis_motion_at_rest(&node->axis)) {
        return SDO_ABORT_STATE;
    }
    *changed = value;
    return axis_motion_set_scale(&node->axis, drive_node_scale(node, gear, feed)) ? SDO_OK
                                                                                  : SDO_ABORT_VALUE;
}
