/* SPDX-License-Identifier: MIT */
/* Implements node/drives.h (see there): the simulated drives of one process on one SocketCAN bus. Used by node/main
 * (hodograph-drive). One thread. Reads frames from the socket, sends frames, and prints injected faults to stdout. */
#define _GNU_SOURCE
#include "node/drives.h"

#include <errno.h>
#include <poll.h>

#include "canopen/cob.h"
#include "faults/fault_log.h"
#include "port/linux/clock.h"

enum { SEND_TRIES = 200, BATCHES = 4, PILE_BYTES = 256 * 1024 };

/* A full queue of the interface empties within a few frame times: wait for it. One that stays full is a bus that is
 * off: the frame is lost. */
static void drives_send(void *context, const struct can_msg *frame)
{
    struct drives *drives = context;
    int result = -EAGAIN;
    for (int i = 0; i < SEND_TRIES && result == -EAGAIN; i++) {
        result = can_socket_send(&drives->socket, frame);
        if (result == -EAGAIN) {
            struct pollfd writable = {.fd = drives->socket.fd, .events = POLLOUT};
            (void)poll(&writable, 1, 1);
        }
    }
    if (result != 0 && result != -EAGAIN) {
        drives->failed = result;
    }
}

static void drives_note(const struct fault_rule *rule, uint64_t now_ns, int64_t tick, bool on)
{
    const struct fault_event event = {rule, now_ns, tick};
    fault_log_state(stdout, &event, on);
    (void)fflush(stdout);
}

int drives_init(struct drives *drives, const struct node_options *options, uint8_t *node)
{
    const struct drive_node_port port = {drives_send, drives};
    drives->count = 0;
    drives->failed = 0;
    for (size_t i = 0; i < options->axis_count; i++) {
        const struct node_options_axis *axis = &options->axes[i];
        const int32_t start =
            encoder_to_i32(axis->position_mm * (double)axis->config.counts_per_mm);
        const int error =
            drive_node_init(&drives->nodes[i], axis->node, &axis->config, start, port);
        if (error != 0 || !drive_node_equip(&drives->nodes[i], &axis->equipment)) {
            *node = axis->node;
            return error != 0 ? error : DRIVES_ERR_EQUIPMENT;
        }
        drives->count++;
    }
    if (options->module != 0) {
        io_module_init(&drives->module, options->module, port);
    }
    node_faults_init(&drives->faults, &drives->rules, drives->nodes, drives->count, drives_note);
    return 0;
}

/* Filters for frames that only the module receives; returns their number. */
static size_t module_filters(struct io_module *module, struct can_match filters[])
{
    size_t n = 0;
    if (module->id == 0) {
        return 0;
    }
    filters[n++] = (struct can_match){(uint16_t)(COB_SDO_REQUEST + module->id), CAN_ID_MAX};
    for (int k = 0; k < IO_MODULE_RPDOS; k++) {
        if (module->rpdos[k].valid) {
            filters[n++] = (struct can_match){module->rpdos[k].cob_id, CAN_ID_MAX};
        }
    }
    module->moved = false;
    return n;
}

/* Synchronous RPDOs need not wake the process before SYNC; fault rules act on each frame as it comes. */
static int drives_defer(struct drives *drives)
{
    struct can_match frames[DRIVE_PDOS * NODE_OPTIONS_AXES];
    size_t n = 0;
    for (size_t i = 0; i < drives->count && drives->rules.count == 0; i++) {
        for (int k = 0; k < DRIVE_PDOS; k++) {
            const struct pdo_map *map = &drives->nodes[i].pdos.rpdos[k];
            if (map->valid && !pdo_map_event_driven(map)) {
                frames[n++] = (struct can_match){map->cob_id, CAN_ID_MAX};
            }
        }
    }
    return can_socket_defer(&drives->socket, frames, n);
}

int drives_filter(struct drives *drives)
{
    struct can_match filters[4 + (1 + DRIVE_PDOS) * NODE_OPTIONS_AXES + 1 + IO_MODULE_RPDOS] = {
        {COB_NMT, CAN_ID_MAX}, {COB_SYNC, CAN_ID_MAX}, {COB_HEARTBEAT, 0x780}};
    size_t n = 3;
    if (drives->rules.count > 0) {
        filters[n++] = (struct can_match){COB_RPDO1, 0x780}; /* ticks are those of all */
    }
    for (size_t i = 0; i < drives->count; i++) {
        struct drive_node *node = &drives->nodes[i];
        filters[n++] = (struct can_match){(uint16_t)(COB_SDO_REQUEST + node->id), CAN_ID_MAX};
        for (int k = 0; k < DRIVE_PDOS; k++) {
            if (node->pdos.rpdos[k].valid) {
                filters[n++] = (struct can_match){node->pdos.rpdos[k].cob_id, CAN_ID_MAX};
            }
        }
        node->pdos.moved = false;
    }
    n += module_filters(&drives->module, &filters[n]);
    const int error = can_socket_filter(&drives->socket, filters, n);
    return error != 0 ? error : drives_defer(drives);
}

/* Cyclic frames need no process(). */
static bool drives_cyclic(const struct drives *drives, const struct can_msg *frame)
{
    if (frame->id == COB_SYNC) {
        return true;
    }
    for (size_t i = 0; i < drives->count; i++) {
        for (int k = 0; k < DRIVE_PDOS; k++) {
            const struct pdo_map *map = &drives->nodes[i].pdos.rpdos[k];
            if (map->valid && frame->id == map->cob_id) {
                return true;
            }
        }
    }
    return false;
}

static void drives_take(struct drives *drives, const struct can_msg *frame)
{
    bool moved = false;
    if (drives->rules.count > 0) {
        node_faults_receive(&drives->faults, frame, clock_ns());
    }
    for (size_t i = 0; i < drives->count; i++) {
        drive_node_receive(&drives->nodes[i], frame);
        moved = moved || drives->nodes[i].pdos.moved;
    }
    if (drives->module.id != 0) {
        io_module_receive(&drives->module, frame);
        moved = moved || drives->module.moved;
    }
    if (moved) {
        const int error = drives_filter(drives);
        drives->failed = error != 0 ? error : drives->failed;
    }
}

bool drives_receive(struct drives *drives)
{
    struct can_msg frames[CAN_SOCKET_BATCH];
    bool acyclic = false;
    int more = 1;
    for (int batch = 0; batch < BATCHES && more != 0; batch++) {
        const int count = can_socket_receive(&drives->socket, frames, &more);
        if (count < 0) {
            drives->failed = count;
            return true;
        }
        for (int k = 0; k < count; k++) {
            acyclic = acyclic || !drives_cyclic(drives, &frames[k]);
            drives_take(drives, &frames[k]);
        }
    }
    return acyclic;
}

void drives_wake(struct drives *drives)
{
    struct can_msg unread[CAN_SOCKET_BATCH];
    int more = can_socket_waiting_bytes(&drives->socket) > PILE_BYTES;
    while (more != 0 && drives->failed == 0) {
        const int count = can_socket_receive(&drives->socket, unread, &more);
        drives->failed = count < 0 ? count : 0;
    }
}

void drives_process(struct drives *drives, uint32_t elapsed_us)
{
    if (drives->rules.count > 0) {
        node_faults_process(&drives->faults, clock_ns());
    }
    for (size_t i = 0; i < drives->count; i++) {
        drive_node_process(&drives->nodes[i], elapsed_us);
    }
    if (drives->module.id != 0) {
        io_module_process(&drives->module, elapsed_us);
    }
}
