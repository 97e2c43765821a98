/* SPDX-License-Identifier: MIT */
/*
 * homing: command 10: each axis with a homing method (0x2012) is homed by its drive, one after the other by their
 * sequence (0x2034), from OFF to OFF:
 *
 *     off -> mode 6 -> enable -> controlword bit 4, until the drive has its zero -> disable -> mode 8 -> next axis
 *
 * Method, speeds and offset were written when the drive was configured (CiA 402-2, homing mode). The machine is in
 * state HOMING. A stop, a quick stop or a fault leaves that state and ends homing. The drives are then configured again
 * before they can be enabled, which restores mode 8.
 *
 * Called by app/controller.c and app/commands. Main loop; takes the port's lock where it changes the machine. Times are
 * counted in ticks, so they have the same meaning on a host that is too slow.
 */
#ifndef APP_DRIVES_HOMING_H
#define APP_DRIVES_HOMING_H

#include <stdbool.h>
#include <stdint.h>

#include "app/drives/drive_properties.h"
#include "app/drives/homing_mode.h"
#include "app/machine/config.h"
#include "app/machine/machine.h"
#include "can/can_frame.h"

#define HOMING_SWITCH_US 2000000u /* to switch a drive on, or off */
#define HOMING_SPARE_S   10u      /* in addition to the time for the whole travel */
#define HOMING_MAX_S     600u     /* the most that homing_time_s gives */

/* After so many SYNCs the statusword answers the new controlword: sending, latching and answering take 4, the others
 * are for lost frames. Until then "attained" may be that of an earlier homing. */
#define HOMING_SYNCS_BEFORE_ANSWER 10u

enum homing_phase {
    HOMING_IDLE,      /* no homing is under way */
    HOMING_OFF,       /* until the drive is off: the command may be a few ticks old */
    HOMING_MODE,      /* writes 0x6060 = 6, until 0x6061 is 6 */
    HOMING_ENABLE,    /* to Operation enabled */
    HOMING_MOVE,      /* the drive seeks its zero */
    HOMING_DISABLE,   /* the axis has its zero: until the drive is off */
    HOMING_MODE_BACK, /* 0x6060 = 8 */
};

struct homing {
    struct homing_mode mode;
    enum homing_phase phase;
    uint8_t axis;
    uint32_t began_syncs; /* when the phase began */
};

void homing_init(struct homing *homing);

/* Begins homing, or returns the reason of the refusal; `properties` of each axis. */
enum machine_refusal homing_begin(struct homing *homing, struct machine *machine,
                                  const struct drive_properties *properties);

/* True while homing uses the SDO channels of the drives. */
bool homing_busy(const struct homing *homing);

/* Takes a frame; ignores all except SDO responses. True when *out is to be sent. */
bool homing_receive(struct homing *homing, const struct can_msg *in, struct can_msg *out);

/* Lets time pass. True when *out is to be sent: then call again with elapsed_us 0. */
bool homing_process(struct homing *homing, struct machine *machine, uint32_t elapsed_us,
                    struct can_msg *out);

/* The longest time that the drive may seek its zero, s: the whole travel at both speeds, and HOMING_SPARE_S. Pure. */
uint32_t homing_time_s(const struct config *config, uint8_t axis);

#endif
