/* SPDX-License-Identifier: MIT */
/* Implements node/node_options.h (see there): the command line of hodograph-drive. Called by node/main. Main thread,
 * once; prints nothing. */
#include "node/node_options.h"

#include <errno.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "port/linux/long_options.h"

const char node_options_help[] =
    "usage: hodograph-drive --bus INTERFACE --axis KEY=VALUE,... [--axis ...] [--module NODE]\n"
    "                       [--faults FILE]\n"
    "\n"
    "Simulated CiA 402 servo drives on a SocketCAN bus, one per --axis (at most 6), and an I/O\n"
    "module (CiA 401) with 16 digital and 3 analogue outputs.\n"
    "\n"
    "  --bus INTERFACE  a CAN interface that is up, such as vcan0, or the path of a local bus "
    "(hodograph-hub)\n"
    "  --module NODE    the I/O module; without --axis nothing else\n"
    "  --faults FILE    fault rules, one a line (docs/reference/protocol.md section 4); what they "
    "do is\n"
    "                   printed, one JSON object a line\n"
    "  --axis ...       one drive; keys that are required:\n"
    "                   node (2 to 127), gain_rad_s_v, time_constant_s, screw_mm_rad,\n"
    "                   torque_to_volts, volts_limit, k_pp_rad_s_mm, k_pv_nm_s_rad, k_iv_per_s,\n"
    "                   k_pf_rad_mm, k_vf\n"
    "                   keys with a default:\n"
    "                   encoder_counts_per_rev (1048576), loop_rate_hz (16000),\n"
    "                   counts_per_mm (1000000), position_mm (0), serial (the node),\n"
    "                   vendor (0; another one: the controller takes it for a real drive)\n"
    "                   interpolation of setpoints: 0 linear, 1 cubic, 2 none (0)\n"
    "                   speed of the loop: 0 exact, 1 differences of the encoder (0);\n"
    "                   delay_samples from encoder to volts: 0 or 1 (0)\n"
    "                   integral of the loop: 0 backward, 1 forward Euler (0)\n"
    "                   limit_negative_mm, limit_positive_mm: limit switches, on from there\n"
    "                   outwards (none); home_from_mm, home_to_mm: home switch (none)\n"
    "                   rated_torque_nm (half of what volts_limit gives), rated_current_a (5),\n"
    "                   overload_s: until the overload trips at volts_limit, 0 never (10)\n"
    "                   friction_volts: Coulomb friction, as volts (0)\n"
    "                   brake_volts: holding brake, as volts (volts_limit)\n"
    "\n"
    "SIGTERM or SIGINT ends it. Exit status: 0 ended as asked, 2 wrong usage, 4 bus not usable.\n";

/* Reports an error and its word. */
static enum node_options_result wrong(const struct long_options *line, const char *text,
                                      const char *word)
{
    (void)long_options_wrong(line, text, word);
    return NODE_OPTIONS_WRONG;
}

enum key_kind { KEY_NUMBER, KEY_U32, KEY_U8 };

struct key {
    const char *name;
    size_t offset; /* in struct node_options_axis */
    enum key_kind kind;
    bool required;
};

#define AT(member) offsetof(struct node_options_axis, member)

static const struct key keys[] = {
    {"node", AT(node), KEY_U8, true},
    {"gain_rad_s_v", AT(config.plant.gain_rad_s_v), KEY_NUMBER, true},
    {"time_constant_s", AT(config.plant.time_constant_s), KEY_NUMBER, true},
    {"screw_mm_rad", AT(config.plant.screw_mm_rad), KEY_NUMBER, true},
    {"torque_to_volts", AT(config.plant.torque_to_volts), KEY_NUMBER, true},
    {"volts_limit", AT(config.plant.volts_limit), KEY_NUMBER, true},
    {"k_pp_rad_s_mm", AT(config.pdff.k_pp_rad_s_mm), KEY_NUMBER, true},
    {"k_pv_nm_s_rad", AT(config.pdff.k_pv_nm_s_rad), KEY_NUMBER, true},
    {"k_iv_per_s", AT(config.pdff.k_iv_per_s), KEY_NUMBER, true},
    {"k_pf_rad_mm", AT(config.pdff.k_pf_rad_mm), KEY_NUMBER, true},
    {"k_vf", AT(config.pdff.k_vf), KEY_NUMBER, true},
    {"encoder_counts_per_rev", AT(config.encoder_counts_per_rev), KEY_U32, false},
    {"loop_rate_hz", AT(config.loop_rate_hz), KEY_U32, false},
    {"counts_per_mm", AT(config.counts_per_mm), KEY_U32, false},
    {"interpolation", AT(config.interpolation), KEY_U32, false},
    {"speed", AT(config.speed), KEY_U32, false},
    {"delay_samples", AT(config.delay_samples), KEY_U32, false},
    {"integral", AT(config.integral), KEY_U32, false},
    {"position_mm", AT(position_mm), KEY_NUMBER, false},
    {"limit_negative_mm", AT(equipment.limit_negative_mm), KEY_NUMBER, false},
    {"limit_positive_mm", AT(equipment.limit_positive_mm), KEY_NUMBER, false},
    {"home_from_mm", AT(equipment.home_from_mm), KEY_NUMBER, false},
    {"home_to_mm", AT(equipment.home_to_mm), KEY_NUMBER, false},
    {"rated_torque_nm", AT(equipment.rated_torque_nm), KEY_NUMBER, false},
    {"rated_current_a", AT(equipment.rated_current_a), KEY_NUMBER, false},
    {"overload_s", AT(equipment.overload_s), KEY_NUMBER, false},
    {"friction_volts", AT(equipment.friction_volts), KEY_NUMBER, false},
    {"brake_volts", AT(equipment.brake_volts), KEY_NUMBER, false},
    {"serial", AT(equipment.serial), KEY_U32, false},
    {"vendor", AT(equipment.vendor), KEY_U32, false},
};

enum { KEYS = sizeof keys / sizeof keys[0] };

/* A value in [0, most] without sign or blanks. */
static bool read_whole(const char *text, unsigned long most, unsigned long *out)
{
    char *end = NULL;
    errno = 0;
    *out = strtoul(text, &end, 10);
    return *text >= '0' && *text <= '9' && *end == '\0' && errno == 0 && *out <= most;
}

/* Finite, and of a size that any key may have. */
static bool read_number(const char *text, double *out)
{
    char *end = NULL;
    *out = strtod(text, &end);
    return end != text && *end == '\0' && *out >= -1e12 && *out <= 1e12;
}

static bool store(struct node_options_axis *axis, const struct key *key, const char *text)
{
    unsigned char *field = (unsigned char *)axis + key->offset;
    unsigned long whole = 0;
    double number = 0.0;
    if (key->kind == KEY_NUMBER) {
        if (!read_number(text, &number)) {
            return false;
        }
        memcpy(field, &number, sizeof number);
        return true;
    }
    if (!read_whole(text, key->kind == KEY_U8 ? 127u : UINT32_MAX, &whole)) {
        return false;
    }
    if (key->kind == KEY_U8) {
        *field = (unsigned char)whole;
    } else {
        const uint32_t value = (uint32_t)whole;
        memcpy(field, &value, sizeof value);
    }
    return true;
}

static const struct key *find_key(const char *name)
{
    for (size_t i = 0; i < KEYS; i++) {
        if (strcmp(keys[i].name, name) == 0) {
            return &keys[i];
        }
    }
    return NULL;
}

/* One KEY=VALUE; cuts `item` in two. */
static enum node_options_result set_item(struct node_options_axis *axis, char *item, bool *seen,
                                         const struct long_options *line)
{
    char *value = strchr(item, '=');
    if (value == NULL) {
        return wrong(line, "--axis takes KEY=VALUE,..., not", item);
    }
    *value++ = '\0';
    const struct key *key = find_key(item);
    if (key == NULL) {
        return wrong(line, "--axis has no key", item);
    }
    if (seen[key - keys]) {
        return wrong(line, "--axis gives twice the key", item);
    }
    seen[key - keys] = true;
    if (!store(axis, key, value)) {
        value[-1] = '=';
        return wrong(line, "--axis has a value that is no number or out of range:", item);
    }
    return NODE_OPTIONS_OK;
}

/* Equipment that is not given has the defaults for the motor. */
static void equip(struct node_options_axis *axis, const bool *seen)
{
    struct node_options_axis whole = *axis;
    equipment_init(&whole.equipment, &axis->config);
    whole.equipment.serial = axis->node;
    for (size_t i = 0; i < KEYS; i++) {
        const size_t size = keys[i].kind == KEY_NUMBER ? sizeof(double) : sizeof(uint32_t);
        if (seen[i] && keys[i].offset >= AT(equipment)) {
            memcpy((unsigned char *)&whole + keys[i].offset,
                   (const unsigned char *)axis + keys[i].offset, size);
        }
    }
    *axis = whole;
}

static enum node_options_result check_axis(const struct node_options *options, const bool *seen,
                                           const struct long_options *line)
{
    const struct node_options_axis *axis = &options->axes[options->axis_count];
    for (size_t i = 0; i < KEYS; i++) {
        if (keys[i].required && !seen[i]) {
            return wrong(line, "--axis lacks the key", keys[i].name);
        }
    }
    if (axis->node < 2) {
        return wrong(line, "--axis needs a node from 2 to 127, not", axis->node == 1 ? "1" : "0");
    }
    for (size_t i = 0; i < options->axis_count; i++) {
        if (options->axes[i].node == axis->node) {
            return wrong(line, "--axis: two drives have the same", "node");
        }
    }
    return NODE_OPTIONS_OK;
}

/* Takes KEY=VALUE,... as another drive; cuts `spec` to pieces. */
static enum node_options_result add_axis(struct node_options *options, char *spec,
                                         const struct long_options *line)
{
    bool seen[KEYS] = {false};
    if (options->axis_count == NODE_OPTIONS_AXES) {
        return wrong(line, "too many --axis: at most", "6");
    }
    struct node_options_axis *axis = &options->axes[options->axis_count];
    memset(axis, 0, sizeof *axis);
    axis->config.encoder_counts_per_rev = 1048576;
    axis->config.loop_rate_hz = 16000;
    axis->config.counts_per_mm = 1000000;
    axis->config.period_us = 1000;
    for (char *item = spec; item != NULL;) {
        char *next = strchr(item, ',');
        if (next != NULL) {
            *next++ = '\0';
        }
        if (set_item(axis, item, seen, line) != NODE_OPTIONS_OK) {
            return NODE_OPTIONS_WRONG;
        }
        item = next;
    }
    equip(axis, seen);
    if (check_axis(options, seen, line) != NODE_OPTIONS_OK) {
        return NODE_OPTIONS_WRONG;
    }
    options->axis_count++;
    return NODE_OPTIONS_OK;
}

static enum node_options_result set_module(struct node_options *options,
                                           const struct long_options *line)
{
    unsigned long node = 0;
    if (!read_whole(line->value, 127u, &node) || node < 2u) {
        return wrong(line, "--module needs a node from 2 to 127, not", line->value);
    }
    options->module = (uint8_t)node;
    return NODE_OPTIONS_OK;
}

static enum node_options_result check(const struct node_options *options,
                                      const struct long_options *line)
{
    if (options->bus == NULL) {
        return wrong(line, "the option is missing:", "--bus");
    }
    if (options->axis_count == 0 && options->module == 0) {
        return wrong(line, "the option is missing:", "--axis");
    }
    for (size_t i = 0; i < options->axis_count; i++) {
        if (options->axes[i].node == options->module) {
            return wrong(line, "--module and an axis have the same", "node");
        }
    }
    return NODE_OPTIONS_OK;
}

enum node_options_result node_options_parse(struct node_options *options, int argc, char **argv,
                                            char *reason, size_t size)
{
    static const struct option known[] = {
        {"help", no_argument, NULL, 'h'},         {"bus", required_argument, NULL, 'b'},
        {"faults", required_argument, NULL, 'f'}, {"axis", required_argument, NULL, 'a'},
        {"module", required_argument, NULL, 'm'}, {NULL, 0, NULL, 0}};
    struct long_options line = long_options_begin(argc, argv, known, reason, size);
    line.quoted = true;
    options->bus = NULL;
    options->faults = NULL;
    options->axis_count = 0;
    options->module = 0;
    for (;;) {
        switch (long_options_next(&line)) {
        case LONG_OPTIONS_END:
            return check(options, &line);
        case 'h':
            return NODE_OPTIONS_HELP;
        case 'b':
            options->bus = line.value;
            break;
        case 'f':
            options->faults = line.value;
            break;
        case 'a':
            if (add_axis(options, line.value, &line) != NODE_OPTIONS_OK) {
                return NODE_OPTIONS_WRONG;
            }
            break;
        case 'm':
            if (set_module(options, &line) != NODE_OPTIONS_OK) {
                return NODE_OPTIONS_WRONG;
            }
            break;
        default:
            return NODE_OPTIONS_WRONG;
        }
    }
}
