/* SPDX-License-Identifier: MIT */
/*
 * main() of a harness without libFuzzer: runs the files that it is given, or those of its corpus, tests/data/fuzz/NAME
 * for a program fuzz_NAME, in the root of the tree; and on the empty input. Each run may abort. Linked with each
 * harness. Run by `make test` and `make unit`; reads the files, and writes their names to stderr.
 */
#define _GNU_SOURCE
#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fuzz.h"
#include "unity.h"

#define INPUT_MAX 65536u

static const char *const *files;
static int file_count;
static char corpus[256];

static void replay(const char *path)
{
    static uint8_t bytes[INPUT_MAX];
    FILE *file = fopen(path, "rb");
    TEST_ASSERT_NOT_NULL_MESSAGE(file, path);
    const size_t size = fread(bytes, 1, sizeof bytes, file);
    (void)fclose(file);
    uint8_t *exact = malloc(size + 1u); /* so that the sanitizer sees any read beyond */
    TEST_ASSERT_NOT_NULL(exact);
    memcpy(exact, bytes, size);
    fprintf(stderr, "input %s\n", path);
    (void)LLVMFuzzerTestOneInput(exact, size);
    free(exact);
}

static int is_input(const struct dirent *entry)
{
    return entry->d_name[0] != '.';
}

static void test_corpus(void)
{
    struct dirent **names = NULL;
    const int count = scandir(corpus, &names, is_input, alphasort);
    TEST_ASSERT_GREATER_THAN_INT_MESSAGE(0, count, corpus);
    for (int i = 0; i < count; ++i) {
        char path[600];
        (void)snprintf(path, sizeof path, "%s/%s", corpus, names[i]->d_name);
        replay(path);
        free(names[i]);
    }
    free(names);
}

static void test_files(void)
{
    for (int i = 0; i < file_count; ++i) {
        replay(files[i]);
    }
}

static void test_the_empty_input(void)
{
    static const uint8_t nothing = 0;
    TEST_ASSERT_EQUAL_INT(0, LLVMFuzzerTestOneInput(&nothing, 0));
}

int main(int argc, char **argv)
{
    const char *name = strrchr(argv[0], '/');
    name = name != NULL ? name + 1 : argv[0];
    name = strncmp(name, "fuzz_", 5) == 0 ? name + 5 : name;
    (void)snprintf(corpus, sizeof corpus, "tests/data/fuzz/%s", name);
    files = (const char *const *)argv + 1;
    file_count = argc - 1;
    UNITY_BEGIN();
    if (file_count > 0) {
        RUN_TEST(test_files);
    } else {
        RUN_TEST(test_corpus);
        RUN_TEST(test_the_empty_input);
    }
    return UNITY_END();
}
