/* SPDX-License-Identifier: MIT */
/* Implements port/linux/store.h (see there): the stores of port.h as memory of the process, or as a file that is mapped
 * there and outlives it. Used by port_linux.c: main thread, at the start of the process; ram_store_put: main loop.
 * Opens, maps and writes the file; writes errors to stderr. */
#define _GNU_SOURCE
#include "port/linux/store.h"

#include <errno.h>
#include <fcntl.h>
#include <libgen.h>
#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "port/common/ram_store.h"
#include "port/port.h"

#define PROGRAM_BYTES (64u * 1024u * 1024u)
#define STORE_BYTES   ((size_t)PORT_STORE_BANKS * PROGRAM_BYTES + RAM_STORE_PARAMETER_BYTES)
#define OWNER_ONLY    (S_IRUSR | S_IWUSR)

struct ram_store ram_store;

static int failed(const char *file, const char *why)
{
    (void)fprintf(stderr, "hodograph-controller: --store %s: %s\n", file, why);
    return PORT_ERR_SYSTEM;
}

/* A new file is sparse: it uses no space on the disk until it is written. */
static const char *prepare(int fd)
{
    struct stat found;
    if (flock(fd, LOCK_EX | LOCK_NB) != 0) {
        return "another controller uses this file";
    }
    if (fstat(fd, &found) != 0) {
        return strerror(errno);
    }
    if (found.st_size != 0 && (size_t)found.st_size != STORE_BYTES) {
        return "is no store of this controller: name another file";
    }
    if (ftruncate(fd, (off_t)STORE_BYTES) != 0) {
        return strerror(errno);
    }
    (void)fsync(fd);
    return NULL;
}

static int store_fd = -1;

/* Waits until the disk has what was written; some file systems cannot. */
static bool on_disk(int fd)
{
    return fdatasync(fd) == 0 || errno == EINVAL || errno == ENOSYS;
}

/* The end of a bank of parameters is its commit record: a computer that loses its power has either all of a bank or its
 * old record. Programs are not waited for, because a disk may take seconds and drives may be on: they have a CRC. */
static bool is_commit_record(const uint8_t *end)
{
    return end > ram_store.parameters &&
           (size_t)(end - ram_store.parameters) % PORT_STORE_PARAMETER_BYTES == 0u;
}

/* If the disk is full, pwrite() fails. A write to the mapped page would end the process (SIGBUS). */
int ram_store_put(uint8_t *at, const uint8_t *data, uint32_t size)
{
    if (store_fd < 0) {
        memcpy(at, data, size);
        return 0;
    }
    const bool commit = is_commit_record(at + size);
    if (commit && !on_disk(store_fd)) {
        return PORT_ERR_STORE;
    }
    const bool written = pwrite(store_fd, data, size, at - ram_store.memory) == (ssize_t)size &&
                         (!commit || on_disk(store_fd));
    return written ? 0 : PORT_ERR_STORE;
}

/* A new file is in its folder also after a loss of power. A folder that may not be read stays as it is. */
static void sync_folder(const char *file)
{
    char path[PATH_MAX];
    if (snprintf(path, sizeof path, "%s", file) >= (int)sizeof path) {
        return;
    }
    const int fd = open(dirname(path), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd >= 0) {
        (void)fsync(fd);
        (void)close(fd);
    }
}

static bool map(int flags, int fd)
{
    void *found = mmap(NULL, STORE_BYTES, PROT_READ | PROT_WRITE, flags, fd, 0);
    if (found == MAP_FAILED) {
        return false;
    }
    uint8_t *memory = found;
    ram_store = (struct ram_store){.memory = memory,
                                   .bank_bytes = PROGRAM_BYTES,
                                   .parameters = memory + (size_t)PORT_STORE_BANKS * PROGRAM_BYTES};
    store_fd = fd;
    return true;
}

/* The descriptor stays open: the lock on the file goes with it. */
int store_open(const char *file)
{
    if (file == NULL) {
        return map(MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1)
                   ? 0
                   : failed("(memory)", strerror(errno));
    }
    const int fd = open(file, O_RDWR | O_CREAT | O_CLOEXEC, OWNER_ONLY);
    if (fd < 0) {
        return failed(file, strerror(errno));
    }
    const char *why = prepare(fd);
    if (why == NULL && !map(MAP_SHARED, fd)) {
        why = strerror(errno);
    }
    if (why != NULL) {
        (void)close(fd);
        return failed(file, why);
    }
    sync_folder(file);
    return 0;
}

/* Pages that are never written cost nothing. The cache is large, because the main loop may be late on a computer. */
#define CACHE_BYTES (4u * 1024u * 1024u)
static uint8_t ring[STORE_RING_MAX] __attribute__((aligned(8)));
static uint8_t cache[CACHE_BYTES] __attribute__((aligned(8)));
static uint32_t ring_bytes = STORE_RING_MAX;

void store_ring(uint32_t bytes)
{
    ring_bytes = bytes;
}

uint8_t *port_stream_memory(uint32_t *size)
{
    *size = ring_bytes;
    return ring;
}

uint8_t *port_cache_memory(uint32_t *size)
{
    *size = sizeof cache;
    return cache;
}
