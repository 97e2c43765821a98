/* SPDX-License-Identifier: MIT */
/*
 * nmt: network management (CiA 301, 7.2.8 and 7.3.2): the state machine of a slave, and the frames of the master's
 * commands. The controller is master and slave, each simulated drive a slave. Used by firmware/app, canopen/heartbeat
 * and sim/node. No I/O: the caller sends.
 *
 * A slave is used by the receive interrupt (nmt_slave_receive) and the main loop (all other functions); both may run at
 * any time, because the shared fields are single words. The other functions are pure, any context.
 */
#ifndef CANOPEN_NMT_H
#define CANOPEN_NMT_H

#include <stdbool.h>
#include <stdint.h>

#include "can/can_frame.h"

/* Values as in heartbeat frames. */
enum nmt_state {
    NMT_INITIALISING = 0x00,   /* that of the boot-up frame */
    NMT_STOPPED = 0x04,        /* NMT commands and heartbeats only */
    NMT_OPERATIONAL = 0x05,    /* everything, also PDOs */
    NMT_PRE_OPERATIONAL = 0x7F /* everything except PDOs */
};

/* First byte of a command frame. */
enum nmt_command {
    NMT_START = 0x01, /* to OPERATIONAL */
    NMT_STOP = 0x02,  /* to STOPPED */
    NMT_ENTER_PRE_OPERATIONAL = 0x80,
    NMT_RESET_NODE = 0x81,         /* all objects to power-on */
    NMT_RESET_COMMUNICATION = 0x82 /* objects 0x1000 ... 0x1FFF to power-on */
};

/* Values of 0x1029 sub 1: what a communication error does. */
enum nmt_error_behaviour {
    NMT_ERROR_PRE_OPERATIONAL = 0, /* from OPERATIONAL */
    NMT_ERROR_NO_CHANGE = 1,       /* other values as well */
    NMT_ERROR_STOPPED = 2
};

/* Called by nmt_slave_process. Each may be NULL. */
struct nmt_hooks {
    void (*reset_node)(void *context); /* all values back to power-on, then communication */
    /* Communication objects 0x1000 ... 0x1FFF back to power-on. */
    void (*reset_communication)(void *context);
    void (*changed)(void *context, enum nmt_state state);
};

struct nmt_slave {
    const struct nmt_hooks *hooks;
    void *context;
    volatile enum nmt_state state; /* INITIALISING until the boot-up frame is out */
    volatile uint8_t reset_due;    /* 0, NMT_RESET_NODE or NMT_RESET_COMMUNICATION */
    enum nmt_state reported;       /* last state given to hooks->changed */
    uint8_t node;
};

/* Starts in INITIALISING. `hooks` may be NULL. Main loop, before any frame comes. */
void nmt_slave_init(struct nmt_slave *slave, uint8_t node, const struct nmt_hooks *hooks,
                    void *context);

/* Takes an NMT command for this node or for all; other frames and unknown commands are ignored. The
 * state changes at once; resets are carried out by nmt_slave_process. Returns true when it was a
 * command for this node. Receive interrupt. */
bool nmt_slave_receive(struct nmt_slave *slave, const struct can_msg *in);

/* Carries out resets, calls hooks->changed, and, from INITIALISING, gives the boot-up frame and enters PRE-OPERATIONAL.
 * Returns true when *out is to be sent. Main loop. */
bool nmt_slave_process(struct nmt_slave *slave, struct can_msg *out);

/* A communication error (heartbeat of the master lost, bus off): `behaviour` is the value of 0x1029 sub 1, enum
 * nmt_error_behaviour. Main loop. */
void nmt_slave_error(struct nmt_slave *slave, uint8_t behaviour);

/* Which services a state permits (CiA 301, table 39). */
bool nmt_permits_sdo(enum nmt_state state); /* SDO, also SYNC, EMCY: pre-operational, operational */
bool nmt_permits_pdo(enum nmt_state state); /* operational only */

/* The master's command frame; node 0 means all nodes. */
void nmt_master_command(enum nmt_command command, uint8_t node, struct can_msg *out);

#endif
