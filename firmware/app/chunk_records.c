/* SPDX-License-Identifier: MIT */
/* Implements app/chunk_records.h (see there): the coefficient records of a job in chunks, made ahead of the tick. Used
 * by app/stream. Main loop; takes the machine's lock where it is needed. Changes its struct, the port's memory for
 * records, and which of them the motion of the machine uses. */
#include "app/chunk_records.h"

#include "core/kernel.h"
#include "port/port.h"

void chunk_records_init(struct chunk_records *records)
{
    uint32_t size;
    uint8_t *memory = port_cache_memory(&size);
    coefficient_cache_init(&records->cache, memory, size);
}

int chunk_records_check(const struct chunk_records *records, const struct program *program,
                        const struct config *config)
{
    const struct kernel *kernel = kernel_find(config->kernel);
    if (kernel == NULL) {
        return PROGRAM_ERR_KERNEL;
    }
    return coefficient_cache_fits(&records->cache, kernel, program->header.axis_count)
               ? 0
               : PROGRAM_ERR_ROOM;
}

const struct coefficients_window *chunk_records_begin(struct chunk_records *records,
                                                      const struct program *program,
                                                      const struct config *config)
{
    return coefficient_cache_begin(&records->cache, program, kernel_find(config->kernel));
}

void chunk_records_go_on(struct chunk_records *records, struct machine *machine,
                         const struct program *program)
{
    struct motion *motion = &machine->motion;
    struct feed_place place;
    port_lock();
    feed_override_place(&motion->feed, &motion->interp, &place);
    port_unlock();
    const struct coefficients_window *window =
        coefficient_cache_prepare(&records->cache, program, &place);
    if (window == NULL) {
        return;
    }
    port_lock();
    const bool used = feed_override_use(&motion->feed, &motion->interp, window) != 0;
    port_unlock();
    if (used) {
        coefficient_cache_used(&records->cache);
    }
}

const struct coefficients_window *chunk_records_for_next(struct chunk_records *records,
                                                         const struct machine *machine,
                                                         const struct chunk *next)
{
    const struct motion *motion = &machine->motion;
    struct feed_place place;
    port_lock();
    const bool now = feed_override_may_take_over(&motion->feed, &motion->interp, next, &place) != 0;
    port_unlock();
    return now ? coefficient_cache_prepare(&records->cache, &next->program, &place) : NULL;
}

void chunk_records_taken_over(struct chunk_records *records)
{
    coefficient_cache_used(&records->cache);
}
