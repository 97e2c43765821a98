/* SPDX-License-Identifier: MIT */
/* influence: all that acts on an axis in addition to its setpoints: offsets of a feedforward, load, friction, brake, a
 * weak supply, a faulty encoder. Used by sim/node and sim/offline. docs/theory/drives.md section 13.
 *
 * drive.h computes an axis without any of these. After influence_none, influence_period gives the same bits as
 * drive_period. The functions change the given structs only; any thread.
 */
#ifndef HODOGRAPH_PLANT_INFLUENCE_H
#define HODOGRAPH_PLANT_INFLUENCE_H

#include <stdbool.h>
#include <stdint.h>

#include "plant/drive.h"

struct influence {
    double speed_offset_rad_s; /* added to the loop's speed reference */
    double volts_offset;       /* added to the loop's output, before the limit */
    double volts_limit;        /* of the output; less than configured with a weak supply */
    double
        load_volts; /* of the load torque; a positive one brakes a motion in positive direction */
    double friction_volts;    /* of Coulomb friction, 0 or more; holds a standing axis */
    double encoder_offset_mm; /* error of the reading */
    double encoder_frozen_mm; /* the reading while encoder_frozen */
    bool encoder_frozen;
};

/* Resets all influences: the drive acts as configured. */
void influence_none(struct influence *influence, const struct drive_config *config);

/* Whether an influence acts, so that influence_period has to be called in place of drive_period. */
bool influence_acts(const struct influence *influence, const struct drive *drive);

/* The feedforward of the periods that follow: 0x60B1 in bus counts a second, 0x60B2 in per mille of
 * the rated torque. */
void influence_offsets(struct influence *influence, const struct drive *drive,
                       const struct drive_config *config, int32_t speed_counts_s,
                       int16_t torque_permille, double rated_torque_nm);

/* The position that the drive reads, mm; and in bus counts, rounded and saturated. */
double influence_read_mm(const struct influence *influence, const struct drive *drive);
int32_t influence_read_counts(const struct influence *influence, const struct drive *drive);

/* drive_period with this influence. The axis parks only if nothing except friction acts. */
void influence_period(const struct influence *influence, struct drive *drive,
                      int32_t target_counts);

/* One period without power: only load, friction and brake act on the axis (brake_volts as friction_volts). The drive's
 * target follows the reading. Returns true when the axis is at standstill. */
bool influence_coast(const struct influence *influence, struct drive *drive, double brake_volts);

/* One bus period in which the motor brakes with `volts` (more than 0; limited to those in force) until it stands; then
 * the loop restarts. True when the axis is at standstill. */
bool influence_brake(const struct influence *influence, struct drive *drive, double volts);

#endif
