/* SPDX-License-Identifier: MIT */
/*
 * The semihosting of a machine that is its own host: so the images of tests/target run as processes too.
 *
 *   PROGRAM STORE [WORD ...]
 *
 * STORE is a file with what the emulator would load into the store; the words are the command line of the image. Part
 * of the programs of `make target-hosts`, which tests/system/test_target_bits.py runs; reads and writes the files of
 * its command line.
 */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "port/semihost/semihost.h"

#define STORE_SIZE 0x100000u

extern uint8_t startup_store_base[];
uint8_t startup_store_base[STORE_SIZE];

int target_main(void);

static FILE *files[4]; /* handle 0 is none */
static char words[1024];

static void read_words(int argc, char **argv)
{
    for (int i = 2; i < argc; i++) {
        const size_t used = strlen(words);
        (void)snprintf(words + used, sizeof words - used, i == 2 ? "%s" : " %s", argv[i]);
    }
}

int main(int argc, char **argv)
{
    FILE *const store = argc > 1 ? fopen(argv[1], "rb") : NULL;
    if (store == NULL) {
        (void)fprintf(stderr, "usage: %s STORE [WORD ...]\n", argv[0]);
        return 2;
    }
    (void)fread(startup_store_base, 1, sizeof startup_store_base, store);
    (void)fclose(store);
    read_words(argc, argv);
    return target_main();
}

int semihost_open(const char *path, enum semihost_mode mode)
{
    for (int handle = 1; handle < 4; handle++) {
        if (files[handle] == NULL) {
            files[handle] = fopen(path, mode == SEMIHOST_READ ? "rb" : "wb");
            return files[handle] == NULL ? -1 : handle;
        }
    }
    return -1;
}

int semihost_read(int handle, void *data, size_t size)
{
    return fread(data, 1, size, files[handle]) == size ? 0 : -1;
}

int semihost_write(int handle, const void *data, size_t size)
{
    return fwrite(data, 1, size, files[handle]) == size ? 0 : -1;
}

int semihost_close(int handle)
{
    FILE *const file = files[handle];
    files[handle] = NULL;
    return fclose(file) == 0 ? 0 : -1;
}

int semihost_command_line(char *line, size_t size)
{
    if (words[0] == '\0' || strlen(words) >= size) {
        return -1;
    }
    memcpy(line, words, strlen(words) + 1);
    return 0;
}

void semihost_print(const char *text)
{
    (void)fputs(text, stdout);
}

void semihost_exit(int status)
{
    exit(status);
}
