/* SPDX-License-Identifier: MIT */
/* The store of the Linux port (port/linux/store.c) in a file: what is written stays, and a disk that takes no more
 * gives an error. Run by `make unit`; writes a temporary file. */
#define _GNU_SOURCE
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <unistd.h>

#include <unity.h>

/* Waits for the disk, and the byte that was on it before at the end of the first bank of parameters. */
static unsigned syncs;
static uint8_t *watched;
static uint8_t seen[8];

static int counted_sync(int fd)
{
    (void)fd;
    if (watched != NULL && syncs < sizeof seen) {
        seen[syncs] = *watched;
    }
    ++syncs;
    return 0;
}

#define fdatasync counted_sync

#define port_stream_memory linux_stream_memory
#define port_cache_memory  linux_cache_memory
#include "port/linux/store.c" /* NOLINT(bugprone-suspicious-include) */

static char name[] = "/tmp/hodograph-store-XXXXXX";
static const uint8_t some[] = {1, 2, 3, 4, 5, 6, 7};

void setUp(void)
{
}

void tearDown(void)
{
}

static void test_what_is_written_is_read(void)
{
    uint8_t *const at = ram_store.memory + 4091; /* in two pages */
    TEST_ASSERT_EQUAL_INT(0, ram_store_put(at, some, sizeof some));
    TEST_ASSERT_EQUAL_MEMORY(some, at, sizeof some);
}

/* The content is on the disk before the record, and the record before the save is answered. */
static void test_a_commit_record_is_written_after_the_content(void)
{
    uint8_t *const end = ram_store.parameters + PORT_STORE_PARAMETER_BYTES;
    syncs = 0;
    watched = end - 1;
    TEST_ASSERT_EQUAL_INT(0, ram_store_put(ram_store.parameters, some, sizeof some));
    TEST_ASSERT_EQUAL_UINT(0, syncs);
    TEST_ASSERT_EQUAL_INT(0, ram_store_put(end - sizeof some, some, sizeof some));
    TEST_ASSERT_EQUAL_UINT(2, syncs);
    TEST_ASSERT_EQUAL_UINT8(0, seen[0]);
    TEST_ASSERT_EQUAL_UINT8(7, seen[1]);
    watched = NULL;
    TEST_ASSERT_EQUAL_INT(0, ram_store_put(ram_store.parameters - sizeof some, some, sizeof some));
    TEST_ASSERT_EQUAL_UINT(2, syncs); /* a program: drives may be on */
}

/* As a full disk: the file may not be written any more. */
static void test_a_full_disk_is_an_error(void)
{
    const struct rlimit none = {0, RLIM_INFINITY};
    struct rlimit before;
    (void)signal(SIGXFSZ, SIG_IGN);
    TEST_ASSERT_EQUAL_INT(0, getrlimit(RLIMIT_FSIZE, &before));
    TEST_ASSERT_EQUAL_INT(0, setrlimit(RLIMIT_FSIZE, &none));
    const int written = ram_store_put(ram_store.memory, some, sizeof some);
    TEST_ASSERT_EQUAL_INT(0, setrlimit(RLIMIT_FSIZE, &before));
    TEST_ASSERT_EQUAL_INT(PORT_ERR_STORE, written);
}

int main(void)
{
    UNITY_BEGIN();
    const int fd = mkstemp(name);
    if (fd < 0 || store_open(name) != 0) {
        return EXIT_FAILURE;
    }
    (void)close(fd);
    (void)unlink(name);
    RUN_TEST(test_what_is_written_is_read);
    RUN_TEST(test_a_commit_record_is_written_after_the_content);
    RUN_TEST(test_a_full_disk_is_an_error);
    return UNITY_END();
}
