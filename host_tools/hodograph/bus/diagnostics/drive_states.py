# SPDX-License-Identifier: MIT
"""Names of the states of a CiA 402 drive, and texts for the bits of its statusword. Used by bus/diagnostics/ and
sdo/status. No I/O.
"""

from __future__ import annotations

NOT_THERE = "not there"
DRIVE_STATES = (
    "not ready to switch on",
    "switch on disabled",
    "ready to switch on",
    "switched on",
    "operation enabled",
    "quick stop active",
    "fault reaction active",
    "fault",
)
"""In the order of enum cia402_state (firmware/canopen/cia402.h)."""

_SHORT, _LONG = 0x4F, 0x6F
_CODINGS = (
    (_SHORT, 0x00),
    (_SHORT, 0x40),
    (_LONG, 0x21),
    (_LONG, 0x23),
    (_LONG, 0x27),
    (_LONG, 0x07),
    (_SHORT, 0x0F),
    (_SHORT, 0x08),
)

INPUTS = ((0x1, "negative limit"), (0x2, "positive limit"), (0x4, "home switch"))
"""Bits of 0x60FD."""


def state_of_statusword(statusword: int) -> str:
    """The state in a statusword (0x6041)."""
    for (mask, coding), name in zip(_CODINGS, DRIVE_STATES, strict=True):
        if statusword & mask == coding:
            return name
    return f"unknown (0x{statusword:04X})"


def state_of_number(number: int) -> str:
    """The state in object 0x2026: 0: missing, else enum cia402_state + 1."""
    if number == 0:
        return NOT_THERE
    return DRIVE_STATES[number - 1] if number <= len(DRIVE_STATES) else f"unknown ({number})"


def inputs_on(inputs: int) -> tuple[str, ...]:
    """Names of the digital inputs (0x60FD) that are on; those of the manufacturer, from bit 16 on, by number."""
    named = [name for bit, name in INPUTS if inputs & bit]
    named += [f"input {bit - 16}" for bit in range(16, 32) if inputs >> bit & 1]
    return tuple(named)
