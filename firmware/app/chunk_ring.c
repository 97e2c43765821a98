/* SPDX-License-Identifier: MIT */
/* Implements app/chunk_ring.h (see there): memory for the chunks of a stream. Used by app/stream. Main loop. Changes
 * only its struct. */
#include "app/chunk_ring.h"

#include <stddef.h>
#include <string.h>

static uint32_t rounded_down(uint32_t size)
{
    return size & ~(CHUNK_RING_ALIGNMENT - 1u);
}

static uint32_t rounded_up(uint32_t size)
{
    return rounded_down(size + CHUNK_RING_ALIGNMENT - 1u);
}

void chunk_ring_init(struct chunk_ring *ring, uint8_t *memory, uint32_t size)
{
    memset(ring, 0, sizeof *ring);
    ring->memory = memory;
    ring->size = rounded_down(size);
}

void chunk_ring_clear(struct chunk_ring *ring)
{
    chunk_ring_init(ring, ring->memory, ring->size);
}

/* The newest block lies before the oldest one. */
static bool is_wrapped(const struct chunk_ring *ring)
{
    return ring->used && ring->write <= ring->oldest;
}

static uint32_t room_after_newest(const struct chunk_ring *ring)
{
    return (is_wrapped(ring) ? ring->oldest : ring->size) - ring->write;
}

static uint32_t room_at_start(const struct chunk_ring *ring)
{
    return is_wrapped(ring) ? 0u : ring->oldest;
}

uint32_t chunk_ring_room(const struct chunk_ring *ring)
{
    const uint32_t after = room_after_newest(ring);
    const uint32_t start = room_at_start(ring);
    return after > start ? after : start;
}

uint8_t *chunk_ring_take(struct chunk_ring *ring, uint32_t least, uint32_t *size)
{
    const bool after = room_after_newest(ring) >= least;
    const uint32_t at = after ? ring->write : 0u;
    *size = after ? room_after_newest(ring) : room_at_start(ring);
    if (*size < least || *size == 0u) {
        return NULL;
    }
    ring->write_before = ring->write;
    ring->newest = at;
    ring->write = at + *size;
    ring->oldest = ring->used ? ring->oldest : at;
    ring->used = true;
    return ring->memory + at;
}

void chunk_ring_trim(struct chunk_ring *ring, uint32_t size)
{
    ring->write = ring->newest + rounded_up(size);
}

void chunk_ring_give_back(struct chunk_ring *ring)
{
    if (ring->oldest == ring->newest) {
        chunk_ring_clear(ring);
    } else {
        ring->write = ring->write_before;
    }
}

void chunk_ring_free_oldest(struct chunk_ring *ring, const uint8_t *next)
{
    ring->oldest = (uint32_t)(next - ring->memory);
}
