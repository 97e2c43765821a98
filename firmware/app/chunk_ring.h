/* SPDX-License-Identifier: MIT */
/*
 * chunk_ring: memory for the chunks of a job: contiguous blocks, taken and freed in the same order. Used by app/stream.
 * Changes only its struct.
 *
 * A block that does not fit after the newest one begins at the start of the memory again; the remainder at the end
 * stays unused until then. The newest block may be made smaller, or given back, as long as no other has been taken.
 * Offsets, not pointers: no block moves, and nothing is stored in the memory itself. Main loop.
 */
#ifndef APP_CHUNK_RING_H
#define APP_CHUNK_RING_H

#include <stdbool.h>
#include <stdint.h>

#define CHUNK_RING_ALIGNMENT 8u /* of every block */

/* Contents private. */
struct chunk_ring {
    uint8_t *memory; /* aligned to CHUNK_RING_ALIGNMENT */
    uint32_t size;
    uint32_t oldest; /* offset of the oldest block, which is freed next */
    uint32_t newest; /* offset of the newest block */
    uint32_t write;  /* write offset: the end of the newest block, where the next one begins */
    uint32_t write_before; /* the write offset before the newest block was taken */
    bool used;             /* there is a block */
};

/* `memory`: all memory of the ring; `size` may be 0. */
void chunk_ring_init(struct chunk_ring *ring, uint8_t *memory, uint32_t size);

/* Frees all blocks. */
void chunk_ring_clear(struct chunk_ring *ring);

/* Bytes of the largest block that can be taken now. Pure. */
uint32_t chunk_ring_room(const struct chunk_ring *ring);

/* Takes a block of at least `least` bytes, as large as its place allows: *size. NULL: there is no such place. */
uint8_t *chunk_ring_take(struct chunk_ring *ring, uint32_t least, uint32_t *size);

/* Shortens the newest block to its first `size` bytes, at least 1. */
void chunk_ring_trim(struct chunk_ring *ring, uint32_t size);

/* Frees the newest block. */
void chunk_ring_give_back(struct chunk_ring *ring);

/* Frees the oldest block; `next` is the one taken after it. */
void chunk_ring_free_oldest(struct chunk_ring *ring, const uint8_t *next);

#endif
