/* SPDX-License-Identifier: MIT */
/* cia402_device: the drive's side of the CiA 402 state machine. Used by the simulated drives (sim/node/servo).
 *
 * The drive reports what happens inside it (ready, fault, reaction finished), passes on each controlword, and executes
 * the action that cia402_device_action returns. Functions return true when the state changed. They change *device only.
 * All in one context, that of the drive's period. */
#ifndef CANOPEN_CIA402_DEVICE_H
#define CANOPEN_CIA402_DEVICE_H

#include <stdbool.h>
#include <stdint.h>

#include "canopen/cia402.h"

/* What the power stage and the motion control have to do now. */
enum cia402_action {
    CIA402_POWER_OFF, /* no torque */
    CIA402_HOLD, /* Switched on: powered, not following; a drive may keep its torque off here too */
    CIA402_FOLLOW,        /* Operation enabled: follow the setpoints */
    CIA402_SLOW_DOWN,     /* leaving Operation enabled (0x605B, 0x605C): stop, then
                         cia402_device_stopped */
    CIA402_STOP_QUICKLY,  /* Quick stop active: stop with 0x6085, then cia402_device_stopped */
    CIA402_STOP_FOR_FAULT /* Fault reaction by 0x605E, then cia402_device_stopped */
};

/* Option codes, from the object dictionary. */
struct cia402_options {
    int16_t quick_stop; /* 0x605A: 0 power off; 1 ... 4 stop, then Switch on disabled; 5 ... 8 stop
                           and stay */
    int16_t fault_reaction; /* 0x605E: 0 power off; 1 ... 4 stop, then Fault */
    int16_t shutdown;       /* 0x605B: 0 power off; 1 stop, then Ready to switch on */
    int16_t disable;        /* 0x605C: 0 power off; 1 stop, then Switched on */
};

struct cia402_device {
    enum cia402_state state;
    struct cia402_options options; /* may change at any time */
    uint16_t controlword;          /* last one, for edges */
    uint16_t
        flags; /* CIA402_STATUS_... bits in addition to the state; the drive sets and clears them */
    bool stopped; /* in Quick stop active: the motor has come to rest; bit 10 of the statusword */
    bool leaving; /* Operation enabled, stopping, then `leaving_to`; enabling again cancels that */
    enum cia402_state leaving_to;
    bool fault_persists; /* set by the drive: the cause is still there, a reset has no effect */
};

/* Options: 2 for quick stop and fault reaction, 0 (at once) for shutdown and disable operation. */
void cia402_device_init(struct cia402_device *device);

/* Initialisation is finished: Not ready -> Switch on disabled (transition 1). */
bool cia402_device_ready(struct cia402_device *device);

/* A controlword: transitions 2 ... 12, 15, 16. At most one transition a call. */
bool cia402_device_control(struct cia402_device *device, uint16_t controlword);

/* A fault: any state -> Fault reaction active (13), or straight to Fault when there is nothing to
 * stop. */
bool cia402_device_fault(struct cia402_device *device);

/* The stop that cia402_device_action requested is finished: transitions 5, 8, 14, or 12 if 0x605A selects it. */
bool cia402_device_stopped(struct cia402_device *device);

/* Quick stop from inside (SYNC or heartbeat lost), like transition 11. */
bool cia402_device_quick_stop(struct cia402_device *device);

/* Power off from inside (0x6007 = 2): any state with power -> Switch on disabled. */
bool cia402_device_power_off(struct cia402_device *device);

/* What to do in the present state. */
enum cia402_action cia402_device_action(const struct cia402_device *device);

/* 0x6041: state and flags. */
uint16_t cia402_device_statusword(const struct cia402_device *device);

#endif
