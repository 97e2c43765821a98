/* SPDX-License-Identifier: MIT */
/*
 * hub: CAN buses for the processes of one computer, without kernel CAN, in real or in virtual time. Used by hub/main
 * (hodograph-hub). One thread. It makes the sockets of the buses in the file system and nothing else outside of struct
 * hub.
 *
 * The messages between processes and hub are in port/linux/local_bus.h. Each frame that a member sends goes to all
 * other members of its bus, in one order.
 *
 * In real time a frame goes at once. A member that does not take its frames loses those for which its buffer of some
 * megabytes has no room; the others do not wait for it.
 *
 * In virtual time a frame takes the time of its bits (frame_bits.h), and a bus carries one frame at a time. Of the
 * waiting frames the lowest identifier goes first (CAN arbitration), also among those of one member, as in the
 * mailboxes of a CAN controller; equal identifiers keep their order. A frame that is sent at the end of another one
 * goes after those that waited for this end. Frames are lost only if a member has more than HUB_QUEUE of them waiting.
 * Time advances when every participant waits (virtual_time.h).
 *
 * A process that waits does not read. So the hub holds the frames for its members until its grant, and wakes it when
 * they fill half of HUB_HELD. It never waits for room in the socket of a member that has a participant; frames without
 * room are held until the next grant. A suspended process loses the frames that come when HUB_HELD is full. A member
 * without a participant, such as a recorder, reads at any time: the hub waits for it.
 */
#ifndef HUB_HUB_H
#define HUB_HUB_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "hub/virtual_time.h"
#include "port/linux/local_bus.h"

#define HUB_BUSES       4u    /* of one hub, at most, as all that follow */
#define HUB_CONNECTIONS 64u   /* of all buses, with the participants */
#define HUB_QUEUE       2048u /* frames of a member that wait for the bus */
#define HUB_HELD        2048u /* frames for a member, before its participant wakes */
#define HUB_UNPOLLED    64u   /* grants between two polls of all connections, at most */

struct hub_options {
    bool is_virtual;
    uint32_t bitrate; /* of each bus, bit/s, in virtual time */
    double speed;     /* the most virtual time per real time; 0: no limit */
};

/* Frames of a member that wait for the bus. */
struct hub_queue {
    struct can_frame frames[HUB_QUEUE];
    size_t first;
    size_t count;
};

/* Virtual time: frames for a member, which it gets with the next grant of its participant. */
struct hub_held {
    struct local_bus_frame frames[HUB_HELD];
    size_t first;
    size_t count;
};

/* Kind of a connection (port/linux/local_bus.h). */
enum hub_role {
    HUB_UNKNOWN,    /* no hello yet */
    HUB_MEMBER,     /* sends and receives frames of a bus */
    HUB_PARTICIPANT /* takes part in virtual time */
};

struct hub_connection {
    int fd; /* -1: not in use */
    enum hub_role role;
    unsigned bus;
    uint32_t number; /* member: of the participant that it wakes; participant: its own; 0: none */
    struct can_filter filters[LOCAL_BUS_FILTERS]; /* none: all frames pass */
    size_t filter_count;
    struct can_filter deferred[LOCAL_BUS_FILTERS]; /* frames that do not wake its participant */
    size_t deferred_count;
    struct can_filter tracked[LOCAL_BUS_FILTERS]; /* frames of its own that come back to it */
    size_t tracked_count;
    struct hub_queue queue;
    struct hub_held held;
};

/* A bus in virtual time. */
struct hub_bus {
    struct can_frame frame; /* on the wire */
    size_t sender;          /* its connection */
    uint64_t end_ns;        /* its last bit */
    bool busy;
};

struct hub {
    struct hub_options options;
    int listeners[HUB_BUSES];
    size_t bus_count;
    struct hub_bus buses[HUB_BUSES];
    struct hub_connection connections[HUB_CONNECTIONS];
    size_t used; /* connections from this one on are not in use */
    struct virtual_time time;
    uint64_t pace_real_ns;          /* where speed is limited: an instant of real time, */
    uint64_t pace_virtual_ns;       /* and that of virtual time which may not come before it */
    bool poll_all;                  /* members of participants that compute are polled as well */
    struct hub_connection *granted; /* the only participant that computes; or NULL */
    unsigned unpolled;              /* grants since the last poll of all connections */
    uint64_t lost;                  /* frames that found no room */
};

/* Makes a socket at each of these paths and serves a bus there. It replaces a socket that no process serves (left by a
 * hub that was killed). 0, or a negative errno with the index of the path that failed in `*failed`: -EADDRINUSE if a
 * hub serves the path, or if it is not a socket. */
int hub_open(struct hub *hub, const char *const *paths, size_t count, struct hub_options options,
             size_t *failed);

/* Waits for the next event and handles it. False: `end` has become readable, or no event can follow. */
bool hub_step(struct hub *hub, int end);

/* Closes the buses and the connections of all their members. */
void hub_close(struct hub *hub);

#endif
