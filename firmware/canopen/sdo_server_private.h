/* SPDX-License-Identifier: MIT */
/* sdo_server_private: what the files of the SDO server share. Nothing outside sdo_server*.c
 * includes this.
 *
 * Functions that return int give 1 when *out is to be sent, else 0; those that return uint32_t give
 * an abort code. Mainline.
 */
#ifndef CANOPEN_SDO_SERVER_PRIVATE_H
#define CANOPEN_SDO_SERVER_PRIVATE_H

#include "canopen/sdo_server.h"

#define SDO_BYTES         8u
#define SDO_SEGMENT_BYTES 7u

/* First byte of frames: command specifier in bits 5 ... 7. */
#define SDO_TOGGLE             0x10u
#define SDO_LAST_SEGMENT       0x01u /* segmented transfer */
#define SDO_LAST_IN_BLOCK      0x80u
#define SDO_CRC_SUPPORTED      0x04u
#define SDO_ABORT_COMMAND_BYTE 0x80u
#define SDO_DOWNLOADED_BYTE    0x60u /* answer to an initiated, or expedited, download */

/* sdo_server_object.c: between a transfer and the object dictionary */
uint32_t sdo_server_open_write(struct sdo_server *s, uint32_t announced);
uint32_t sdo_server_put(struct sdo_server *s, const uint8_t *data, uint32_t size);
uint32_t sdo_server_finish_write(struct sdo_server *s);
uint32_t sdo_server_open_read(struct sdo_server *s); /* sets announced */
uint32_t sdo_server_get(struct sdo_server *s, uint32_t offset, uint8_t *data, uint32_t size);
void sdo_server_drop(struct sdo_server *s); /* tells the hooks and becomes idle */

/* sdo_server_answer.c: frames to the client; fail: drops the transfer, *out is the abort */
void sdo_server_frame(const struct sdo_server *s, uint8_t command, struct can_msg *out);
void sdo_server_frame_with_object(const struct sdo_server *s, uint8_t command, struct can_msg *out);
int sdo_server_fail(struct sdo_server *s, uint32_t code, struct can_msg *out);

/* sdo_server_segment.c: expedited and segmented */
int sdo_server_download_initiate(struct sdo_server *s, const uint8_t *data, struct can_msg *out);
int sdo_server_download_segment(struct sdo_server *s, const uint8_t *data, struct can_msg *out);
int sdo_server_upload_initiate(struct sdo_server *s, struct can_msg *out);
int sdo_server_upload_segment(struct sdo_server *s, const uint8_t *data, struct can_msg *out);

/* sdo_server_block_download.c */
int sdo_server_block_download_initiate(struct sdo_server *s, const uint8_t *data,
                                       struct can_msg *out);
int sdo_server_block_download_segment(struct sdo_server *s, const uint8_t *data,
                                      struct can_msg *out);
int sdo_server_block_download_end(struct sdo_server *s, const uint8_t *data, struct can_msg *out);
int sdo_server_block_download_acknowledge(struct sdo_server *s, struct can_msg *out);
/* While idle: true for each segment that is left of a block whose transfer the server broke off. */
bool sdo_server_block_download_straggler(struct sdo_server *s, const uint8_t *data);

/* sdo_server_block_upload.c */
int sdo_server_block_upload_initiate(struct sdo_server *s, const uint8_t *data,
                                     struct can_msg *out);
int sdo_server_block_upload_command(struct sdo_server *s, const uint8_t *data, struct can_msg *out);
int sdo_server_block_upload_send(struct sdo_server *s, struct can_msg *out);

#endif
