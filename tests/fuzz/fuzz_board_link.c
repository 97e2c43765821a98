/* SPDX-License-Identifier: MIT */
/*
 * Fuzz harness of can/slcan.h and gateway/pacing.h: characters and requests as an emulated board sends them. A frame
 * that the SLCAN decoder accepts is the same after encoding and decoding it again. Each request gets its reply after
 * fewer than ROUNDS_MAX waits, and each wait is longer than 0.
 *
 * Input: requests (one byte each selects the kind), then characters.
 *
 * Run by `make fuzz` with libFuzzer, and on its corpus by `make test` and `make unit` (replay.c). No I/O, except that a
 * broken rule is printed and aborts the process.
 */
#include <string.h>

#include "can/slcan.h"
#include "fuzz.h"
#include "gateway/pacing.h"

#define REQUESTS_MAX 64u
#define ROUNDS_MAX   10000u /* more waits than any request needs */

static void decode_again(const struct can_msg *frame)
{
    char line[SLCAN_LINE_MAX];
    struct slcan_decoder decoder;
    struct can_msg same;
    memset(&decoder, 0, sizeof decoder);
    memset(&same, 0, sizeof same);
    const uint32_t length = slcan_encode(frame, line);
    FUZZ_CHECK(length <= SLCAN_LINE_MAX);
    for (uint32_t i = 0; i < length; ++i) {
        FUZZ_CHECK(slcan_decode(&decoder, line[i], &same) == (i + 1u == length));
    }
    FUZZ_CHECK(same.id == frame->id && same.len == frame->len);
    FUZZ_CHECK(memcmp(same.data, frame->data, frame->len) == 0);
}

static void characters(struct fuzz_input *in)
{
    struct slcan_decoder decoder;
    memset(&decoder, 0, sizeof decoder);
    while (fuzz_left(in)) {
        struct can_msg frame;
        memset(&frame, 0, sizeof frame);
        if (slcan_decode(&decoder, (char)fuzz_byte(in), &frame)) {
            FUZZ_CHECK(frame.id <= CAN_ID_MAX && frame.len <= CAN_DATA_MAX);
            decode_again(&frame);
        }
    }
}

/* Makes one request and waits as the gateway does, by pacing_wait_ns. If `how` is at least 0x80, one frame has come
 * after the round (how & 7). */
static void request(struct fuzz_input *in, struct pacing *pacing, uint64_t *now_ns)
{
    const uint8_t how = fuzz_byte(in);
    const struct exchange_header header = {.flags = fuzz_byte(in) & 63u,
                                           .period_us = fuzz_number(in, 3) % 1000000u,
                                           .guard_us = fuzz_number(in, 3) % 10000000u};
    struct exchange_header reply;
    pacing_request(pacing, &header, *now_ns);
    unsigned rounds = 0;
    while (!pacing_over(pacing, how >= 0x80u && rounds > (how & 7u) ? 1u : 0u, *now_ns, &reply)) {
        const uint64_t wait_ns = pacing_wait_ns(pacing, *now_ns);
        FUZZ_CHECK(wait_ns > 0u);
        FUZZ_CHECK(++rounds < ROUNDS_MAX);
        *now_ns += wait_ns;
    }
    *now_ns += 1000ull * how;
}

static void harness(struct fuzz_input *in)
{
    struct pacing pacing;
    uint64_t now_ns = 1000000000u;
    const uint8_t count = fuzz_byte(in);
    memset(&pacing, 0, sizeof pacing);
    for (uint8_t i = 0; i < count && i < REQUESTS_MAX; ++i) {
        request(in, &pacing, &now_ns);
    }
    characters(in);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    return fuzz_run(harness, data, size);
}
