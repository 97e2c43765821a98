/* SPDX-License-Identifier: MIT */
/*
 * controller_state: struct controller, the whole state of the controller, and what commands, objects and report share:
 * sending a frame, the heartbeat, what long work does meanwhile, and whether axes move. controller.c initialises the
 * struct, runs the main loop on it and shuts it down. Used by firmware/app, except its folders.
 *
 * All functions: main loop; those that send may wait 20 ms. The timer and receive interrupts use the first part of the
 * struct, under the port's lock.
 */
#ifndef APP_CONTROLLER_STATE_H
#define APP_CONTROLLER_STATE_H

#include <stdbool.h>
#include <stdint.h>

#include "app/drives/drive_boot.h"
#include "app/drives/drive_monitor.h"
#include "app/drives/drive_polling.h"
#include "app/drives/homing.h"
#include "app/frame_queue.h"
#include "app/machine/machine.h"
#include "app/parameter_store.h"
#include "app/program_slot.h"
#include "app/stream.h"
#include "app/tick.h"
#include "canopen/emcy.h"
#include "canopen/heartbeat.h"
#include "canopen/nmt.h"
#include "canopen/od.h"
#include "canopen/sdo_server.h"
#include "od_controller.h"

/* Which configuration (machine, drives, limits) is valid: its CRC-32, if `known`. */
struct configured {
    bool known;    /* confirmed by the host, or restored */
    bool restored; /* from the parameter store; known only if the host had confirmed it */
    uint32_t crc32;
};

struct controller {
    /* shared with the interrupts, under the port's lock */
    struct machine machine;
    struct tick tick;
    struct frame_queue queue;
    bool checks_chunk; /* the main loop checks a chunk of a job; axes may move meanwhile */
    /* stop commands received while checks_chunk, one bit for each enum command; the same frames also wait in `queue` */
    uint16_t urgent;
    /* main loop only */
    struct config config; /* the same values as machine.config */
    struct configured configured;
    struct parameter_store store;
    struct program_slot slot;
    struct stream stream;
    struct drive_boot boot;
    struct drive_monitor monitor;
    struct drive_polling polling;
    struct homing homing;
    struct od od;
    struct od_controller values;
    struct sdo_server server;
    struct nmt_slave nmt;
    struct heartbeat_producer heartbeat;
    struct emcy_producer emcy;
    uint32_t polled_us;             /* port_time_us() of the last poll */
    uint32_t quiet_us;              /* so long no heartbeat is sent, unless it is configured */
    bool quiet_due;                 /* such a pause follows the next heartbeat */
    uint32_t reported_serial;       /* machine.fault_serial of the last EMCY */
    enum machine_state noted_state; /* last logged state of the machine, */
    enum cia402_state noted_drive[AXES_MAX]; /* of the drives, */
    struct drive_trouble noted_trouble;      /* and last logged trouble of a drive */
    enum machine_refusal refusal;            /* why the last command was refused */
    bool ending;                /* the shutdown has begun: nothing may be switched on or started */
    uint8_t node;               /* node number of the controller */
    bool limit_noted[AXES_MAX]; /* statusword bit 11, internal limit, was logged and is still set */
};

/* Whether the configuration is unchanged since the host confirmed it or it was restored. Otherwise nothing may be
 * switched on. */
bool controller_configured(const struct controller *controller);

/* Whether axes move (machine_moving). Takes the port's lock. */
bool controller_moving(const struct controller *controller);

/* After a power-on, or a reset, without a stored configuration the controller does not know its I/O module. So a pause
 * follows its first heartbeat, which it sends at once after the boot-up message. In the pause a module that it has
 * configured before misses the heartbeats and switches its outputs off. (A consumer that has received the boot-up
 * message waits for a first heartbeat. A drive that is configured in the pause does so, too.) */
#define CONTROLLER_QUIET_US ((DRIVE_CONTROLLER_TIMEOUT_MS + 500u) * 1000u)

/* Sends the heartbeat if it is due. elapsed_us: since the last call. */
void controller_heartbeat(struct controller *controller, uint32_t elapsed_us);

/* To be called at each step of long work in the main loop, such as the check of a program: sends the heartbeat if it is
 * due and calls port_progress(). `self`: the controller. */
void controller_beat(void *self);

/* Called before and after the check of a chunk. Stop commands that arrive during the check take effect at once. */
void controller_check_begins(struct controller *controller);
void controller_check_ends(struct controller *controller);

/* The node is its own NMT master: from PRE-OPERATIONAL to OPERATIONAL. */
void controller_start_itself(struct controller *controller);

/* Sends a frame. If the send queue of the port stays full for 20 ms, the frame is lost: SDO, heartbeat and EMCY
 * tolerate a lost frame. */
void controller_send(const struct can_msg *message);

#endif
