/* SPDX-License-Identifier: MIT */
/* Implements gateway/fifo_side.h (see there): serves the requests of an emulated board on two FIFOs
 * (port/mps2/exchange.h). Called by gateway/main. One thread, one call in a process: its state is
 * static. It opens the FIFOs, and sends and receives on the CAN socket. */
#define _GNU_SOURCE
#include "gateway/fifo_side.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "gateway/bus.h"
#include "gateway/pacing.h"
#include "port/linux/clock.h"
#include "port/mps2/exchange.h"

static struct {
    struct can_socket *socket;
    int out; /* output of the board: read here */
    int in;  /* input of the board: written here */
    struct pacing pacing;
    struct exchange_message request;
    struct exchange_message reply;
} self;

static const char gone[] = "the emulated board is gone";

/* Waits until the board opens its end. A negative number: it did not. Unless a signal ended the wait, a line on stderr
 * has the reason. */
static int open_fifo(const char *path, int flags)
{
    struct stat found;
    if (stat(path, &found) != 0 || !S_ISFIFO(found.st_mode)) {
        (void)bus_complain(GATEWAY_GONE, path, "no FIFO of this name: make it with mkfifo");
        return -1;
    }
    const int fd = open(path, flags | O_CLOEXEC);
    if (fd < 0 && bus_signals() == 0u) {
        (void)bus_complain(GATEWAY_GONE, path, strerror(errno));
    }
    return fd;
}

/* False if the board has ended, or the request is invalid. */
static bool read_request(void)
{
    size_t got = 0;
    while (got < sizeof self.request.header || got < exchange_size(&self.request)) {
        const ssize_t more =
            read(self.out, (uint8_t *)&self.request + got, sizeof self.request - got);
        if (more > 0) {
            got += (size_t)more;
        } else if (more == 0 || errno != EINTR || bus_signals() > 1u) {
            return false;
        }
        if (got >= sizeof self.request.header && self.request.header.count > EXCHANGE_FRAMES) {
            return false;
        }
    }
    return true;
}

static bool write_reply(void)
{
    const ssize_t size = (ssize_t)exchange_size(&self.reply);
    ssize_t done = 0;
    do {
        done = write(self.in, &self.reply, (size_t)size);
    } while (done < 0 && errno == EINTR && bus_signals() < 2u);
    return done == size;
}

static int set_filters(void)
{
    struct can_match filters[CAN_SOCKET_FILTERS];
    const size_t count = self.request.header.count;
    if (count > CAN_SOCKET_FILTERS) {
        return -EINVAL;
    }
    for (size_t i = 0; i < count; ++i) {
        const struct exchange_frame *record = &self.request.frames[i];
        filters[i].id = (uint16_t)record->id;
        filters[i].mask = (uint16_t)(record->data[0] | record->data[1] << 8);
    }
    return can_socket_filter(self.socket, filters, count);
}

static int send_frames(void)
{
    struct can_msg messages[EXCHANGE_FRAMES];
    const size_t count = self.request.header.count;
    for (size_t i = 0; i < count; ++i) {
        exchange_unpack(&messages[i], &self.request.frames[i]);
        if (messages[i].id > CAN_ID_MAX || messages[i].len > CAN_DATA_MAX) {
            return -EINVAL; /* other identifiers are the hub's (port/linux/local_bus.h) */
        }
        if (self.request.frames[i].of_tick != 0u) {
            (void)can_socket_track(self.socket, (uint16_t)messages[i].id);
        }
    }
    return bus_send(self.socket, messages, count);
}

/* Takes the waiting frames; those that have no room in the reply stay in the socket. 0 or a negative errno. */
static int take_frames(void)
{
    struct can_msg messages[CAN_SOCKET_BATCH];
    int more = 1;
    while (more != 0 && self.reply.header.count + CAN_SOCKET_BATCH <= EXCHANGE_FRAMES) {
        const int count = can_socket_receive(self.socket, messages, &more);
        if (count < 0) {
            return count;
        }
        for (int i = 0; i < count; ++i) {
            exchange_pack(&self.reply.frames[self.reply.header.count++], &messages[i]);
        }
    }
    return 0;
}

/* At lock step the processor is for the drives, which have to answer: the socket is not read before they can have
 * answered. The clock is not read either, because it may cost a system call: guard times begin anew with the next
 * request. */
static int wait_until_due(uint64_t now_ns)
{
    bool over = false;
    int error = 0;
    self.reply.header = (struct exchange_header){.count = 0};
    while (!over && error == 0 && bus_signals() < 2u) {
        const uint64_t wait_ns = pacing_wait_ns(&self.pacing, now_ns);
        struct pollfd wait = {.fd = self.pacing.awaiting ? self.socket->fd : -1, .events = POLLIN};
        if (wait_ns > 0u) {
            const int ready = clock_poll(&wait, 1, 1, wait_ns);
            now_ns = ready > 0 && self.pacing.schedule.lock_step ? now_ns : clock_ns();
            error = ready < 0 && ready != -EINTR ? ready : 0;
        }
        if (error != 0) {
            break;
        }
        error = self.pacing.at_once ? 0 : take_frames();
        over = pacing_over(&self.pacing, self.reply.header.count, now_ns, &self.reply.header);
    }
    return error;
}

/* One request. 0 or a negative errno of the bus. */
static int serve(void)
{
    const uint16_t flags = self.request.header.flags;
    const uint64_t now_ns = clock_ns();
    pacing_request(&self.pacing, &self.request.header, now_ns);
    int error = (flags & EXCHANGE_FILTER) != 0u ? set_filters() : send_frames();
    if (error == 0) {
        error = wait_until_due(now_ns);
    }
    if (can_socket_waiting(self.socket) > 0u) {
        self.reply.header.flags |= EXCHANGE_WAITING;
    }
    if (bus_signals() > 0u) {
        self.reply.header.flags |= EXCHANGE_STOP;
    }
    return error;
}

struct fifo_side_end fifo_side_serve(struct can_socket *socket, int out, int in)
{
    memset(&self, 0, sizeof self);
    self.socket = socket;
    self.out = out;
    self.in = in;
    while (read_request()) {
        const int error = serve();
        if (error != 0) {
            return (struct fifo_side_end){GATEWAY_BUS, "the bus failed", strerror(-error)};
        }
        if (!write_reply()) {
            return (struct fifo_side_end){GATEWAY_GONE, gone, strerror(errno)};
        }
        if ((self.request.header.flags & EXCHANGE_END) != 0u) {
            return (struct fifo_side_end){.status = GATEWAY_OK};
        }
    }
    return (struct fifo_side_end){GATEWAY_GONE, gone, "it closed its FIFO without a word"};
}

static int serve_and_report(struct can_socket *socket, int out, int in)
{
    const struct fifo_side_end end = fifo_side_serve(socket, out, in);
    return end.status == GATEWAY_OK ? GATEWAY_OK : bus_complain((int)end.status, end.what, end.why);
}

int fifo_side_run(struct can_socket *socket, const char *out, const char *in)
{
    const int out_fd = open_fifo(out, O_RDONLY);
    const int in_fd = out_fd < 0 ? -1 : open_fifo(in, O_WRONLY);
    int status = bus_signals() > 0u ? GATEWAY_OK : GATEWAY_GONE;
    if (in_fd >= 0) {
        status = serve_and_report(socket, out_fd, in_fd);
        (void)close(in_fd);
    }
    if (out_fd >= 0) {
        (void)close(out_fd);
    }
    return status;
}
