/* SPDX-License-Identifier: MIT */
/*
 * chunk_records: the coefficient records of a job in chunks. Only records near the motion exist, in the port's memory
 * for them (core/coefficient_cache.h). The main loop computes them ahead of the tick, for about half of the cache. If
 * the main loop stalls for longer than that, the tick has no point: fault 0x6100, and the drives stop by their own
 * ramps.
 *
 * Used by app/stream. Main loop; takes the machine's lock where it is needed. Changes its struct, the port's memory for
 * records, and which of them the motion of the machine uses.
 */
#ifndef APP_CHUNK_RECORDS_H
#define APP_CHUNK_RECORDS_H

#include <stdbool.h>

#include "app/machine/config.h"
#include "app/machine/machine.h"
#include "core/chunk.h"
#include "core/coefficient_cache.h"

/* Contents private. */
struct chunk_records {
    struct coefficient_cache cache;
};

void chunk_records_init(struct chunk_records *records);

/* 0: the motion can follow this program; PROGRAM_ERR_KERNEL: this image does not have the configured kernel;
 * PROGRAM_ERR_ROOM: the cache is too small for a program with so many axes. */
int chunk_records_check(const struct chunk_records *records, const struct program *program,
                        const struct config *config);

/* Records at the start of a program that has passed the check, for motion_begin_job. No motion may be under way. */
const struct coefficients_window *chunk_records_begin(struct chunk_records *records,
                                                      const struct program *program,
                                                      const struct config *config);

/* Makes records further on in the program that is executed. */
void chunk_records_go_on(struct chunk_records *records, struct machine *machine,
                         const struct program *program);

/* Records of the next chunk, for machine_take_over. NULL: it cannot be taken over now. */
const struct coefficients_window *chunk_records_for_next(struct chunk_records *records,
                                                         const struct machine *machine,
                                                         const struct chunk *next);
/* The machine has taken over the next chunk, with these records. */
void chunk_records_taken_over(struct chunk_records *records);

#endif
