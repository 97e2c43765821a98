/* SPDX-License-Identifier: MIT */
/* sdo_server: lets one SDO client at a time read and write an object dictionary (CiA 301, 7.2.4). Used by
 * app/controller_state, app/controller and sim/node. No I/O: frames in, frames out.
 * 
 * Download (client writes): expedited, segmented, block with CRC and retransmission. Upload (client reads): expedited,
 * segmented, block. How the bytes come to the object and from it: canopen/od_transfer.h.
 * 
 * One transfer at a time. During a transfer an initiate request comes from another client: it is refused with
 * SDO_ABORT_LOCAL and the object of the request, and the transfer continues. There is one exception: before any data
 * has moved, an initiate request for the same object restarts the transfer, because its client has lost a response.
 * After that, a client has to abort before it begins again. A client that sends nothing is dropped after the timeout.
 * An abort is accepted if it names the object of the transfer, or no object (index 0).
 * 
 * Stop commands are executed during a transfer: the hook `urgent` of the dictionary names them (expedited writes of one
 * byte). The server executes and answers such a write, and the transfer continues. The client of the transfer has to
 * ignore this response, which names another object. Within a block, and after the abort of one, all eight bytes of such
 * a write distinguish it from a segment.
 * 
 * Within a block, frames are segments with a number. A frame is refused as the request of another client if it has the
 * form of a request for an existing object and its number is not one of the next two. A frame of another client that
 * happens to have the next number is taken for a segment. The transfer then fails at the true segment, which has the
 * same number and other bytes, or, if that is lost, at the CRC.
 * 
 * Lost segments: the server ignores segments after a gap. Its response at the end of the block names the last good
 * segment, from which the client repeats. If the last segment of a block is lost, the server sends this response after
 * half of the timeout; a client that only paused then repeats a few segments. A block that is lost as a whole ends in
 * the timeout.
 * 
 * A client receives nothing while it sends a block. So after an abort by the server the remaining segments still come.
 * Frames whose numbers continue from the last segment are therefore not taken for requests.
 * 
 * All functions: main loop (the hooks may take long); the receive interrupt only queues. */
#ifndef CANOPEN_SDO_SERVER_H
#define CANOPEN_SDO_SERVER_H

#include <stdbool.h>
#include <stdint.h>

#include "can/can_frame.h"
#include "canopen/od_transfer.h"

#define SDO_BLOCK_SEGMENTS_MAX 127u

enum sdo_server_state {
    SDO_SERVER_IDLE,
    SDO_SERVER_DOWNLOAD, /* segmented */
    SDO_SERVER_UPLOAD,
    SDO_SERVER_BLOCK_DOWNLOAD,     /* segments of a block are coming */
    SDO_SERVER_BLOCK_DOWNLOAD_END, /* all came; the end request with the CRC is due */
    SDO_SERVER_BLOCK_UPLOAD_READY, /* initiated; the client's start request is due */
    SDO_SERVER_BLOCK_UPLOAD,       /* sending segments from sdo_server_process */
    SDO_SERVER_BLOCK_UPLOAD_ACK,   /* a block is sent; its acknowledgement is due */
    SDO_SERVER_BLOCK_UPLOAD_END    /* end sent; the client's confirmation is due */
};

struct sdo_server {
    struct od_transfer object; /* of the transfer under way */
    enum sdo_server_state state;
    uint32_t timeout_us;
    uint32_t waited_us;   /* since the last frame of this transfer */
    uint32_t block_start; /* block upload: offset of the present block's first segment */
    uint16_t index;       /* of the transfer, for abort frames */
    uint16_t crc;
    uint8_t sub;
    uint8_t node;
    uint8_t toggle;
    uint8_t block_size;  /* segments in a block: the server's choice; upload: the client's */
    uint8_t block_limit; /* segments of the present block */
    uint8_t sequence;    /* last segment received in order, or sent */
    uint8_t held;        /* block download: bytes in `last` */
    uint8_t received;    /* newest segment of a block that continues or was aborted; else 0 */
    /* First byte of the frame that ended the last block or transfer; of an upload, the number of segments that it
     * acknowledged; 0: none. */
    uint8_t closing;
    bool use_crc;
    bool acknowledged_early; /* the frame sent last is the response after half of the timeout */
    uint8_t last[7]; /* block download: the newest segment: its padding is known only at the end */
};

/* `timeout_us`: time without a frame of the client after which a transfer is aborted; `block_segments` (1 ... 127):
 * segments in the blocks that clients have to send (fewer for small receive queues). */
void sdo_server_init(struct sdo_server *server, struct od *od, uint8_t node, uint32_t timeout_us,
                     uint8_t block_segments);

/* Drops a transfer under way without an abort frame (NMT reset, stop). */
void sdo_server_reset(struct sdo_server *server);

/* True for frames that sdo_server_receive does not ignore. Any context. */
bool sdo_server_wants(const struct sdo_server *server, const struct can_msg *in);

/* Takes one frame; other frames are ignored. Returns true when *out is to be sent. */
bool sdo_server_receive(struct sdo_server *server, const struct can_msg *in, struct can_msg *out);

/* Lets time pass and gives frames that are no response to a request (aborts after a timeout, segments of a block
 * upload). Returns true when *out is to be sent: then call again with elapsed_us 0 as long as the port takes frames. */
bool sdo_server_process(struct sdo_server *server, uint32_t elapsed_us, struct can_msg *out);

/* The CRC of block transfers (CiA 301, 7.2.4.3.16): polynomial x^16 + x^12 + x^5 + 1, initial value 0, not reflected;
 * check value of "123456789": 0x31C3. Continues `crc` (0 at the beginning) over `size` bytes. Pure, any context. */
uint16_t sdo_block_crc(uint16_t crc, const uint8_t *data, uint32_t size);

#endif
