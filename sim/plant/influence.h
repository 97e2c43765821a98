/* SPDX-License-Identifier: MIT */
/* What acts on an axis beside its setpoints: offsets of a feedforward, load, friction, brake, a weak
 * supply, a faulty encoder. docs/theory/numerics.md section 13.
 *
 * drive.h alone computes an axis without any of these. With all figures neutral influence_period
 * gives the same bits. The functions change nothing but the structs that they are given.
 */
#ifndef HODOGRAPH_PLANT_INFLUENCE_H
#define HODOGRAPH_PLANT_INFLUENCE_H

#include <stdbool.h>
#include <stdint.h>

#include "plant/drive.h"

struct influence {
    double speed_offset_rad_s; /* added to the loop's speed reference */
    double volts_offset;       /* added to the loop's output, before the limit */
    double volts_limit;        /* in force */
    double load_volts;     /* of the load torque; positive brakes a motion in positive direction */
    double friction_volts; /* of Coulomb friction, 0 or more; holds a standing axis */
    double encoder_offset_mm; /* error of the reading */
    double encoder_frozen_mm; /* the reading while encoder_frozen */
    bool encoder_frozen;
};

/* Nothing: the drive as configured. */
void influence_none(struct influence *influence, const struct drive_config *config);

/* Whether anything acts that drive_period does not compute. */
bool influence_acts(const struct influence *influence, const struct drive *drive);

/* The feedforward of the periods that follow: 0x60B1 in bus counts a second, 0x60B2 in per mille of
 * the rated torque. */
void influence_offsets(struct influence *influence, const struct drive *drive,
                       const struct drive_config *config, int32_t speed_counts_s,
                       int16_t torque_permille, double rated_torque_nm);

/* The position that the drive reads, mm; and in bus counts, rounded and saturated. */
double influence_read_mm(const struct influence *influence, const struct drive *drive);
int32_t influence_read_counts(const struct influence *influence, const struct drive *drive);

/* drive_period under the influence. The axis parks only where nothing but friction acts. */
void influence_period(const struct influence *influence, struct drive *drive,
                      int32_t target_counts);

/* One period without power: load, friction and brake alone move the axis (brake_volts as
 * friction_volts). The drive's target follows the reading. Returns true when the axis is at rest. */
bool influence_coast(const struct influence *influence, struct drive *drive, double brake_volts);

/* One bus period in which the motor works against its own motion with so many volts (more than 0; those in force at
 * most), until it stands; from there on the loop restarts. True when the axis is at rest. */
bool influence_brake(const struct influence *influence, struct drive *drive, double volts);

#endif
