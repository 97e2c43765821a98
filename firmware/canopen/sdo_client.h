/* SPDX-License-Identifier: MIT */
/* sdo_client: reads and writes objects of other nodes, expedited or segmented (CiA 301, 7.2.4). A state machine without
 * I/O: the controller's main loop gives it frames and time, and sends what it returns. Used by app/drives.
 *
 *     sdo_client_write_number(&client, 2, 0x6060, 0, 8, 1, &out);      -> send out
 *     each frame:      if (sdo_client_receive(&client, &in, &out)) -> send out
 *     each poll:       if (sdo_client_process(&client, elapsed_us, &out)) -> send out
 *     until client.status is not SDO_CLIENT_BUSY
 *
 * One transfer at a time, over the predefined COB-IDs. All functions: main loop.
 */
#ifndef CANOPEN_SDO_CLIENT_H
#define CANOPEN_SDO_CLIENT_H

#include <stdbool.h>
#include <stdint.h>

#include "can/can_frame.h"

enum sdo_client_status {
    SDO_CLIENT_IDLE,    /* no transfer yet */
    SDO_CLIENT_BUSY,    /* a transfer is under way */
    SDO_CLIENT_DONE,    /* read: `size` bytes are in the buffer */
    SDO_CLIENT_REFUSED, /* the server aborted with abort_code */
    SDO_CLIENT_FAILED   /* this client aborted with abort_code (SDO_ABORT_TIMEOUT: no answer) */
};

/* Results of the functions that begin a transfer. */
#define SDO_CLIENT_ERR_BUSY     (-1) /* a transfer is under way */
#define SDO_CLIENT_ERR_ARGUMENT (-2) /* node not 1 ... 127, or size 0 */

/* The response that is due. */
enum sdo_client_step {
    SDO_CLIENT_DOWNLOAD,         /* to the request to write */
    SDO_CLIENT_DOWNLOAD_SEGMENT, /* to a segment that was sent */
    SDO_CLIENT_UPLOAD,           /* to the request to read */
    SDO_CLIENT_UPLOAD_SEGMENT    /* the next segment */
};

struct sdo_client {
    enum sdo_client_status status;
    enum sdo_client_step step;
    uint32_t abort_code;   /* of REFUSED and FAILED */
    uint32_t size;         /* bytes of the value; read: known when DONE */
    uint32_t timeout_us;   /* for each answer */
    uint32_t waited_us;    /* for the response that is due */
    const uint8_t *source; /* write */
    uint8_t *target;       /* read */
    uint32_t capacity;
    uint32_t moved;
    uint16_t index;
    uint8_t sub;
    uint8_t node;
    uint8_t toggle;
    uint8_t empty_segments; /* read: in a row; after too many the transfer ends */
    uint8_t number[8];      /* of the _number calls */
};

void sdo_client_init(struct sdo_client *client, uint32_t timeout_us);

/* Begin a transfer: fill *out with the request, which is to be sent, and return 0; or a negative error with nothing
 * changed: a transfer is under way, node not 1 ... 127, size 0. `data` and `buffer` must stay until status is not
 * BUSY. */
int sdo_client_write(struct sdo_client *client, uint8_t node, uint16_t index, uint8_t sub,
                     const uint8_t *data, uint32_t size, struct can_msg *out);
int sdo_client_read(struct sdo_client *client, uint8_t node, uint16_t index, uint8_t sub,
                    uint8_t *buffer, uint32_t capacity, struct can_msg *out);

/* The same for a number of `size` (1 ... 8) bytes, kept inside the client. */
int sdo_client_write_number(struct sdo_client *client, uint8_t node, uint16_t index, uint8_t sub,
                            uint64_t value, uint8_t size, struct can_msg *out);
int sdo_client_read_number(struct sdo_client *client, uint8_t node, uint16_t index, uint8_t sub,
                           struct can_msg *out);

/* The number that sdo_client_read_number has read (status DONE), as unsigned and as two's complement of its size. */
uint64_t sdo_client_unsigned(const struct sdo_client *client);
int64_t sdo_client_signed(const struct sdo_client *client);

/* Takes a frame; ignores all except SDO responses, and late responses for another object. Returns true when *out is to
 * be sent. */
bool sdo_client_receive(struct sdo_client *client, const struct can_msg *in, struct can_msg *out);

/* Lets time pass. Returns true when *out (an abort after a timeout) is to be sent. */
bool sdo_client_process(struct sdo_client *client, uint32_t elapsed_us, struct can_msg *out);

/* Aborts the transfer: status FAILED with `code`. Returns true when *out (the abort) is to be sent; false when there
 * was no transfer. */
bool sdo_client_cancel(struct sdo_client *client, uint32_t code, struct can_msg *out);

#endif
