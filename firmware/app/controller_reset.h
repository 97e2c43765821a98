/* SPDX-License-Identifier: MIT */
/* controller_reset: objects of the controller at power-on, and at the NMT services reset node and
 * reset communication (CiA 301, 7.3.2.2): all objects, or those below 0x2000, get their stored values (0x1010) or
 * else their defaults.
 *
 * The program stays: it is no parameter. All in the mainline; the resets come while the machine is
 * configurable only (controller_poll.c).
 */
#ifndef APP_CONTROLLER_RESET_H
#define APP_CONTROLLER_RESET_H

#include "app/controller.h"

extern const struct nmt_hooks controller_reset_hooks;

/* All values to the stored ones or their defaults, for this node; no errors. */
void controller_reset_values(struct controller *controller);

#endif
