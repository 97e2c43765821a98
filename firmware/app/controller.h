/* SPDX-License-Identifier: MIT */
/*
 * controller: the controller as a CANopen node: connects machine, tick, protocol objects and port. Used by app/main.c.
 * The functions start the port, send frames, and change the one controller.
 *
 *     static struct controller controller;        the only instance lives in main
 *     controller_init(&controller, port_node_id());
 *     controller_start(&controller);              interrupts on
 *     while (...) { port_wait(...); controller_poll(&controller); }
 *
 * docs/reference/architecture.md draws which context runs what. All functions: main loop.
 */
#ifndef APP_CONTROLLER_H
#define APP_CONTROLLER_H

#include <stdbool.h>
#include <stdint.h>

#include "app/controller_state.h"

/* The longest the main loop may sleep without a frame: the resolution of its timeouts. */
#define CONTROLLER_POLL_US 5000u

/* The most time that one round counts in the timeouts of the protocols. So a main loop that was busy (a program check),
 * or a host that stalled, causes no timeout of the other nodes. */
#define CONTROLLER_ELAPSED_MAX_US 20000u

/* Everything to its power-on state: stored parameters are restored. `node` is the number of the port, which a stored
 * one (0x2054) replaces. */
void controller_init(struct controller *controller, uint8_t node);

/* Turns the interrupts on. 0 or PORT_ERR_SYSTEM. */
int controller_start(struct controller *controller);

/* One round: takes every waiting frame, lets time pass, sends what is due. */
void controller_poll(struct controller *controller);

/* Ends in bounded time: stops along the path if running, switches the drives off, leaves them pre-operational. True if
 * all of that succeeded. Interrupts stay on. */
bool controller_shut_down(struct controller *controller);

#endif
