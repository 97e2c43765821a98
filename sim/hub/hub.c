/* SPDX-License-Identifier: MIT */
/* Implements hub/hub.h (see there): CAN buses for the processes of one computer, in real or virtual time. Used by
 * hub/main (hodograph-hub). One thread. It makes the sockets of the buses in the file system and nothing else outside
 * of struct hub. */
#define _GNU_SOURCE
#include "hub/hub.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#include "hub/frame_bits.h"

/* Receive buffer of a connection; packets taken from one connection before the next one has its turn; longest wait
 * between two checks of all connections. */
enum { BUFFER_BYTES = 4 * 1024 * 1024, PACKETS_AT_ONCE = 64, POLL_ALL_MS = 20 };

#define NS_PER_S      1000000000u
#define PACE_AHEAD_NS 2e6 /* of virtual time before real time, where its speed is limited */
#define PACE_LATE_NS  1e8

/* A packet from a process. */
union packet {
    struct can_frame frame;
    struct local_bus_control control;
    struct local_bus_filters filters;
    uint32_t mark;
};

static uint64_t clock_of(clockid_t clock)
{
    struct timespec now;
    (void)clock_gettime(clock, &now);
    return (uint64_t)now.tv_sec * NS_PER_S + (uint64_t)now.tv_nsec;
}

/* --- Connections --- */

/* Whether a path is the socket of a hub that was killed: no process accepts connections there. */
static bool is_left_over(const char *path, const struct stat *found)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    if (!S_ISSOCK(found->st_mode)) {
        return false;
    }
    (void)snprintf(address.sun_path, sizeof address.sun_path, "%s", path);
    const int fd = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (fd < 0) {
        return false;
    }
    const bool refused = connect(fd, (const struct sockaddr *)&address, sizeof address) != 0 &&
                         errno == ECONNREFUSED;
    (void)close(fd);
    return refused;
}

/* Locks the folder of a path, so that no two hubs that start at the same time serve one path. Returns a descriptor,
 * whose close is the unlock (also if the process is killed), or a negative errno. */
static int lock_folder(const char *path)
{
    char folder[sizeof((struct sockaddr_un *)NULL)->sun_path];
    (void)snprintf(folder, sizeof folder, "%s", path);
    char *slash = strrchr(folder, '/');
    if (slash == NULL) {
        (void)snprintf(folder, sizeof folder, ".");
    } else {
        slash[slash == folder ? 1 : 0] = '\0';
    }
    const int folder_lock = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (folder_lock < 0 || flock(folder_lock, LOCK_EX) == 0) {
        return folder_lock < 0 ? -errno : folder_lock;
    }
    const int error = -errno;
    (void)close(folder_lock);
    return error;
}

/* Binds the socket to another path, `own`, and moves it to its path when it accepts connections. */
static int serve(int fd, const struct sockaddr_un *own, const char *path)
{
    struct stat found;
    if (lstat(path, &found) == 0 && !is_left_over(path, &found)) {
        return -EADDRINUSE;
    }
    if (lstat(own->sun_path, &found) == 0 && is_left_over(own->sun_path, &found)) {
        (void)unlink(own->sun_path); /* of a hub that was killed here */
    }
    if (bind(fd, (const struct sockaddr *)own, sizeof *own) != 0) {
        return -errno;
    }
    if (listen(fd, (int)HUB_CONNECTIONS) == 0 && rename(own->sun_path, path) == 0) {
        return 0;
    }
    const int error = -errno;
    (void)unlink(own->sun_path);
    return error;
}

static int listen_at(const char *path)
{
    struct sockaddr_un own = {.sun_family = AF_UNIX};
    const int length = snprintf(own.sun_path, sizeof own.sun_path, "%s.new", path);
    if (length < 0 || (size_t)length >= sizeof own.sun_path) {
        return -ENAMETOOLONG;
    }
    const int folder_lock = lock_folder(path);
    if (folder_lock < 0) {
        return folder_lock;
    }
    const int fd = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    const int error = fd < 0 ? -errno : serve(fd, &own, path);
    (void)close(folder_lock);
    if (error != 0 && fd >= 0) {
        (void)close(fd);
    }
    return error != 0 ? error : fd;
}

int hub_open(struct hub *hub, const char *const *paths, size_t count, struct hub_options options,
             size_t *failed)
{
    memset(hub, 0, sizeof *hub);
    hub->options = options;
    virtual_time_init(&hub->time);
    for (size_t i = 0; i < HUB_CONNECTIONS; ++i) {
        hub->connections[i].fd = -1;
    }
    for (size_t i = 0; i < count; ++i) {
        const int fd = listen_at(paths[i]);
        if (fd < 0) {
            *failed = i;
            return fd;
        }
        hub->listeners[hub->bus_count++] = fd;
    }
    return 0;
}

/* In use until all frames that a member sent before it left have been sent. */
static bool in_use(const struct hub *hub, size_t at)
{
    bool sends = hub->connections[at].queue.count > 0u;
    for (size_t i = 0; i < hub->bus_count; ++i) {
        sends = sends || (hub->buses[i].busy && hub->buses[i].sender == at);
    }
    return sends || hub->connections[at].fd >= 0;
}

static void take_connection(struct hub *hub, unsigned bus)
{
    const int bytes = BUFFER_BYTES;
    const int fd = accept4(hub->listeners[bus], NULL, NULL, SOCK_CLOEXEC);
    size_t at = 0;
    while (at < HUB_CONNECTIONS && in_use(hub, at)) {
        at++;
    }
    if (fd < 0 || at == HUB_CONNECTIONS) {
        (void)close(fd);
        return;
    }
    if (setsockopt(fd, SOL_SOCKET, SO_SNDBUFFORCE, &bytes, sizeof bytes) != 0) {
        (void)setsockopt(fd, SOL_SOCKET, SO_SNDBUF, &bytes, sizeof bytes);
    }
    struct hub_connection *fresh = &hub->connections[at];
    fresh->fd = fd;
    fresh->role = HUB_UNKNOWN;
    fresh->bus = bus;
    fresh->number = 0;
    fresh->filter_count = 0;
    fresh->deferred_count = 0;
    fresh->tracked_count = 0;
    fresh->queue.count = 0;
    fresh->held.first = 0;
    fresh->held.count = 0;
    hub->used = at < hub->used ? hub->used : at + 1u;
}

/* Whether the packet has been sent; a connection that has ended is dropped later. In virtual time nothing may be lost,
 * so it waits for a process that does not take its frames. */
static bool send_packet(const struct hub *hub, int fd, const void *packet, size_t size)
{
    struct pollfd writable = {.fd = fd, .events = POLLOUT};
    ssize_t sent = send(fd, packet, size, MSG_DONTWAIT | MSG_NOSIGNAL);
    while (sent < 0 && errno == EAGAIN && hub->options.is_virtual) {
        (void)poll(&writable, 1, -1);
        sent = send(fd, packet, size, MSG_DONTWAIT | MSG_NOSIGNAL);
    }
    return sent >= 0 || errno != EAGAIN;
}

static void send_control(const struct hub *hub, int fd, uint16_t kind, uint32_t number,
                         const char *name)
{
    struct local_bus_control control = {.mark = LOCAL_BUS_MARK,
                                        .version = LOCAL_BUS_VERSION,
                                        .kind = kind,
                                        .number = number,
                                        .time_ns = hub->time.now_ns};
    control.flags = hub->options.is_virtual ? LOCAL_BUS_VIRTUAL : 0;
    if (name != NULL) {
        memcpy(control.name, name, sizeof control.name);
    }
    (void)send_packet(hub, fd, &control, sizeof control);
}

static struct hub_connection *participant_connection(struct hub *hub, uint32_t number)
{
    for (size_t i = 0; i < hub->used; ++i) {
        struct hub_connection *each = &hub->connections[i];
        if (each->fd >= 0 && each->role == HUB_PARTICIPANT && each->number == number) {
            return each;
        }
    }
    return NULL;
}

/* Notifies the participants that requested notices; a leave also ends their wait. */
static void notify(struct hub *hub, uint16_t kind, const struct participant *about)
{
    for (size_t i = 0; i < hub->time.count; ++i) {
        const struct participant *each = &hub->time.participants[i];
        const struct hub_connection *to = participant_connection(hub, each->number);
        if (each->wants_notices && each != about && to != NULL) {
            send_control(hub, to->fd, kind, about->number, about->name);
            if (kind == LOCAL_BUS_LEFT) {
                virtual_time_wake(&hub->time, each->number);
            }
        }
    }
}

static void take_packets(struct hub *hub, struct hub_connection *from, size_t most);

/* Takes the frames that a participant has sent, before time advances. */
static void take_sent(struct hub *hub, uint32_t number)
{
    for (size_t i = 0; i < hub->used; ++i) {
        struct hub_connection *each = &hub->connections[i];
        if (each->fd >= 0 && each->role == HUB_MEMBER && each->number == number) {
            take_packets(hub, each, SIZE_MAX);
        }
    }
}

static void drop_connection(struct hub *hub, struct hub_connection *gone)
{
    (void)close(gone->fd);
    gone->fd = -1;
    if (gone->role == HUB_PARTICIPANT) {
        take_sent(hub, gone->number);
        const struct participant *about = virtual_time_find(&hub->time, gone->number);
        if (about != NULL) {
            notify(hub, LOCAL_BUS_LEFT, about);
        }
        virtual_time_leave(&hub->time, gone->number);
    }
}

/* --- Frames --- */

static bool matches(const struct can_filter *filters, size_t count, const struct can_frame *frame)
{
    for (size_t i = 0; i < count; ++i) {
        if (((frame->can_id ^ filters[i].can_id) & filters[i].can_mask) == 0u) {
            return true;
        }
    }
    return false;
}

/* Sends the first frames that are held for a member, as one packet. False: it has no room now. It waits for a member
 * without a participant. Frames for a connection that has ended are dropped. */
static bool send_held(struct hub *hub, struct hub_connection *to)
{
    struct hub_held *held = &to->held;
    const size_t straight = HUB_HELD - held->first;
    size_t count = held->count < LOCAL_BUS_PACKET ? held->count : LOCAL_BUS_PACKET;
    count = count < straight ? count : straight;
    const struct local_bus_frame *packet = &held->frames[held->first];
    const size_t size = count * sizeof *packet;
    if (to->number == 0u) {
        hub->lost += send_packet(hub, to->fd, packet, size) ? 0u : count;
    } else if (send(to->fd, packet, size, MSG_DONTWAIT | MSG_NOSIGNAL) < 0 && errno == EAGAIN) {
        return false;
    }
    held->first = (held->first + count) % HUB_HELD;
    held->count -= count;
    return true;
}

/* Sends all held frames to the members of this participant; 0: to those without one. True: some had no room. */
static bool flush_all(struct hub *hub, uint32_t number)
{
    bool remains = false;
    for (size_t i = 0; i < hub->used; ++i) {
        struct hub_connection *to = &hub->connections[i];
        if (to->fd >= 0 && to->role == HUB_MEMBER && to->number == number) {
            while (to->held.count > 0u && send_held(hub, to)) {
            }
            remains = remains || to->held.count > 0u;
        }
    }
    return remains;
}

/* Holds a frame until the next grant. A process that is not due is woken before its frames fill the room. */
static void hold_frame(struct hub *hub, struct hub_connection *to,
                       const struct local_bus_frame *frame)
{
    struct hub_held *held = &to->held;
    const struct participant *owner = virtual_time_find(&hub->time, to->number);
    if (held->count == HUB_HELD) {
        hub->lost += owner == NULL || owner->suspended ? 0u : 1u;
        return;
    }
    held->frames[(held->first + held->count) % HUB_HELD] = *frame;
    held->count++;
    if (to->number == 0u && held->count >= LOCAL_BUS_PACKET) {
        (void)send_held(hub, to);
    } else if (held->count >= HUB_HELD / 2u) {
        virtual_time_wake(&hub->time, to->number);
    }
}

static void send_frame(struct hub *hub, struct hub_connection *to,
                       const struct local_bus_frame *frame)
{
    if (hub->options.is_virtual) {
        hold_frame(hub, to, frame);
    } else {
        hub->lost += send_packet(hub, to->fd, frame, sizeof *frame) ? 0u : 1u;
    }
}

/* Delivers a frame to all other members of the bus of connection `sender`, and wakes those that do not defer it. */
static void deliver(struct hub *hub, size_t sender, const struct can_frame *frame, uint64_t now_ns)
{
    const unsigned bus = hub->connections[sender].bus;
    struct local_bus_frame out;
    memset(&out, 0, sizeof out);
    out.frame = *frame;
    out.time_ns = now_ns;
    for (size_t i = 0; i < hub->used; ++i) {
        struct hub_connection *to = &hub->connections[i];
        if (i == sender || to->fd < 0 || to->role != HUB_MEMBER || to->bus != bus ||
            (to->filter_count > 0u && !matches(to->filters, to->filter_count, frame))) {
            continue;
        }
        send_frame(hub, to, &out);
        if (matches(to->deferred, to->deferred_count, frame)) {
            virtual_time_wake_for_all(&hub->time, to->number);
        } else {
            virtual_time_wake(&hub->time, to->number);
        }
        virtual_time_note_frame(&hub->time, to->number);
    }
}

/* Gives a frame back to a sender that tracks it; this does not wake the sender. */
static void deliver_back(struct hub *hub, size_t sender, const struct can_frame *frame)
{
    struct hub_connection *to = &hub->connections[sender];
    struct local_bus_frame out;
    if (to->fd < 0 || to->role != HUB_MEMBER || !matches(to->tracked, to->tracked_count, frame)) {
        return;
    }
    memset(&out, 0, sizeof out);
    out.frame = *frame;
    out.frame.__res0 = LOCAL_BUS_OWN;
    out.time_ns = hub->time.now_ns;
    send_frame(hub, to, &out);
    virtual_time_note_frame(&hub->time, to->number);
}

/* Of two frames the one with the lower value wins the bus. */
static uint32_t arbitration(const struct can_frame *frame)
{
    return (frame->can_id & CAN_EFF_FLAG) != 0u ? frame->can_id & CAN_EFF_MASK
                                                : (frame->can_id & CAN_SFF_MASK) << 18;
}

/* A full queue takes nothing more: false. */
static bool enqueue(struct hub_queue *queue, const struct can_frame *frame)
{
    if (queue->count == HUB_QUEUE) {
        return false;
    }
    size_t at = queue->first + queue->count;
    while (at > queue->first &&
           arbitration(&queue->frames[(at - 1u) % HUB_QUEUE]) > arbitration(frame)) {
        queue->frames[at % HUB_QUEUE] = queue->frames[(at - 1u) % HUB_QUEUE];
        at--;
    }
    queue->frames[at % HUB_QUEUE] = *frame;
    queue->count++;
    return true;
}

static void take_frame(struct hub *hub, struct hub_connection *from, const struct can_frame *frame)
{
    if (!hub->options.is_virtual) {
        deliver(hub, (size_t)(from - hub->connections), frame, clock_of(CLOCK_REALTIME));
    } else {
        hub->lost += enqueue(&from->queue, frame) ? 0u : 1u;
    }
}

/* The connection that sends next on a free bus: the lowest identifier among the members' first frames. HUB_CONNECTIONS:
 * no frame waits. */
static size_t arbitrate(const struct hub *hub, unsigned bus)
{
    size_t best = HUB_CONNECTIONS;
    uint32_t lowest = UINT32_MAX;
    for (size_t i = 0; i < hub->used; ++i) {
        const struct hub_connection *each = &hub->connections[i];
        if (each->bus != bus || each->queue.count == 0u) {
            continue;
        }
        const uint32_t value = arbitration(&each->queue.frames[each->queue.first]);
        if (best == HUB_CONNECTIONS || value < lowest) {
            best = i;
            lowest = value;
        }
    }
    return best;
}

static void start_transmission(struct hub *hub, unsigned number)
{
    struct hub_bus *bus = &hub->buses[number];
    const size_t sender = bus->busy ? HUB_CONNECTIONS : arbitrate(hub, number);
    if (sender == HUB_CONNECTIONS) {
        return;
    }
    struct hub_queue *queue = &hub->connections[sender].queue;
    bus->frame = queue->frames[queue->first];
    bus->sender = sender;
    bus->busy = true;
    bus->end_ns =
        hub->time.now_ns + (uint64_t)frame_bits(&bus->frame) * NS_PER_S / hub->options.bitrate;
    queue->first = (queue->first + 1u) % HUB_QUEUE;
    queue->count--;
}

/* --- Virtual time --- */

static uint64_t next_event_ns(struct hub *hub)
{
    uint64_t next_ns = virtual_time_next_ns(&hub->time);
    for (unsigned i = 0; i < hub->bus_count; ++i) {
        start_transmission(hub, i);
        if (hub->buses[i].busy && hub->buses[i].end_ns < next_ns) {
            next_ns = hub->buses[i].end_ns;
        }
    }
    return next_ns;
}

/* A reaction to a frame takes some time on a real bus, so a frame that already waits goes first, whatever its
 * identifier. Otherwise two processes that answer each other at once would block all frames of lower priority. */
static void end_transmissions(struct hub *hub)
{
    for (unsigned i = 0; i < hub->bus_count; ++i) {
        struct hub_bus *bus = &hub->buses[i];
        if (bus->busy && bus->end_ns <= hub->time.now_ns) {
            const struct can_frame frame = bus->frame;
            const size_t sender = bus->sender;
            bus->busy = false;
            start_transmission(hub, i);
            deliver(hub, sender, &frame, hub->time.now_ns);
            deliver_back(hub, sender, &frame);
        }
    }
}

/* Real time from now until this instant is due, ns; negative: it is late. */
static double ahead_ns(const struct hub *hub, uint64_t next_ns, uint64_t real_ns)
{
    const double virtual_ns = (double)(next_ns - hub->pace_virtual_ns);
    return virtual_ns / hub->options.speed - (double)(real_ns - hub->pace_real_ns);
}

/* Milliseconds of real time until this instant may come; 0: it may come now. Time advances in steps of PACE_AHEAD_NS,
 * because a process cannot sleep for the short time between two events. A simulation that is late by more than
 * PACE_LATE_NS does not catch up. */
static int pace_ms(struct hub *hub, uint64_t next_ns)
{
    if (hub->options.speed <= 0.0) {
        return 0;
    }
    const uint64_t real_ns = clock_of(CLOCK_MONOTONIC);
    if (hub->pace_real_ns == 0u) {
        hub->pace_real_ns = real_ns;
        hub->pace_virtual_ns = hub->time.now_ns;
    }
    if (ahead_ns(hub, next_ns, real_ns) < -PACE_LATE_NS) {
        hub->pace_real_ns = real_ns;
        hub->pace_virtual_ns = next_ns;
    }
    const double left_ns = ahead_ns(hub, next_ns, real_ns);
    if (left_ns < PACE_AHEAD_NS) {
        return 0;
    }
    return left_ns < 1e9 ? (int)(left_ns / 1e6) : 1000;
}

/* Grants; the members of the participant get all frames up to now. So do recorders (members without a participant), if
 * the participant requested notices, because it may evaluate what they have recorded. */
static void grant(struct hub *hub, struct participant *next)
{
    struct hub_connection *to = participant_connection(hub, next->number);
    struct local_bus_control granted = {.mark = LOCAL_BUS_MARK,
                                        .version = LOCAL_BUS_VERSION,
                                        .kind = LOCAL_BUS_GRANT,
                                        .number = next->grant,
                                        .time_ns = hub->time.now_ns};
    granted.flags = next->frames ? LOCAL_BUS_FRAMES : 0;
    next->frames = flush_all(hub, next->number);
    if (next->wants_notices) {
        (void)flush_all(hub, 0);
    }
    hub->granted = next->wants_notices ? NULL : to;
    (void)send_packet(hub, to->fd, &granted, sizeof granted);
}

/* Gives the next grant, if no participant is active. Returns how long to wait for processes, in ms: -1 without a limit.
 * */
static int go_on(struct hub *hub)
{
    while (!virtual_time_is_held(&hub->time)) {
        struct participant *next = virtual_time_grant(&hub->time);
        if (next != NULL) {
            grant(hub, next);
            return -1;
        }
        const uint64_t next_ns = next_event_ns(hub);
        if (next_ns == LOCAL_BUS_NEVER) {
            return -1;
        }
        const int wait_ms = pace_ms(hub, next_ns);
        if (wait_ms > 0) {
            return wait_ms;
        }
        hub->time.now_ns = next_ns > hub->time.now_ns ? next_ns : hub->time.now_ns;
        end_transmissions(hub);
    }
    return -1;
}

/* --- Messages of processes --- */

static void greet(struct hub *hub, struct hub_connection *from,
                  const struct local_bus_control *hello)
{
    const struct timeval poll_all_interval = {.tv_usec = POLL_ALL_MS * 1000};
    if (hello->kind == LOCAL_BUS_HELLO_MEMBER) {
        from->role = HUB_MEMBER;
        from->number = hub->options.is_virtual ? hello->number : 0u;
        send_control(hub, from->fd, LOCAL_BUS_WELCOME, 0, NULL);
        return;
    }
    if (hub->options.is_virtual) {
        from->number =
            virtual_time_join(&hub->time, hello->name, (hello->flags & LOCAL_BUS_NOTICES) != 0u);
        from->role = from->number != 0u ? HUB_PARTICIPANT : HUB_UNKNOWN;
        (void)setsockopt(from->fd, SOL_SOCKET, SO_RCVTIMEO, &poll_all_interval,
                         sizeof poll_all_interval);
        if (from->number == 0u) {
            drop_connection(hub, from);
            return;
        }
        notify(hub, LOCAL_BUS_JOINED, virtual_time_find(&hub->time, from->number));
    }
    send_control(hub, from->fd, LOCAL_BUS_WELCOME, from->number, NULL);
}

static void take_wait(struct hub *hub, const struct hub_connection *from,
                      const struct local_bus_control *wait)
{
    if ((wait->flags & LOCAL_BUS_SENT) != 0u) {
        take_sent(hub, from->number);
    }
    const bool all = (wait->flags & LOCAL_BUS_ALL) != 0u;
    if (virtual_time_wait(&hub->time, from->number, wait->number, wait->time_ns, all)) {
        const struct participant *interrupted = virtual_time_find(&hub->time, from->number);
        notify(hub, LOCAL_BUS_INTERRUPTED, interrupted);
    }
}

static bool take_control(struct hub *hub, struct hub_connection *from,
                         const struct local_bus_control *control)
{
    if (from->role == HUB_UNKNOWN) {
        greet(hub, from, control);
        return true;
    }
    struct participant *named = NULL;
    switch (control->kind) {
    case LOCAL_BUS_WAIT:
        take_wait(hub, from, control);
        break;
    case LOCAL_BUS_SUSPEND:
    case LOCAL_BUS_CONTINUE:
        named = virtual_time_named(&hub->time, control->name);
        if (named != NULL) {
            named->suspended = control->kind == LOCAL_BUS_SUSPEND;
        }
        break;
    default:
        return false;
    }
    return true;
}

static void take_filters(struct hub_connection *from, const struct local_bus_filters *message,
                         size_t size)
{
    const size_t bytes = message->count * sizeof message->filters[0];
    if (message->count > LOCAL_BUS_FILTERS ||
        size != offsetof(struct local_bus_filters, filters) + bytes) {
        return;
    }
    if (message->kind == LOCAL_BUS_FILTER) {
        memcpy(from->filters, message->filters, bytes);
        from->filter_count = message->count;
    } else if (message->kind == LOCAL_BUS_TRACK) {
        memcpy(from->tracked, message->filters, bytes);
        from->tracked_count = message->count;
    } else {
        memcpy(from->deferred, message->filters, bytes);
        from->deferred_count = message->count;
    }
}

/* False: no packet of the protocol. */
static bool take_packet(struct hub *hub, struct hub_connection *from, const union packet *packet,
                        size_t size)
{
    if (size < sizeof packet->mark) {
        return false;
    }
    if (packet->mark != LOCAL_BUS_MARK) {
        if (from->role != HUB_MEMBER || size != sizeof packet->frame ||
            packet->frame.can_dlc > CAN_MAX_DLEN) {
            return false;
        }
        take_frame(hub, from, &packet->frame);
    } else if (from->role == HUB_MEMBER && (packet->control.kind == LOCAL_BUS_FILTER ||
                                            packet->control.kind == LOCAL_BUS_DEFER ||
                                            packet->control.kind == LOCAL_BUS_TRACK)) {
        take_filters(from, &packet->filters, size);
    } else {
        return size == sizeof packet->control && packet->control.version == LOCAL_BUS_VERSION &&
               take_control(hub, from, &packet->control);
    }
    return true;
}

static void take_packets(struct hub *hub, struct hub_connection *from, size_t most)
{
    union packet packet;
    bool over = false;
    for (size_t i = 0; i < most && from->fd >= 0 && !over; ++i) {
        const ssize_t size = recv(from->fd, &packet, sizeof packet, MSG_DONTWAIT);
        if (size < 0 && (errno == EAGAIN || errno == EINTR)) {
            return;
        }
        if (size <= 0 || !take_packet(hub, from, &packet, (size_t)size)) {
            drop_connection(hub, from);
        }
        over = from->role == HUB_PARTICIPANT; /* mostly it sends one message, then waits */
    }
}

/* --- The hub --- */

/* Frames of participants are taken when they wait. Before that their members are read only sometimes (`all`), so that a
 * member that sends very much has room. */
static size_t fill(const struct hub *hub, int end, struct pollfd *wait, size_t *who, bool all)
{
    size_t count = 0;
    wait[count++] = (struct pollfd){.fd = end, .events = POLLIN};
    for (size_t i = 0; i < hub->bus_count; ++i) {
        wait[count++] = (struct pollfd){.fd = hub->listeners[i], .events = POLLIN};
    }
    for (size_t i = 0; i < hub->used; ++i) {
        const struct hub_connection *each = &hub->connections[i];
        const bool quiet = each->role == HUB_MEMBER && each->number != 0u && !all;
        if (each->fd >= 0 && !quiet) {
            who[count] = i;
            wait[count++] = (struct pollfd){.fd = each->fd, .events = POLLIN};
        }
    }
    return count;
}

/* Takes the next message of the only active participant without polling the others, because they cannot change anything
 * until it waits. False: the message takes long, or it is time to poll all. */
static bool take_granted(struct hub *hub)
{
    union packet packet;
    struct hub_connection *from = hub->granted;
    hub->granted = NULL;
    if (from == NULL || ++hub->unpolled >= HUB_UNPOLLED) {
        hub->unpolled = 0;
        return false;
    }
    const ssize_t size = recv(from->fd, &packet, sizeof packet, 0);
    if (size < 0 && (errno == EAGAIN || errno == EINTR)) {
        return false;
    }
    if (size <= 0 || !take_packet(hub, from, &packet, (size_t)size)) {
        drop_connection(hub, from);
    }
    return true;
}

bool hub_step(struct hub *hub, int end)
{
    struct pollfd wait[1u + HUB_BUSES + HUB_CONNECTIONS];
    size_t who[1u + HUB_BUSES + HUB_CONNECTIONS];
    const int limit_ms = hub->options.is_virtual ? go_on(hub) : -1;
    const bool held = hub->options.is_virtual && virtual_time_is_held(&hub->time);
    if (take_granted(hub)) {
        return true;
    }
    if (!held) {
        (void)flush_all(hub, 0);
    }
    const bool all = !held || hub->poll_all;
    const size_t count = fill(hub, end, wait, who, all);
    const int ready = poll(wait, count, all ? limit_ms : POLL_ALL_MS);
    if (ready < 0) {
        return errno == EINTR;
    }
    hub->poll_all = ready == 0 && !all;
    for (size_t i = 1u + hub->bus_count; i < count; ++i) {
        struct hub_connection *each = &hub->connections[who[i]];
        if (wait[i].revents != 0 && each->fd == wait[i].fd) {
            take_packets(hub, each, PACKETS_AT_ONCE);
        }
    }
    for (unsigned i = 0; i < hub->bus_count; ++i) {
        if (wait[1u + i].revents != 0) {
            take_connection(hub, i);
        }
    }
    return wait[0].revents == 0;
}

void hub_close(struct hub *hub)
{
    (void)flush_all(hub, 0);
    for (size_t i = 0; i < HUB_CONNECTIONS; ++i) {
        if (hub->connections[i].fd >= 0) {
            (void)close(hub->connections[i].fd);
            hub->connections[i].fd = -1;
        }
    }
    for (size_t i = 0; i < hub->bus_count; ++i) {
        (void)close(hub->listeners[i]);
    }
}
