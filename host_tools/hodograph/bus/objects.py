# SPDX-License-Identifier: MIT
"""Objects, commands and states of the controller (docs/protocol.md section 3) by name."""

from __future__ import annotations

DEVICE_TYPE, PERIOD = 0x1000, 0x1006
PROGRAM, COMMAND, STATE, FAULT = 0x2000, 0x2001, 0x2002, 0x2003
CONFIGURATION, AXIS_NODE, TRAVEL_MINIMUM, TRAVEL_MAXIMUM = 0x2004, 0x2005, 0x2006, 0x2007
STATISTICS, MOTION = 0x2008, 0x2009
STATUSWORD, ACTUAL, DRIVE_ERROR, TARGET = 0x200A, 0x200B, 0x200C, 0x200D
OVERRIDE, START_POSITION = 0x2010, 0x2011

ENABLE, START, STOP, DISABLE, RESET, HOLD, RESUME, START_FROM = 1, 2, 3, 4, 5, 6, 7, 8
BOOT, OFF, ENABLING, READY, RUNNING, STOPPING, FAULT_STATE, HOLDING, HELD = range(9)
ON_PATH = (RUNNING, HOLDING, HELD)
"""States in which a stop has something to stop."""
MOVING = (*ON_PATH, STOPPING)
"""States in which a program is under way."""
REFUSED_MOVING = 3

Object = tuple[int, int | None]
"""Index and sub-index, None for an object without."""
