# SPDX-License-Identifier: MIT
"""Texts for the codes of the controller's objects (docs/reference/protocol.md section 3). Used by bus/, faults/,
monitor/ and job_run. No I/O.
"""

from __future__ import annotations

from .drive_states import state_of_statusword as drive_state
from .fault_texts import detail_text, fault_text, fault_words

__all__ = [
    "CONFIGURED",
    "PROGRAM_STATES",
    "REFUSALS",
    "STATES",
    "STORED",
    "TIMINGS",
    "detail_text",
    "drive_state",
    "fault_text",
    "fault_words",
]

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
    9: "homing",
    10: "quick stop",
}
TIMINGS = {0: "kept", 1: "not permitted", 2: "not permitted, accepted"}
"""Object 0x2040: whether the ticks of the controller are on time; `kept`: guaranteed. Otherwise the operating system
does not permit real-time priority.
"""
PROGRAM_STATES = {0: "none", 1: "receiving", 2: "ready"}

CONFIGURED = {0: "none", 1: "confirmed", 2: "restored"}
"""Object 0x2050 sub 3: by a host since power-on, or from the controller's store."""
STORED = {
    0: "nothing",
    1: "whole",
    2: "of another firmware",
    3: "damaged",
    4: "defaults",
}
"""Object 0x2050 sub 4."""

OUTSIDE_TRAVEL_REMEDY = (
    "where its drive must not be switched on: move it with the drive's own tool or by hand, or enlarge travel_mm "
    "meanwhile"
)

REFUSALS = {
    1: "no program is loaded: hodograph upload FILE",
    2: "the axes are away from the program's start: hodograph goto FILE; for `start --from MM` first hodograph goto "
    "--to the point of `hodograph spline FILE --at MM` plus [work] offset_mm, then hodograph upload FILE",
    3: "the axes are moving: wait, or hodograph stop",
    4: "the drives are off: hodograph start switches them on",
    5: "a fault is present: see hodograph status",
    6: "drives are missing: are all nodes of the machine file on the bus?",
    7: "the program is not within the limits now configured: upload it again",
    8: "no program runs: hodograph start",
    9: "the drives are on, homing wants them off: hodograph stop --off",
    10: "a drive that shall be homed has no homing mode: set method = 0 in its [axis.homing] of the machine file",
    11: "no axis has a homing method: add it to the machine file",
    12: "it has no configuration since its power-on: hodograph configure FILE (upload, goto and run do it as well); "
    "with --store it is there after the next power-on too",
    13: "axes with a homing method are not homed since their drive's power-on: hodograph home, or --unhomed on purpose",
    17: "the controller is being ended: start it again",
    18: "the program has more path axes than are configured: configure the machine it was compiled for "
    "(hodograph configure MACHINE), or compile it for this one",
    19: "a streamed job is open that was started before or begins elsewhere: end it with an upload, or stream again",
    20: "another client has loaded another program or job meanwhile: upload it again",
    21: "a stop was commanded meanwhile: give the command again",
    22: f"an axis is outside its travel by more than start_tolerance_mm, {OUTSIDE_TRAVEL_REMEDY}",
    16: "the drives are real and this computer does not permit real-time priority: run the controller with "
    "CAP_SYS_NICE and CAP_IPC_LOCK (or as root), or with --no-realtime at your own risk",
}
"""Object 0x2003 sub 4, and the remedy."""
