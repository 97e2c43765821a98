/* SPDX-License-Identifier: MIT */
/* Blocks of the ring lie apart, in the memory, and keep their bytes until they are freed. Run by `make unit`; no
 * I/O. */
#include "app/chunk_ring.h"

#include <stddef.h>
#include <string.h>

#include "unity.h"

#define SIZE   1000u
#define BLOCKS 64u

struct block {
    uint8_t *bytes;
    uint32_t size;
    uint8_t mark;
};

static uint8_t memory[SIZE + 8u] __attribute__((aligned(8)));
static struct chunk_ring ring;
static struct block blocks[BLOCKS]; /* oldest first */
static uint32_t count;
static uint32_t random_state;

void setUp(void)
{
    memset(memory, 0xEE, sizeof memory);
    chunk_ring_init(&ring, memory, SIZE);
    count = 0;
    random_state = 1;
}

void tearDown(void)
{
}

static uint32_t random_below(uint32_t most)
{
    random_state = random_state * 1664525u + 1013904223u;
    return (random_state >> 8) % most;
}

static void expect_intact(void)
{
    for (uint32_t i = 0; i < count; ++i) {
        for (uint32_t k = 0; k < blocks[i].size; ++k) {
            TEST_ASSERT_EQUAL_HEX8(blocks[i].mark, blocks[i].bytes[k]);
        }
    }
    TEST_ASSERT_EQUAL_HEX8(0xEE, memory[SIZE]);
}

/* A block of `least` bytes, of which `keep` stay. */
static void take(uint32_t least, uint32_t keep, uint8_t mark)
{
    const uint32_t room = chunk_ring_room(&ring);
    uint32_t size;
    uint8_t *bytes = chunk_ring_take(&ring, least, &size);
    TEST_ASSERT_EQUAL(least <= room, bytes != NULL);
    if (bytes == NULL) {
        return;
    }
    TEST_ASSERT_TRUE(size >= least && bytes >= memory && bytes + size <= memory + SIZE);
    TEST_ASSERT_EQUAL_UINT(0, (size_t)(bytes - memory) % CHUNK_RING_ALIGNMENT);
    memset(bytes, mark, size);
    blocks[count++] =
        (struct block){.bytes = bytes, .size = keep < least ? keep : least, .mark = mark};
    chunk_ring_trim(&ring, blocks[count - 1u].size);
}

static void give_back(void)
{
    uint32_t size;
    const uint32_t room = chunk_ring_room(&ring);
    uint8_t *bytes = room > 0u ? chunk_ring_take(&ring, 1u + random_below(room), &size) : NULL;
    if (bytes != NULL) {
        memset(bytes, 0xAA, size);
        chunk_ring_give_back(&ring);
        TEST_ASSERT_EQUAL_UINT32(room, chunk_ring_room(&ring));
    }
}

static void free_oldest(void)
{
    if (count > 1u) {
        chunk_ring_free_oldest(&ring, blocks[1].bytes);
        count--;
        memmove(blocks, blocks + 1, count * sizeof blocks[0]);
    }
}

static void test_an_empty_ring_is_one_block(void)
{
    uint32_t size;
    TEST_ASSERT_EQUAL_UINT32(SIZE, chunk_ring_room(&ring));
    TEST_ASSERT_NULL(chunk_ring_take(&ring, SIZE + 1u, &size));
    TEST_ASSERT_EQUAL_PTR(memory, chunk_ring_take(&ring, SIZE, &size));
    TEST_ASSERT_EQUAL_UINT32(0, chunk_ring_room(&ring));
    chunk_ring_give_back(&ring);
    TEST_ASSERT_EQUAL_UINT32(SIZE, chunk_ring_room(&ring));
}

static void test_a_port_without_memory(void)
{
    uint32_t size;
    chunk_ring_init(&ring, NULL, 0);
    TEST_ASSERT_EQUAL_UINT32(0, chunk_ring_room(&ring));
    TEST_ASSERT_NULL(chunk_ring_take(&ring, 0, &size));
    TEST_ASSERT_NULL(chunk_ring_take(&ring, 1, &size));
}

static void test_any_sequence(void)
{
    for (uint32_t i = 0; i < 20000u; ++i) {
        const uint32_t what = random_below(8);
        if (what < 4u && count < BLOCKS) {
            take(1u + random_below(400), 1u + random_below(400), (uint8_t)i);
        } else if (what < 7u) {
            free_oldest();
        } else {
            give_back();
        }
        expect_intact();
        if (random_below(1000) == 0u) {
            chunk_ring_clear(&ring);
            count = 0;
            TEST_ASSERT_EQUAL_UINT32(SIZE, chunk_ring_room(&ring));
        }
    }
}

/* Blocks of a third are never kept out for ever: with one of them left there is room for the next. */
static void test_a_third_fits_beside_one_block(void)
{
    const uint32_t third = SIZE / 3u & ~(CHUNK_RING_ALIGNMENT - 1u);
    for (uint32_t i = 0; i < 500u; ++i) {
        const uint32_t before = count;
        take(third - random_below(100), third, (uint8_t)i);
        TEST_ASSERT_EQUAL_UINT32(before + 1u, count);
        expect_intact();
        while (count > 1u) {
            free_oldest();
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_an_empty_ring_is_one_block);
    RUN_TEST(test_a_port_without_memory);
    RUN_TEST(test_any_sequence);
    RUN_TEST(test_a_third_fits_beside_one_block);
    return UNITY_END();
}
