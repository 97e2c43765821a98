# SPDX-License-Identifier: MIT
"""G and M codes: modal groups, the words that each code uses, and why others are refused. Used by toolpath/gcode. No
I/O; tables and pure functions.

G codes are integers of ten times their number: 532 is none, 592 is G59.2.
"""

from __future__ import annotations

from enum import IntEnum

AXIS_LETTERS = "xyzabc"
POLAR_LETTERS = "@^"


class Group(IntEnum):
    """Modal groups of G codes, numbered as in RS274/NGC; one code of each may be in a block."""

    NON_MODAL = 0
    MOTION = 1
    PLANE = 2
    DISTANCE = 3
    ARC_DISTANCE = 4
    FEED_MODE = 5
    UNITS = 6
    CUTTER_COMPENSATION = 7
    TOOL_LENGTH = 8
    RETRACT = 10
    COORDINATES = 12
    PATH_MODE = 13
    SPINDLE_MODE = 14
    LATHE = 15
    OFFSET_SWITCH = 16


G_GROUP: dict[int, Group] = {
    **dict.fromkeys((40, 100, 280, 281, 300, 301, 53, 530, 920), Group.NON_MODAL),
    **dict.fromkeys((0, 10, 20, 30, 50, 51, 52, 800, 810, 820, 830), Group.MOTION),
    **dict.fromkeys((170, 180, 190), Group.PLANE),
    **dict.fromkeys((900, 910), Group.DISTANCE),
    **dict.fromkeys((901, 911), Group.ARC_DISTANCE),
    **dict.fromkeys((930, 940, 950), Group.FEED_MODE),
    **dict.fromkeys((200, 210), Group.UNITS),
    400: Group.CUTTER_COMPENSATION,
    **dict.fromkeys((430, 431, 490), Group.TOOL_LENGTH),
    **dict.fromkeys((980, 990), Group.RETRACT),
    **dict.fromkeys((540, 550, 560, 570, 580, 590, 591, 592, 593), Group.COORDINATES),
    **dict.fromkeys((610, 611, 640), Group.PATH_MODE),
    970: Group.SPINDLE_MODE,
    80: Group.LATHE,
    **dict.fromkeys((921, 922, 923), Group.OFFSET_SWITCH),
}

G_USES: dict[int, str] = {
    0: AXIS_LETTERS + POLAR_LETTERS,
    10: AXIS_LETTERS + POLAR_LETTERS,
    20: AXIS_LETTERS + POLAR_LETTERS + "ijkrp",
    30: AXIS_LETTERS + POLAR_LETTERS + "ijkrp",
    40: "p",
    50: "xyijpq",
    51: "xyij",
    52: "xypl",
    100: AXIS_LETTERS + "lpr",
    280: AXIS_LETTERS,
    300: AXIS_LETTERS,
    430: "h",
    431: AXIS_LETTERS,
    640: "pq",
    810: "xyzrl" + POLAR_LETTERS,
    820: "xyzrlp" + POLAR_LETTERS,
    830: "xyzrlq" + POLAR_LETTERS,
    920: AXIS_LETTERS,
}
"""Letters of the words that a G code uses, without F, S and T, which need no code."""

CYCLES = frozenset((810, 820, 830))
TAKES_AXES = frozenset((100, 280, 300, 920))
"""Non-modal codes whose axis words do not mean a motion in the active mode."""

M_GROUP: dict[int, int] = {
    **dict.fromkeys((0, 1, 2, 30), 4),
    **dict.fromkeys((62, 63, 64, 65, 67, 68), 5),
    6: 6,
    **dict.fromkeys((3, 4, 5), 7),
    **dict.fromkeys((7, 8, 9), 8),
    **dict.fromkeys((48, 49), 9),
}
STOPPING, OUTPUT, TOOL_CHANGE, SPINDLE, COOLANT, OVERRIDES = 4, 5, 6, 7, 8, 9

M_USES: dict[int, str] = {62: "p", 63: "p", 64: "p", 65: "p", 67: "eq", 68: "eq"}

_CAM = "let the CAM system write"
_REFUSED_G: dict[int, str] = {
    70: "diameter mode of lathes: program radii",
    **dict.fromkeys((150, 160), "polar mode: use the words @ and ^, or x and y"),
    **dict.fromkeys((171, 181, 191), "planes of axes U, V and W"),
    **dict.fromkeys((330, 331), "motion synchronised with the spindle"),
    **dict.fromkeys((382, 383, 384, 385), "probing: its end is not known in advance"),
    **dict.fromkeys(
        (410, 411, 420, 421), f"cutter radius compensation: {_CAM} the path of the tool's centre"
    ),
    432: "added tool offsets: use G43 or G43.1",
    520: "local coordinates: use G92",
    **dict.fromkeys((700, 710, 711, 712, 720, 721, 722), f"lathe cycles: {_CAM} the moves"),
    **dict.fromkeys(
        (730, 740, 840, 850, 860, 870, 880, 890), f"this canned cycle: {_CAM} the moves"
    ),
    760: f"thread cutting: {_CAM} the moves",
    960: "constant surface speed: use G97",
}
_REFUSED_M: dict[int, str] = {
    19: "orientation of the spindle",
    **dict.fromkeys((50, 51, 52, 53), "single override switches: use M48 and M49"),
    60: "pallet changes: use M0",
    61: "M61: use T and M6",
    66: "waiting for inputs: its end is not known in advance",
    **dict.fromkeys((70, 71, 72, 73), "saved modes: set the modes again"),
    **dict.fromkeys((98, 99), "calls by M98: use O-words sub and call"),
    **dict.fromkeys(range(100, 200), "commands of the user's own"),
}


def g_name(code: int) -> str:
    """The usual name, such as G5.1."""
    whole, tenth = divmod(code, 10)
    return f"G{whole}.{tenth}" if tenth else f"G{whole}"


def why_not_g(code: int) -> str:
    """Text of the refusal of a G code without a group."""
    why = _REFUSED_G.get(code)
    unknown = "is unknown: docs/reference/gcode.md lists the codes that are understood"
    return (
        f"{g_name(code)} {unknown}" if why is None else f"{g_name(code)} is not supported ({why})"
    )


def why_not_m(code: int) -> str:
    """Text of the refusal of an M code without a group."""
    why = _REFUSED_M.get(code)
    unknown = "is unknown: docs/reference/gcode.md lists the codes that are understood"
    return f"M{code} {unknown}" if why is None else f"M{code} is not supported ({why})"


REFUSED_LETTERS = {
    "d": "D words belong to cutter radius compensation, which is not supported: "
    f"{_CAM} the path of the tool's centre",
    "u": "axis U is not supported: use X, Y, Z, A, B or C",
    "v": "axis V is not supported: use X, Y, Z, A, B or C",
    "w": "axis W is not supported: use X, Y, Z, A, B or C",
    "n": "a line number can only begin a line: move it",
    "o": "an O-word must be alone in its line: move it to a line of its own",
    "$": "more than one spindle is not supported: remove the $ word",
    "*": "checksums are not supported: remove them",
    "%": '"%" must be alone in its line',
    "/": '"/" can only begin a line',
}
