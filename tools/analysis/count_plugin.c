/* SPDX-License-Identifier: MIT */
/*
 * A plugin for QEMU's translator: instructions executed between two labels, call by call and part by part. Loaded by
 * QEMU, which tools/analysis/counting.py starts. Reads MAP, writes OUT.
 *
 *   qemu-system-arm ... -plugin FILE.so,map=MAP,out=OUT
 *
 * MAP has a line for each label and part, addresses in hexadecimal, ends not included:
 *
 *   part LOW HIGH N       instructions from LOW to HIGH belong to part N (1 ... 127); those that no line names belong to
 *                         the part before them in time: a helper counts for who calls it
 *   begin ADDRESS         a call begins with this instruction, in part 0
 *   end ADDRESS           a call has ended before this instruction
 *   last ADDRESS          a call ends with this instruction
 *   pause ADDRESS         an interrupt begins with this instruction: not counted ...
 *   resume ADDRESS        ... up to and with this one; interrupts may nest
 *
 * OUT gets 128 words of 32 bits for each call that has ended: the instructions of each part. An instruction that is
 * skipped by its condition counts like one that is executed: it is fetched and takes its time.
 *
 * Debian's QEMU has no header for plugins, so what is used of version 1 of that interface is declared here.
 */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct qemu_plugin_tb;
struct qemu_plugin_insn;
typedef uint64_t plugin_id;

size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb *tb);
struct qemu_plugin_insn *qemu_plugin_tb_get_insn(const struct qemu_plugin_tb *tb, size_t index);
uint64_t qemu_plugin_insn_vaddr(const struct qemu_plugin_insn *insn);
void qemu_plugin_register_vcpu_tb_trans_cb(plugin_id id,
                                           void (*translated)(plugin_id id,
                                                              struct qemu_plugin_tb *tb));
void qemu_plugin_register_vcpu_insn_exec_cb(struct qemu_plugin_insn *insn,
                                            void (*executed)(unsigned cpu, void *data), int flags,
                                            void *data);
int qemu_plugin_install(plugin_id id, const void *info, int argc, char **argv);

__attribute__((visibility("default"))) int qemu_plugin_version = 1;

enum { PARTS = 128, LINES = 1 << 16 };
enum kind { PART, BEGIN, END, LAST, PAUSE, RESUME };
static const char *const kinds[] = {"part", "begin", "end", "last", "pause", "resume"};

struct line {
    uint64_t low;
    uint64_t high;
    enum kind kind;
    unsigned part;
};

/* What an instruction is: its part (0: of whoever comes before) and its labels, a bit for each. */
union mark {
    void *data;
    struct {
        uint16_t part;
        uint16_t labels;
    } bits;
};

static struct line lines[LINES];
static size_t line_count;
static FILE *out;
static uint32_t counts[PARTS];
static unsigned part;
static unsigned pauses;
static int counting;

static void finish(void)
{
    if (counting) {
        fwrite(counts, sizeof counts[0], PARTS, out);
    }
    counting = 0;
}

static void executed(unsigned cpu, void *data)
{
    const union mark mark = {.data = data};
    const unsigned labels = mark.bits.labels;
    (void)cpu;
    if (labels != 0) {
        if ((labels & 1u << END) != 0) {
            finish();
        }
        if ((labels & 1u << BEGIN) != 0 && pauses == 0) {
            memset(counts, 0, sizeof counts);
            part = 0;
            counting = 1;
        }
        pauses += (labels & 1u << PAUSE) != 0;
    }
    if (counting && pauses == 0) {
        part = mark.bits.part != 0 ? mark.bits.part : part;
        counts[part]++;
    }
    if ((labels & 1u << RESUME) != 0 && pauses > 0) {
        pauses--;
    }
    if ((labels & 1u << LAST) != 0 && pauses == 0) {
        finish();
    }
}

static void translated(plugin_id id, struct qemu_plugin_tb *tb)
{
    (void)id;
    for (size_t i = 0; i < qemu_plugin_tb_n_insns(tb); i++) {
        struct qemu_plugin_insn *insn = qemu_plugin_tb_get_insn(tb, i);
        const uint64_t address = qemu_plugin_insn_vaddr(insn);
        union mark mark = {.data = NULL};
        for (size_t k = 0; k < line_count; k++) {
            if (lines[k].kind == PART && address >= lines[k].low && address < lines[k].high) {
                mark.bits.part = (uint16_t)lines[k].part;
            } else if (lines[k].kind != PART && address == lines[k].low) {
                mark.bits.labels |= (uint16_t)(1u << lines[k].kind);
            }
        }
        qemu_plugin_register_vcpu_insn_exec_cb(insn, executed, 0, mark.data);
    }
}

/* 0, or -1 when the line is none of those above. */
static int read_line(const char *text, struct line *line)
{
    unsigned long long low = 0;
    unsigned long long high = 0;
    char word[8] = "";
    const int words = sscanf(text, "%7s %llx %llx %u", word, &low, &high, &line->part);
    line->low = low;
    line->high = high;
    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++) {
        if (strcmp(word, kinds[i]) == 0) {
            line->kind = (enum kind)i;
            return words == (i == PART ? 4 : 2) && line->part < PARTS ? 0 : -1;
        }
    }
    return -1;
}

static int read_map(const char *path)
{
    char text[80];
    FILE *map = fopen(path, "r");
    int bad = map == NULL;
    while (!bad && fgets(text, sizeof text, map) != NULL) {
        bad = line_count == LINES || read_line(text, &lines[line_count]) != 0;
        line_count++;
    }
    if (map != NULL) {
        fclose(map);
    }
    return bad ? -1 : 0;
}

__attribute__((visibility("default"))) int qemu_plugin_install(plugin_id id, const void *info,
                                                               int argc, char **argv)
{
    (void)info;
    for (int i = 0; i < argc; i++) {
        if (strncmp(argv[i], "map=", 4) == 0 && read_map(argv[i] + 4) != 0) {
            fprintf(stderr, "count_plugin: cannot use %s\n", argv[i] + 4);
            return -1;
        }
        if (strncmp(argv[i], "out=", 4) == 0) {
            out = fopen(argv[i] + 4, "wb");
        }
    }
    if (out == NULL) {
        fprintf(stderr, "count_plugin: map=MAP,out=OUT are needed\n");
        return -1;
    }
    qemu_plugin_register_vcpu_tb_trans_cb(id, translated);
    return 0;
}
