/* SPDX-License-Identifier: MIT */
/*
 * Fuzz harness of gateway/fifo_side.h: what an emulated board writes to its FIFO, in pieces of any size, while frames
 * wait on the bus. Each complete request gets one reply, of frames of the bus; only frames and filters go to the bus; a
 * request that is none ends the service.
 *
 * Input: how many frames wait on the bus, and these; then requests. The FIFOs are a pair of sockets that keep the
 * pieces apart, so all of them can be written before the gateway reads.
 *
 * Run by `make fuzz` with libFuzzer, and on its corpus by `make test` and `make unit` (replay.c). Opens pairs of
 * sockets; no other I/O, except that a broken rule is printed and aborts the process.
 */
#define _GNU_SOURCE
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "fuzz.h"
#include "gateway/fifo_side.h"
#include "port/linux/local_bus.h"
#include "port/mps2/exchange.h"

/* All of it has room in the sockets, whose buffers may be no larger without a privilege. */
#define BUFFER_BYTES 212992
#define REQUESTS_MAX 16u
#define SENT_MAX     400u /* frames of all requests */
#define WAITING_MAX  40u
#define TIME_MAX_US  50u /* time is real here */

static struct {
    int board;        /* the board's end of its FIFOs */
    int bus;          /* the hub's end of the bus */
    unsigned waiting; /* frames that the hub has sent */
    unsigned sent;    /* frames of complete requests */
    unsigned replies; /* to complete requests, up to the one that ends the service */
    bool ended;
} self;

static void wait_on_bus(struct fuzz_input *in)
{
    self.waiting = fuzz_byte(in) % (WAITING_MAX + 1u);
    for (unsigned i = 0; i < self.waiting; ++i) {
        struct can_msg message;
        struct local_bus_frame frame;
        memset(&frame, 0, sizeof frame);
        fuzz_frame(in, &message);
        frame.frame.can_id = message.id;
        frame.frame.can_dlc = message.len;
        memcpy(frame.frame.data, message.data, sizeof message.data);
        FUZZ_CHECK(send(self.bus, &frame, sizeof frame, 0) == (ssize_t)sizeof frame);
    }
}

/* Whether the gateway takes all records of a complete request. */
static bool acceptable(const struct exchange_message *request)
{
    bool good = true;
    if ((request->header.flags & EXCHANGE_FILTER) != 0u) {
        return request->header.count <= CAN_SOCKET_FILTERS;
    }
    for (unsigned i = 0; i < request->header.count; ++i) {
        good =
            good && request->frames[i].id <= CAN_ID_MAX && request->frames[i].len <= CAN_DATA_MAX;
    }
    return good;
}

/* The first `size` bytes, in two pieces. */
static void write_pieces(const struct exchange_message *request, size_t size, size_t first)
{
    const uint8_t *bytes = (const uint8_t *)request;
    first = first < size ? first : size;
    if (first > 0u) {
        FUZZ_CHECK(send(self.board, bytes, first, 0) == (ssize_t)first);
    }
    if (size > first) {
        FUZZ_CHECK(send(self.board, bytes + first, size - first, 0) == (ssize_t)(size - first));
    }
}

static void fill_records(struct fuzz_input *in, struct exchange_message *request)
{
    const uint8_t odd = fuzz_byte(in); /* low bits clear: all records are frames */
    for (unsigned i = 0; i < request->header.count && i < EXCHANGE_FRAMES && fuzz_left(in); ++i) {
        struct exchange_frame *record = &request->frames[i];
        struct can_msg message;
        fuzz_frame(in, &message);
        exchange_pack(record, &message);
        record->of_tick = (uint8_t)(message.id & 1u);
        if ((odd & 3u) == 3u) {
            record->id = fuzz_number(in, 4);
            record->len = fuzz_byte(in);
        }
    }
}

/* The board sends a request; it may stop in the middle, and then it has ended. */
static void write_request(struct fuzz_input *in)
{
    struct exchange_message request;
    const uint8_t how = fuzz_byte(in);
    memset(&request, 0, sizeof request);
    request.header.flags = (uint16_t)fuzz_number(in, (how & 1u) != 0u ? 2u : 1u);
    request.header.count = (uint16_t)fuzz_number(in, (how & 2u) != 0u ? 2u : 1u);
    if (request.header.count <= EXCHANGE_FRAMES && self.sent + request.header.count > SENT_MAX) {
        request.header.count = 0;
    }
    request.header.period_us = fuzz_byte(in) % TIME_MAX_US;
    request.header.guard_us = fuzz_byte(in) % TIME_MAX_US;
    const size_t first = fuzz_number(in, 2) % sizeof request;
    fill_records(in, &request);
    const bool too_many = request.header.count > EXCHANGE_FRAMES;
    const size_t whole = too_many ? sizeof request.header : exchange_size(&request);
    const size_t size = (how & 12u) == 12u ? whole * (how >> 4) / 16u : whole;
    write_pieces(&request, size, first);
    self.ended = too_many || size < whole || !acceptable(&request) ||
                 (request.header.flags & EXCHANGE_END) != 0u;
    if (!too_many && size == whole && acceptable(&request)) {
        self.replies++;
        self.sent += request.header.count;
    }
}

static void check_replies(void)
{
    struct exchange_message reply;
    unsigned frames = 0, replies = 0;
    for (;;) {
        const ssize_t size = recv(self.board, &reply, sizeof reply, MSG_DONTWAIT);
        if (size <= 0) {
            break;
        }
        FUZZ_CHECK(size >= (ssize_t)sizeof reply.header);
        FUZZ_CHECK(reply.header.count <= EXCHANGE_FRAMES);
        FUZZ_CHECK(size == (ssize_t)exchange_size(&reply));
        for (unsigned i = 0; i < reply.header.count; ++i) {
            FUZZ_CHECK(reply.frames[i].id <= CAN_ID_MAX && reply.frames[i].len <= CAN_DATA_MAX);
        }
        frames += reply.header.count;
        replies++;
    }
    FUZZ_CHECK(replies == self.replies);
    FUZZ_CHECK(frames <= self.waiting);
}

static void check_bus(void)
{
    struct local_bus_filters packet;
    for (;;) {
        struct can_frame frame;
        const ssize_t size = recv(self.bus, &packet, sizeof packet, MSG_DONTWAIT);
        if (size <= 0) {
            return;
        }
        memcpy(&frame, &packet, sizeof frame);
        if (packet.mark == LOCAL_BUS_MARK) {
            FUZZ_CHECK(packet.kind == LOCAL_BUS_FILTER && packet.count <= CAN_SOCKET_FILTERS);
        } else {
            FUZZ_CHECK(size == (ssize_t)sizeof frame);
            FUZZ_CHECK(frame.can_id <= CAN_ID_MAX && frame.can_dlc <= CAN_DATA_MAX);
        }
    }
}

static void open_pair(int ends[2])
{
    const int bytes = BUFFER_BYTES;
    FUZZ_CHECK(socketpair(AF_UNIX, SOCK_SEQPACKET, 0, ends) == 0);
    for (int i = 0; i < 2; ++i) {
        FUZZ_CHECK(setsockopt(ends[i], SOL_SOCKET, SO_SNDBUF, &bytes, sizeof bytes) == 0);
    }
}

static void harness(struct fuzz_input *in)
{
    int fifos[2], bus[2];
    memset(&self, 0, sizeof self);
    open_pair(fifos);
    open_pair(bus);
    self.board = fifos[1];
    self.bus = bus[1];
    struct can_socket socket = {.fd = bus[0], .local = true};
    wait_on_bus(in);
    for (unsigned i = 0; i < REQUESTS_MAX && fuzz_left(in) && !self.ended; ++i) {
        write_request(in);
    }
    FUZZ_CHECK(shutdown(self.board, SHUT_WR) == 0);
    const struct fifo_side_end end = fifo_side_serve(&socket, fifos[0], fifos[0]);
    FUZZ_CHECK(end.status == GATEWAY_OK || (end.what != NULL && end.why != NULL));
    check_replies();
    check_bus();
    for (int i = 0; i < 2; ++i) {
        (void)close(fifos[i]);
        (void)close(bus[i]);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    return fuzz_run(harness, data, size);
}
