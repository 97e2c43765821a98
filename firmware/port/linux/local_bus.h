/* SPDX-License-Identifier: MIT */
/*
 * local_bus: the messages between a process and hodograph-hub (docs/reference/virtual-time.md). Data only. Used by
 * port/linux and sim/hub.
 *
 * A connection is a UNIX socket of type SOCK_SEQPACKET to the path of a bus; a message is one packet, in the byte order
 * of the machine. There are two kinds of connection:
 *
 *   member       sends and receives the frames of one bus. It sends struct can_frame of linux/can.h, and receives
 *                one to LOCAL_BUS_PACKET struct local_bus_frame in a packet: one in real time, in virtual time what its
 *                participant finds when it wakes. It may set filters at any time.
 *   participant  takes part in virtual time. One for each thread of control of a simulation.
 *
 * The first message on a connection is a hello, and the hub answers it with a welcome. In real time the hub passes
 * frames on as they come, and there are no participants. In virtual time the hub owns the clock: a participant computes
 * in zero time from a grant to its next wait, and time advances when all of them wait. They get their grants one after
 * the other, so all their work is one sequence, which depends on their inputs alone.
 */
#ifndef PORT_LINUX_LOCAL_BUS_H
#define PORT_LINUX_LOCAL_BUS_H

#include <stdint.h>

#include <linux/can.h>

#define LOCAL_BUS_MARK                                                                             \
    0xFFFFFFFFu /* not the identifier of a frame: distinguishes messages from frames */
#define LOCAL_BUS_VERSION 3u
#define LOCAL_BUS_NAME    32u /* bytes of a name with its end */
#define LOCAL_BUS_FILTERS 48u
#define LOCAL_BUS_PACKET  8u /* frames */
#define LOCAL_BUS_NEVER   UINT64_MAX

/* The name of a participant, set by the program that has started it. */
#define LOCAL_BUS_NAME_VARIABLE "HODOGRAPH_PARTICIPANT"

/* In frame.__res0 of a frame that comes back to the member that has sent it (LOCAL_BUS_TRACK); 0 in all others. */
#define LOCAL_BUS_OWN 1u

/* A frame as a member receives it. */
struct local_bus_frame {
    struct can_frame frame;
    uint64_t time_ns; /* of the last bit: virtual time, or in real time nanoseconds since 1970 */
};

enum local_bus_kind {
    /* From a process. */
    LOCAL_BUS_HELLO_MEMBER = 1,      /* number: the participant that its frames wake, 0: none */
    LOCAL_BUS_HELLO_PARTICIPANT = 2, /* name; flags: NOTICES */
    LOCAL_BUS_FILTER = 3,            /* of a member: frames that it receives (local_bus_filters) */
    /* of a member: frames that do not wake its participant, unless it waits for ALL */
    LOCAL_BUS_DEFER = 4,
    /* of a member: frames of its own that come back to it when their last bit is sent, in virtual time; they do
     * not wake its participant */
    LOCAL_BUS_TRACK = 8,
    LOCAL_BUS_WAIT = 5,     /* number: of the last grant; flags: SENT, ALL; time_ns: when to wake
                                  * it, or before it with a frame */
    LOCAL_BUS_SUSPEND = 6,  /* name: it gets no more grants, as if its processor stood still */
    LOCAL_BUS_CONTINUE = 7, /* name: it gets them again */
    /* From the hub. */
    LOCAL_BUS_WELCOME = 16,     /* flags: VIRTUAL; number: yours, as a participant; time_ns: now */
    LOCAL_BUS_GRANT = 17,       /* number: of this grant; time_ns: now */
    LOCAL_BUS_JOINED = 18,      /* notice, as the next two: name: a participant that has joined */
    LOCAL_BUS_LEFT = 19,        /* one that has left */
    LOCAL_BUS_INTERRUPTED = 20, /* one that continues before its time, because of a signal */
};

enum local_bus_flag {
    LOCAL_BUS_NOTICES =
        1, /* hello: requests notices of processes that join, leave or get signals */
    LOCAL_BUS_VIRTUAL = 2, /* welcome: time is virtual */
    LOCAL_BUS_SENT = 4,    /* wait: its members have sent something since the last one */
    LOCAL_BUS_FRAMES = 8,  /* grant: frames have come */
    LOCAL_BUS_ALL = 16,    /* wait: frames that its members defer wake it too */
};

struct local_bus_control {
    uint32_t mark; /* LOCAL_BUS_MARK */
    uint16_t kind;
    uint16_t flags;
    uint32_t number;
    uint32_t version; /* LOCAL_BUS_VERSION: others are not understood */
    uint64_t time_ns;
    char name[LOCAL_BUS_NAME];
};

/* As in CAN_RAW_FILTER: a frame passes a filter if (frame ^ id) & mask is 0, flags of linux/can.h included. Without
 * filters every frame passes. */
struct local_bus_filters {
    uint32_t mark;
    uint16_t kind; /* LOCAL_BUS_FILTER, LOCAL_BUS_DEFER or LOCAL_BUS_TRACK */
    uint16_t count;
    struct can_filter filters[LOCAL_BUS_FILTERS]; /* the packet ends after `count` of them */
};

#endif
