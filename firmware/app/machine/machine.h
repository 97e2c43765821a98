/* SPDX-License-Identifier: MIT */
/*
 * machine: the state of the machine (object 0x2002), the commands that change it, and its step in each tick.
 *
 *   BOOT -> OFF -> ENABLING -> READY -> RUNNING -> READY        any -> FAULT -> BOOT
 *                                       RUNNING -> STOPPING -> READY
 *                                       RUNNING -> HOLDING -> HELD -> RUNNING, STOPPING
 *           OFF -> HOMING -> OFF        any with drives on -> QUICK_STOP -> OFF
 *
 * The state changes in three places: requests (main loop, under the lock; machine_requests.c), the timer's functions
 * (machine_tick.c, machine_supervise.c), and faults (machine_fault.c). Used by firmware/app. Guarded by the port's lock
 * as a whole. Files use each other in one direction: tick, supervise and requests -> fault -> drives -> machine. The
 * functions change only the machine; no I/O.
 */
#ifndef APP_MACHINE_MACHINE_H
#define APP_MACHINE_MACHINE_H

#include <stdbool.h>
#include <stdint.h>

#include "app/machine/axis.h"
#include "app/machine/config.h"
#include "app/machine/fault.h"
#include "app/machine/motion.h"
#include "app/machine/statistics.h"

/* Values of object 0x2002. */
enum machine_state {
    MACHINE_BOOT = 0,        /* drives not yet found or configured */
    MACHINE_OFF = 1,         /* drives configured, not enabled */
    MACHINE_ENABLING = 2,    /* drives are being enabled, then READY */
    MACHINE_READY = 3,       /* enabled, standstill */
    MACHINE_RUNNING = 4,     /* a program runs, or the axes settle at its last point */
    MACHINE_STOPPING = 5,    /* the same for a stop along the path */
    MACHINE_FAULT = 6,       /* see enum machine_fault_phase; ends by a reset */
    MACHINE_HOLDING = 7,     /* a feed hold brakes the path, or the program ended first */
    MACHINE_HELD = 8,        /* at standstill on the path until resumed or stopped */
    MACHINE_HOMING = 9,      /* drives home by their own motion, controlled by the main loop */
    MACHINE_QUICK_STOP = 10, /* all drives brake by their own ramps; then OFF */
};

/* Phases of FAULT. */
enum machine_fault_phase {
    MACHINE_FAULT_BRAKING,   /* every drive follows: stop along the path, settle */
    MACHINE_FAULT_QUICK,     /* else: quick stop of all drives that still receive; targets stay */
    MACHINE_FAULT_OFF,       /* drives are switched off; waits for the reset */
    MACHINE_FAULT_RESETTING, /* drives are being reset; then BOOT, or OFF when the cause persists */
};

/* Why a request was refused: values of object 0x2003 sub 4. */
enum machine_refusal {
    MACHINE_ACCEPTED = 0,
    MACHINE_NO_PROGRAM = 1,       /* neither a program nor a job to start */
    MACHINE_AWAY_FROM_START = 2,  /* an axis is further from the start than its start tolerance */
    MACHINE_MOVING = 3,           /* not while axes move */
    MACHINE_DRIVES_OFF = 4,       /* the drives have to be enabled first */
    MACHINE_FAULT_PRESENT = 5,    /* the fault has to be reset first */
    MACHINE_DRIVES_MISSING = 6,   /* not all drives are found and configured */
    MACHINE_OUTSIDE_LIMITS = 7,   /* the program breaks limits of the present configuration */
    MACHINE_NOT_RUNNING = 8,      /* there is nothing to hold or resume */
    MACHINE_DRIVES_ON = 9,        /* homing needs them off */
    MACHINE_NO_HOMING_MODE = 10,  /* the drive of an axis with a homing method has no homing mode */
    MACHINE_NOTHING_TO_HOME = 11, /* no axis has a homing method */
    MACHINE_NOT_CONFIGURED = 12,  /* neither configured since power-on nor restored */
    MACHINE_AXES_MISSING = 18,    /* the program has more path axes than are configured */
    MACHINE_NOT_HOMED = 13,       /* an axis with a homing method has no zero */
    MACHINE_ENDING = 17,          /* the controller is being shut down */
    MACHINE_NOT_IN_TIME = 16,   /* drives are real, and the port does not guarantee ticks in time */
    MACHINE_JOB_STARTED = 19,   /* a job starts once, at its beginning */
    MACHINE_OTHER_PROGRAM = 20, /* not the program or job that the start names */
    MACHINE_STOPPED = 21,       /* a stop was commanded since the host prepared this start */
    MACHINE_OUTSIDE_TRAVEL = 22, /* an axis is outside its travel: its drive would move it there */
};

#define MACHINE_SETTLE_TICKS 200u  /* after the last setpoint */
#define MACHINE_ENABLE_TICKS 2000u /* time for the drives to switch on */
#define MACHINE_QUICK_TICKS  2000u /* time for the drives to end a quick stop */
#define MACHINE_RESET_TICKS  500u  /* time for the drives to leave their faults */
#define MACHINE_ANSWER_TICKS 5000u /* time for configured drives to answer a SYNC */
/* ticks in a row in which the port may refuse frames, or still have those of the tick before */
#define MACHINE_UNSENT_MAX 3u

/* While the main loop stalls, no command is executed and no heartbeat is sent. The axes are stopped on the path before
 * the drives stop for missing heartbeats, or a watchdog restarts the processor. */
#define MACHINE_MAIN_LOOP_STALL_US 1000000u

#define MACHINE_ARRIVE_TICKS 2000u /* time for the axes to reach their targets after settling */

/* Real drives do not wait for a SYNC that is late by more than a period: they extrapolate, or stop. The eighth of a
 * period is for the jitter of a SYNC. */
#define MACHINE_GAP_US(period_us) (2u * (period_us) + (period_us) / 8u)

/* A drive that is found again keeps its zero only if it is within this distance of its last known position. */
#define MACHINE_KEPT_UNITS 1u /* mm, degrees */

/* Ticks never wait for real drives: an answer that is later than this is missed. */
#define MACHINE_REAL_WAIT_MAX_MS 5u

struct machine {
    struct config config;
    struct axis axes[AXES_MAX]; /* config.axis_count of them */
    struct motion motion;
    struct statistics statistics;
    struct fault fault;
    uint32_t fault_serial; /* counts every change of `fault` */
    enum machine_state state;
    enum machine_fault_phase fault_phase; /* in FAULT */
    uint32_t ticks_left;         /* settling, enabling, quick stop, resetting, first answers */
    uint32_t override_percent;   /* commanded, object 0x2010 sub 1; for every program */
    uint32_t main_loop_stall_us; /* ticks times period since the last round of the main loop */
    uint32_t sync_us;            /* time of the last SYNC */
    uint32_t unsent_ticks;       /* in a row with a frame that the port refused */
    uint32_t sync_left_us;       /* time of the last SYNC that has left */
    /* since the settling time of a motion ended with an axis away from its target */
    uint32_t arriving_ticks;
    bool sync_sent;      /* the last SYNC has left */
    bool sync_now;       /* the SYNC of this tick has left */
    bool sync_waits;     /* this tick has none: frames of the last tick still wait */
    bool setpoints_sent; /* all setpoints after the last SYNC have left */
    /* no new setpoint in this tick: its SYNC, or a setpoint before it, has not left */
    bool clock_paused;
    bool simulated;  /* every drive is a simulated one: the port may let ticks wait for them */
    bool configured; /* drives are configured; BOOT then waits for their first answers */
    /* state BOOT again: this node was started and did not answer; 0: none */
    uint8_t unresponsive_node;
    bool boot_due; /* the main loop has to find and configure the drives */
    /* homing was interrupted: the drives have to be configured anew after the quick stop */
    bool mode_left;
    bool unhomed_allowed; /* the next start is accepted although axes are not homed */
    /* the outputs stay on at the end of this motion, whatever the configuration: the host's job goes on after it */
    bool outputs_stay;
    uint32_t stop_commands; /* stop, quick stop and disable commands since power-on */
    /* bit i: axis i + 1 has a homing method, and was not homed when this program started */
    uint8_t unhomed_axes;
};

void machine_init(struct machine *machine, const struct config *config);

/* --- Requests, main loop under the lock. MACHINE_ACCEPTED, or the reason of the refusal; then nothing has changed. ---
 */

enum machine_refusal machine_enable(struct machine *machine);
enum machine_refusal machine_disable(struct machine *machine);
/* Never refused. Where nothing runs it switches the outputs off (unless they are configured to stay) and counts as a
 * stop command, which ends a job of the host at its rest. From ENABLING it leads back to OFF, HOMING ends by a quick
 * stop. */
enum machine_refusal machine_request_stop(struct machine *machine);
/* Never refused: all drives that are on brake by their own ramps (0x6085), then OFF. In FAULT it replaces a stop along
 * the path. Without effect if the drives are off. */
enum machine_refusal machine_quick_stop(struct machine *machine);
/* Feed hold and its end; accepted as well when there is nothing to change. */
enum machine_refusal machine_hold(struct machine *machine);
enum machine_refusal machine_resume(struct machine *machine);
/* From FAULT to BOOT; refused while a drive still brakes. From OFF to BOOT as well: the drives are found and configured
 * anew. In other states without effect. */
enum machine_refusal machine_reset(struct machine *machine);
/* Axes with a homing method (0x2012) that are not homed: bit i for axis i + 1. Pure. */
uint8_t machine_unhomed(const struct machine *machine);
/* Starts a prepared motion whose first setpoint is at start_counts: copied, if the axes are enabled, stand still and
 * are within the configured tolerance. */
enum machine_refusal machine_start(struct machine *machine, const struct motion *prepared,
                                   const int32_t start_counts[AXES_MAX]);

/* Takes over the next chunk of a job (motion_take_over). False: it cannot be taken over now. A held path stays held.
 * After a stop, and in a fault, nothing is taken over. */
bool machine_take_over(struct machine *machine, const struct chunk *next,
                       const struct coefficients_window *window);

/* Homing, from OFF to OFF. In between the main loop sets each axis's `goal` and `control_extra`
 * (under the lock); the targets follow the positions. Homing has failed if the state has left HOMING
 * before machine_end_homing, which then changes nothing. */
enum machine_refusal machine_begin_homing(struct machine *machine);
void machine_end_homing(struct machine *machine);

/* Outputs at standstill with the drives on (READY), until the next start. False: not now, or there is no I/O module.
 * Main loop, under the lock. */
bool machine_set_outputs(struct machine *machine, const struct path_outputs_values *values);

/* The feed override, 0 ... 200 per cent, at any time. Under the lock. */
void machine_override(struct machine *machine, uint32_t percent);

/* True if 0x1006 and 0x2004 ... 0x2007 may be written: BOOT, OFF, FAULT with the axes at standstill. */
bool machine_configurable(const struct machine *machine);
/* True while setpoints come from the program: from start until READY, and while braking on the path in a fault. */
bool machine_on_path(const struct machine *machine);
/* The same, or the drives move by themselves: homing, quick stop. The program must not change. */
bool machine_moving(const struct machine *machine);

/* True at the end of a tail: the motion continues when the next chunk of the job is taken over. */
bool machine_waits_for_chunk(const struct machine *machine);

/* Sets a new configuration, only if machine_configurable. `drives`: it concerns the drives, so BOOT is next. */
void machine_configure(struct machine *machine, const struct config *config, bool drives);
/* To BOOT: the main loop has to find and configure the drives. Which of them are homed is kept. Under the lock. */
void machine_enter_boot(struct machine *machine);
/* The main loop has found and configured all drives and started them (NMT): BOOT -> OFF as soon as each has answered a
 * SYNC. If one does not, they are configured and started anew. Under the lock. */
void machine_drives_configured(struct machine *machine, bool simulated);

/* Raises a fault: FAULT, with a stop along the path if a program runs and every drive follows, else with a quick stop.
 * Only the first fault is kept. A further one changes the path stop to a quick stop if a drive does not follow. Any
 * context, under the lock. */
void machine_raise(struct machine *machine, uint16_t code, uint8_t node, uint32_t detail);

/* Stores the emergency code that a drive has sent. It replaces a less exact code of the present fault. Main loop under
 * the lock. */
void machine_note_emergency(struct machine *machine, uint8_t node, uint16_t code);

/* In FAULT: ends every stop and switches the drives off; those that do not answer get the command for a quick stop
 * until the reset. Any context, under the lock. */
void machine_switch_off(struct machine *machine);

/* --- Timer --- */

/* Closes the SYNC before this tick: counts missing answers, supervises the drives. */
void machine_supervise(struct machine *machine, uint32_t now_us);
/* The SYNC of a tick. */
enum machine_sync {
    MACHINE_SYNC_SENT,    /* queued; no other frame of the controller waits for the bus */
    MACHINE_SYNC_REFUSED, /* the port had no room */
    MACHINE_SYNC_WAITS, /* not made: frames of the last tick still wait, and this tick sends nothing */
};
/* First in a tick. Without a SYNC, or if the port refused a setpoint of the last tick, the program clock is paused: a
 * drive never gets a step larger than the program's. With real drives that follow, a longer time than MACHINE_GAP_US
 * since the last SYNC is a fault with a quick stop, because they have left the path. */
void machine_note_sync(struct machine *machine, uint32_t now_us, enum machine_sync sync);
/* What has left in a tick. */
struct machine_sent {
    bool sync;
    bool setpoints; /* every one */
    bool all;       /* offsets too */
};
/* Last in a tick. More than MACHINE_UNSENT_MAX ticks in a row with a refused frame are a fault when drives are on. */
void machine_note_sent(struct machine *machine, struct machine_sent sent);
/* The same for a tick that sends nothing. It counts as one with a refused frame. With simulated drives, for which ticks
 * may wait, it counts only after twice the time that answers may be late without a SYNC. */
void machine_note_waiting(struct machine *machine, uint32_t now_us);
/* Executes one tick: states, goals and targets of the axes. */
void machine_step(struct machine *machine);
/* Counts ticks_left down; true when it is 0. */
bool machine_time_is_up(struct machine *machine);
/* How long answers may be late, from the configuration. */
uint32_t machine_answer_wait_us(const struct machine *machine);
/* Whether every drive has answered a SYNC since BOOT began. */
bool machine_drives_answer(const struct machine *machine);
/* Whether setpoints are to be sent in this state. */
static inline bool machine_drives_operational(const struct machine *machine)
{
    return machine->state != MACHINE_BOOT;
}
/* Whether the next tick should wait for the drives' answers: they are simulated and not all lost; and, if frames wait
 * for the bus, some have not answered yet. */
bool machine_awaits_drives(const struct machine *machine);
/* Whether at fast pace the next tick should come as soon as the drives have answered: while something moves, switches
 * or is awaited. */
bool machine_busy(const struct machine *machine);

/* --- Receive --- */

/* Takes the TPDO1 of a node; true when all drives have now answered the present SYNC. */
bool machine_receive(struct machine *machine, uint8_t node, const struct pdo_actual *actual,
                     uint32_t now_us);

/* A round of the main loop has begun. Under the lock. */
static inline void machine_note_main_loop(struct machine *machine)
{
    machine->main_loop_stall_us = 0;
}

/* The axis of a node, or NULL. Pure. */
struct axis *machine_axis(struct machine *machine, uint8_t node);

#endif
