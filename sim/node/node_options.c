/* SPDX-License-Identifier: MIT */
#include <stdio.h>
#include <string.h>

#include "node/node_options_private.h"

const char node_options_help[] =
    "usage: hodograph-drive --bus INTERFACE --axis KEY=VALUE,... [--axis ...] [--faults FILE]\n"
    "\n"
    "Simulated CiA 402 servo drives on a SocketCAN bus, one per --axis (at most 6).\n"
    "\n"
    "  --bus INTERFACE  a CAN interface that is up, such as vcan0\n"
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
    "                   interpolation of setpoints: 0 linear, 1 cubic (0)\n"
    "                   speed of the loop: 0 exact, 1 differences of the encoder (0);\n"
    "                   delay_samples from encoder to volts: 0 or 1 (0)\n"
    "                   limit_negative_mm, limit_positive_mm: limit switches, on from there\n"
    "                   outwards (none); home_from_mm, home_to_mm: home switch (none)\n"
    "                   rated_torque_nm (half of what volts_limit gives), rated_current_a (5),\n"
    "                   overload_s: until the overload trips at volts_limit, 0 never (10)\n"
    "                   friction_volts: Coulomb friction, as volts (0)\n"
    "                   brake_volts: holding brake, as volts (volts_limit)\n"
    "\n"
    "SIGTERM or SIGINT ends it. Exit status: 0 ended as asked, 2 wrong usage, 4 bus not usable.\n";

enum node_options_result node_options_wrong(struct node_options_reason reason, const char *what,
                                            const char *value)
{
    (void)snprintf(reason.text, reason.size, "%s '%s' (see --help)", what, value);
    return NODE_OPTIONS_WRONG;
}

static enum node_options_result set_option(struct node_options *options, const char *name,
                                           char *value, struct node_options_reason reason)
{
    const bool faults = strcmp(name, "--faults") == 0;
    if (!faults && strcmp(name, "--bus") != 0 && strcmp(name, "--axis") != 0) {
        return node_options_wrong(reason, "unknown option", name);
    }
    if (value == NULL) {
        return node_options_wrong(reason, "a value must follow the option", name);
    }
    if (strcmp(name, "--axis") == 0) {
        return node_options_add_axis(options, value, reason);
    }
    if (faults) {
        options->faults = value;
    } else {
        options->bus = value;
    }
    return NODE_OPTIONS_OK;
}

enum node_options_result node_options_parse(struct node_options *options, int argc, char **argv,
                                            char *reason_text, size_t size)
{
    const struct node_options_reason reason = {reason_text, size};
    options->bus = NULL;
    options->faults = NULL;
    options->axis_count = 0;
    for (int i = 1; i < argc; i += 2) {
        if (strcmp(argv[i], "--help") == 0) {
            return NODE_OPTIONS_HELP;
        }
        char *value = i + 1 < argc ? argv[i + 1] : NULL;
        if (set_option(options, argv[i], value, reason) != NODE_OPTIONS_OK) {
            return NODE_OPTIONS_WRONG;
        }
    }
    if (options->bus == NULL) {
        return node_options_wrong(reason, "the option is missing:", "--bus");
    }
    if (options->axis_count == 0) {
        return node_options_wrong(reason, "the option is missing:", "--axis");
    }
    return NODE_OPTIONS_OK;
}
