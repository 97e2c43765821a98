/* SPDX-License-Identifier: MIT */
/* device: one CANopen node made of firmware/canopen, as a shared library. Loaded by test_interop.py (ctypes). Frames
 * go to and from memory; no I/O. */
#include <string.h>

#include "canopen/emcy.h"
#include "canopen/heartbeat.h"
#include "canopen/nmt.h"
#include "canopen/sdo_abort.h"
#include "canopen/sdo_server.h"
#include "od_controller.h"
#include "od_drive.h"

#define DOMAIN_MAX 1000000u

struct device {
    struct od od;
    struct sdo_server sdo;
    struct nmt_slave nmt;
    struct heartbeat_producer heartbeat;
    struct emcy_producer emcy;
    union {
        struct od_controller controller;
        struct od_drive drive;
    } values;
    uint32_t size;
    uint8_t image[DOMAIN_MAX];
};

void device_init(int is_drive, uint8_t node, uint8_t block_segments);
int device_receive(const struct can_msg *in, struct can_msg *out);
int device_process(uint32_t elapsed_us, struct can_msg *out);
void device_raise(uint16_t code, uint8_t bits);
void device_clear(uint8_t bits);
uint32_t device_image(const uint8_t **image);

static struct device device;

static uint32_t domain_begin(void *context, const struct od_entry *entry, uint32_t size)
{
    (void)context;
    (void)entry;
    device.size = 0;
    return size > DOMAIN_MAX ? SDO_ABORT_MEMORY : SDO_OK;
}

static uint32_t domain_write(void *context, const struct od_entry *entry, uint32_t offset,
                             const uint8_t *data, uint32_t size)
{
    (void)context;
    (void)entry;
    if (size > DOMAIN_MAX - offset) {
        return SDO_ABORT_MEMORY;
    }
    memcpy(device.image + offset, data, size);
    device.size = offset + size;
    return SDO_OK;
}

/* Like the controller: an image that is no program is refused. */
static uint32_t domain_end(void *context, const struct od_entry *entry, uint32_t size)
{
    (void)context;
    (void)entry;
    return size >= 3 && memcmp(device.image, "bad", 3) == 0 ? SDO_ABORT_VALUE : SDO_OK;
}

static uint32_t domain_size(void *context, const struct od_entry *entry, uint32_t *size)
{
    (void)context;
    (void)entry;
    *size = device.size;
    return SDO_OK;
}

static uint32_t domain_read(void *context, const struct od_entry *entry, uint32_t offset,
                            uint8_t *data, uint32_t size)
{
    (void)context;
    (void)entry;
    memcpy(data, device.image + offset, size);
    return SDO_OK;
}

static const struct od_hooks hooks = {
    .domain_begin = domain_begin,
    .domain_write = domain_write,
    .domain_end = domain_end,
    .domain_size = domain_size,
    .domain_read = domain_read,
};

static void init_drive(uint8_t node)
{
    struct od_drive *values = &device.values.drive;

    *values = od_drive_defaults;
    od_drive_set_node(values, node);
    od_init(&device.od, &od_drive_table, values, &hooks, NULL);
    emcy_producer_init(&device.emcy, node, &values->error_register, values->predefined_error_field,
                       &values->predefined_error_field_count, 8);
}

static void init_controller(uint8_t node)
{
    struct od_controller *values = &device.values.controller;

    *values = od_controller_defaults;
    od_controller_set_node(values, node);
    od_init(&device.od, &od_controller_table, values, &hooks, NULL);
    emcy_producer_init(&device.emcy, node, &values->error_register, values->predefined_error_field,
                       &values->predefined_error_field_count, 8);
}

void device_init(int is_drive, uint8_t node, uint8_t block_segments)
{
    memset(&device, 0, sizeof device);
    if (is_drive) {
        init_drive(node);
    } else {
        init_controller(node);
    }
    sdo_server_init(&device.sdo, &device.od, node, 1000000, block_segments);
    nmt_slave_init(&device.nmt, node, NULL, NULL);
    heartbeat_producer_init(&device.heartbeat, node);
}

int device_receive(const struct can_msg *in, struct can_msg *out)
{
    if (nmt_slave_receive(&device.nmt, in) || !nmt_permits_sdo(device.nmt.state)) {
        return 0;
    }
    return sdo_server_receive(&device.sdo, in, out);
}

int device_process(uint32_t elapsed_us, struct can_msg *out)
{
    return nmt_slave_process(&device.nmt, out) || emcy_producer_process(&device.emcy, out) ||
           heartbeat_producer_process(&device.heartbeat, 50, device.nmt.state, elapsed_us, out) ||
           sdo_server_process(&device.sdo, elapsed_us, out);
}

void device_raise(uint16_t code, uint8_t bits)
{
    const uint8_t detail[EMCY_DETAIL_SIZE] = {1, 2, 3, 4, 5};

    emcy_producer_raise(&device.emcy, code, bits, detail);
}

void device_clear(uint8_t bits)
{
    emcy_producer_clear(&device.emcy, bits);
}

uint32_t device_image(const uint8_t **image)
{
    *image = device.image;
    return device.size;
}
