# SPDX-License-Identifier: MIT
"""Words for the codes of the controller's objects (docs/protocol.md section 3)."""

from __future__ import annotations

STATES = {
    0: "boot",
    1: "off",
    2: "enabling",
    3: "ready",
    4: "running",
    5: "stopping",
    6: "fault",
    7: "holding",
    8: "held",
}
PROGRAM_STATES = {0: "none", 1: "receiving", 2: "ready"}

REFUSALS = {
    1: "no program is loaded: hodograph upload FILE",
    2: "the axes are away from the program's start: hodograph goto FILE",
    3: "the axes are moving: wait, or hodograph stop",
    4: "the drives are off: hodograph start switches them on",
    5: "a fault is present: see hodograph status",
    6: "drives are missing: are all nodes of the machine file on the bus?",
    7: "the program is not within the limits now configured: upload it again",
    8: "no program runs: hodograph start",
}
"""Object 0x2003 sub 4, and the remedy."""

_EMERGENCIES = (
    (0x8110, "CAN overrun: frames were lost"),
    (0x8120, "CAN error passive: check cable and termination"),
    (0x8130, "no life sign from the drive: is it powered and connected?"),
    (0x8140, "recovered from bus-off: check cable and termination"),
    (0x8611, "following error: the axis does not follow its setpoints"),
    (0x8612, "reference limit: the axis is at the end of its travel"),
)
_EMERGENCY_CLASSES = {
    0x10: "generic error",
    0x20: "current",
    0x30: "voltage",
    0x40: "temperature",
    0x50: "device hardware",
    0x60: "device software",
    0x70: "additional modules",
    0x80: "monitoring",
    0x81: "communication",
    0x82: "protocol error",
    0x86: "positioning",
    0x90: "external error",
    0xF0: "additional functions",
    0xFF: "device specific",
}


def fault_text(code: int) -> str:
    """A CANopen emergency error code in words."""
    for known, text in _EMERGENCIES:
        if code == known:
            return text
    for mask in (0xFF, 0xF0):
        name = _EMERGENCY_CLASSES.get((code >> 8) & mask)
        if name is not None:
            return name
    return "unknown fault"


def drive_state(statusword: int) -> str:
    """The CiA 402 state that a statusword tells."""
    low = statusword & 0x6F
    if statusword & 0x4F == 0x00:
        return "not ready"
    if statusword & 0x4F == 0x40:
        return "switch on disabled"
    names = {0x21: "ready to switch on", 0x23: "switched on", 0x27: "operation enabled"}
    if low in names:
        return names[low]
    if low == 0x07:
        return "quick stop"
    if statusword & 0x4F == 0x0F:
        return "fault reaction"
    if statusword & 0x4F == 0x08:
        return "fault"
    return f"unknown (0x{statusword:04X})"
