/* SPDX-License-Identifier: MIT */
/* Implements app/objects_stream.h (see there): handlers of object 0x2060, for the table and the hooks in objects.c.
 * Called by objects.c only. Main loop. Reads and changes controller->stream, and reads the machine. */
#include "app/objects_stream.h"

#include "canopen/sdo_abort.h"
#include "port/port.h"

/* ---- Sub 1: a chunk ---- */

static bool is_under_way(const struct stream *stream)
{
    return stream->state == STREAM_UNDERRUN || stream->state == STREAM_PROGRAM_STOP ||
           (stream->state == STREAM_OPEN && stream->started);
}

uint32_t object_chunk_begin(struct controller *controller, uint32_t size)
{
    struct stream *stream = &controller->stream;
    stream_process(stream, &controller->machine);
    if (controller_moving(controller) && !is_under_way(stream)) {
        controller->refusal = MACHINE_MOVING;
        return SDO_ABORT_STATE;
    }
    return stream_begin(stream, size) == 0 ? SDO_OK : SDO_ABORT_MEMORY;
}

uint32_t object_chunk_write(struct controller *controller, uint32_t offset, const uint8_t *data,
                            uint32_t size)
{
    return stream_write(&controller->stream, offset, data, size) == 0 ? SDO_OK : SDO_ABORT_MEMORY;
}

uint32_t object_chunk_end(struct controller *controller, uint32_t size)
{
    controller_check_begins(controller);
    const int result = stream_finish(&controller->stream, size, &controller->config);
    controller_check_ends(controller);
    return result == 0 ? SDO_OK : SDO_ABORT_VALUE;
}

void object_chunk_abort(struct controller *controller)
{
    stream_abandon(&controller->stream);
}

/* ---- From sub 2 on ---- */

static uint64_t read_place(const struct stream *stream, const struct machine *machine, uint8_t sub)
{
    switch (sub) {
    case 8:
        return stream_committed_ms(stream, machine);
    case 9:
        return stream->place.sequence;
    case 10:
        return stream->place.line;
    case 11:
        return (uint64_t)stream_arc_length_q40_mm(stream, machine);
    case 12:
        return stream_remaining_ms(stream, machine);
    default:
        return stream->underruns;
    }
}

uint64_t object_read_stream(struct controller *controller, const struct od_entry *entry)
{
    const struct stream *stream = &controller->stream;
    switch (entry->sub) {
    case 2:
        return (uint64_t)stream->state;
    case 3:
        return stream->job;
    case 4:
        return stream->wanted;
    case 5:
        return (uint64_t)(int64_t)stream->refused.code;
    case 6:
        return stream->refused.index;
    case 7:
        return stream_free_bytes(stream);
    case 14:
        return stream->ring.size;
    case 16:
        return stream->optional_stop ? 1u : 0u;
    default:
        return read_place(stream, &controller->machine, entry->sub);
    }
}

uint32_t object_write_optional_stop(struct controller *controller, const struct od_entry *entry,
                                    uint64_t number)
{
    (void)entry;
    controller->stream.optional_stop = number != 0u;
    return SDO_OK;
}

uint32_t object_write_stream_close(struct controller *controller, const struct od_entry *entry,
                                   uint64_t number)
{
    (void)entry;
    (void)number; /* 1 */
    stream_process(&controller->stream, &controller->machine);
    if (is_under_way(&controller->stream)) {
        controller->refusal = MACHINE_MOVING;
        return SDO_ABORT_STATE;
    }
    stream_close(&controller->stream);
    return SDO_OK;
}
