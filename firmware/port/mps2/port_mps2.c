/* SPDX-License-Identifier: MIT */
/* Implements port/port.h for QEMU's mps2 boards: command line, console and end by semihosting. Used by firmware/app and
 * the ports. Contexts: port/port.h. Reads the command line and writes the console by semihosting, and ends the emulator
 * at the end. */
#include "port/port.h"

#include <string.h>

#include "port/common/decimal.h"
#include "port/cortex_m/startup.h"
#include "port/cortex_m/systick.h"
#include "port/mps2/command_line.h"
#include "port/mps2/interrupts.h"
#include "port/mps2/link.h"
#include "port/semihost/semihost.h"

enum exit_status { EXIT_USAGE = 2, EXIT_BUS = 4 };

#define LINE_SIZE 192u

static struct {
    char text[LINE_SIZE];
    struct command_line line;
    const struct link *link;
} self;

static void say(const char *what, const char *more)
{
    semihost_print("hodograph-controller: ");
    semihost_print(what);
    semihost_print(" ");
    semihost_print(more);
    semihost_print("\n");
}

/* Without a command line all options have their defaults. */
static int read_line(void)
{
    const char *wrong = "";
    if (semihost_command_line(self.text, sizeof self.text) != 0) {
        self.text[0] = '\0';
    }
    if (!command_line_parse(&self.line, self.text, &wrong)) {
        say("this is no argument of an emulated board:", wrong);
        return EXIT_USAGE;
    }
    return 0;
}

int port_begin(int argc, char **argv)
{
    (void)argc;
    (void)argv;
    const int status = read_line();
    if (status != 0) {
        return status;
    }
    self.link = self.line.fifo ? &link_fifo : &link_slcan;
    interrupts_begin(self.link);
    if (self.link->begin(&self.line) != 0) {
        say("cannot open the FIFOs", self.line.out);
        return EXIT_BUS;
    }
    port_log(PORT_NOTE, "this board is node", self.line.node);
    return 0;
}

int port_end(void)
{
    interrupts_end();
    self.link->end();
    if (!self.link->failed()) {
        return 0;
    }
    say("the bridge is gone:", "no bus");
    return EXIT_BUS;
}

bool port_stop_requested(void)
{
    return self.link->stop_requested() || self.link->failed();
}

bool port_stop_insisted(void)
{
    return false;
}

uint8_t port_node_id(void)
{
    return self.line.node;
}

int port_can_accept(const struct can_match *filters, size_t count)
{
    return count <= PORT_FILTERS ? self.link->accept(filters, count) : PORT_ERR_SYSTEM;
}

int port_can_send(const struct can_msg *message)
{
    return self.link->send(message);
}

bool port_can_delivered(void)
{
    return self.link->delivered();
}

uint32_t port_time_ns(void)
{
    return systick_ns();
}

uint32_t port_time_us(void)
{
    return systick_us();
}

void port_log(enum port_level level, const char *text, int32_t value)
{
    char digits[DECIMAL_SIZE];
    if (level == PORT_WARNING || self.line.verbose) {
        say(text, decimal(value, digits));
    }
}

void startup_exit(int status)
{
    semihost_exit(status);
}
