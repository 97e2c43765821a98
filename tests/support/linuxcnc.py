# SPDX-License-Identifier: MIT
"""LinuxCNC's interpreter `rs274` as an oracle, and its commands and those of `read_gcode` in one form. Used by tests of
toolpaths. Starts processes; writes temporary files. The first use downloads LinuxCNC's Debian packages to
build/linuxcnc (tools/fetch_linuxcnc.sh).

`rs274` prints canonical commands with four decimals, in the units of the program and relative to all offsets.
`canonical` follows the offsets and gives machine positions in mm, so that a position is off by a few 1e-4 units.
"""

from __future__ import annotations

import fcntl
import functools
import math
import os
import re
import subprocess
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from hodograph.toolpath import moves

ROOT = Path(__file__).resolve().parent.parent.parent
_PLACE = ROOT / "build" / "linuxcnc"
_LIMIT_S = 60
TOOLS = {
    tool: (2.54 * (tool % 3), -5.08 * (tool % 2), 2.54 * (tool + 3), 0.0, 0.0, 0.0)
    for tool in (*range(1, 11), 99, 100, 101)
}
"""The tool table that `run_rs274` gives to the interpreter (in inches, the unit of its machine), in mm."""

Item = tuple[str, tuple[float, ...]]
"""Name of a command and its numbers."""


@functools.cache
def unpacked() -> Path:
    """Where the packages of LinuxCNC are unpacked; the test fails with the reason if they cannot be had."""
    _PLACE.parent.mkdir(exist_ok=True)
    with _PLACE.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # tests in other processes need it too
        if not (_PLACE / ".ready").exists():
            command = ["bash", str(ROOT / "tools" / "fetch_linuxcnc.sh"), str(_PLACE)]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            if done.returncode != 0:
                pytest.fail(f"LinuxCNC's package cannot be had: {done.stderr.strip()}")
    return _PLACE / "root"


def programs() -> list[Path]:
    """The programs that come with LinuxCNC."""
    return sorted(
        path for path in unpacked().rglob("*") if path.suffix in (".ngc", ".nc") and path.is_file()
    )


@dataclass
class Said:
    """What `rs274` said of a program: its commands up to its end or error, and the error, empty if there is none."""

    items: list[Item]
    error: str


def run_rs274(program: Path, limit_s: float = _LIMIT_S) -> Said:
    """Interpret a program in a folder of its own. The error is "time" if it takes too long."""
    root = unpacked()
    libraries = f"{root}/usr/lib:{root}/usr/lib/x86_64-linux-gnu"
    with tempfile.TemporaryDirectory() as home:
        table = "".join(
            f"T{tool} P{tool} D1 X{x / 25.4:g} Y{y / 25.4:g} Z{z / 25.4:g}\n"
            for tool, (x, y, z, *_) in TOOLS.items()
        )
        Path(home, "tools.tbl").write_text(table)
        Path(home, "parameters.var").touch()
        command = [f"{root}/usr/bin/rs274", "-t", "tools.tbl", "-v", "parameters.var", "-g"]
        with (
            Path(home, "out").open("w+", errors="surrogateescape") as out,
            Path(home, "err").open("w+", errors="surrogateescape") as err,
        ):
            try:
                subprocess.run(
                    [*command, str(program)],
                    cwd=home,
                    env={**os.environ, "HOME": home, "LD_LIBRARY_PATH": libraries},
                    stdin=subprocess.DEVNULL,
                    stdout=out,
                    stderr=err,
                    timeout=limit_s,
                    check=False,
                )
                late = ""
            except subprocess.TimeoutExpired:
                late = "time"
            out.seek(0)
            err.seek(0)
            errors = [
                line for line in err.read().splitlines() if line.strip() not in ("", "executing")
            ]
            if any("error while loading" in line for line in errors):
                pytest.fail(f"rs274 does not run: {errors}")
            canon = Canon()
            for line in out:
                canon.read(line)
    ended = bool(canon.items) and canon.items[-1][0] == "end"
    return Said(canon.items, late or ("" if ended else " ".join(errors) or "no end"))


_COMMAND = re.compile(r"\s*\d+ N[.\d-]*\s*([A-Z]\w*)\((.*)\)\s*$")


@dataclass
class Canon:
    """Canonical commands of `rs274` as items."""

    items: list[Item] = field(default_factory=list)
    unit: float = 1.0
    origin: list[float] = field(default_factory=lambda: [0.0] * 6)
    g92: list[float] = field(default_factory=lambda: [0.0] * 6)
    tool: list[float] = field(default_factory=lambda: [0.0] * 6)
    angle_deg: float = 0.0
    rate: float = 0.0
    per_revolution: bool = False
    plane: str = "XY"
    rotation: int = 0
    speed: float = 0.0
    mist: int = 0
    flood: int = 0

    def read(self, line: str) -> None:
        """Take a line of output."""
        found = _COMMAND.match(line)
        if found is not None and (not self.items or self.items[-1][0] != "end"):
            step = getattr(self, f"_{found[1].lower()}", None)
            if step is not None:
                step(found[2])

    def _numbers(self, text: str) -> list[float]:
        return [float(each) for each in re.findall(r"-?(?:\d+\.?\d*|nan|inf)", text)]

    def _lengths(self, numbers: list[float]) -> list[float]:
        return [number * self.unit for number in numbers[:3]] + numbers[3:6]

    def _machine(self, program: list[float]) -> tuple[float, ...]:
        shifted = [p + q for p, q in zip(program, self.g92, strict=True)]
        angle = math.radians(self.angle_deg)
        x, y = shifted[:2]
        shifted[0] = x * math.cos(angle) - y * math.sin(angle)
        shifted[1] = x * math.sin(angle) + y * math.cos(angle)
        return tuple(p + q + r for p, q, r in zip(shifted, self.origin, self.tool, strict=True))

    def _use_length_units(self, text: str) -> None:
        self.unit = 25.4 if "INCHES" in text else 1.0

    def _set_g5x_offset(self, text: str) -> None:
        self.origin = self._lengths(self._numbers(text)[1:])

    def _set_g92_offset(self, text: str) -> None:
        self.g92 = self._lengths(self._numbers(text))

    def _use_tool_length_offset(self, text: str) -> None:
        self.tool = self._lengths(self._numbers(text))

    def _set_xy_rotation(self, text: str) -> None:
        self.angle_deg = float(text)

    def _set_feed_rate(self, text: str) -> None:
        self.rate = float(text) * self.unit / 60.0

    def _set_feed_mode(self, text: str) -> None:
        self.per_revolution = self._numbers(text)[1] == 1.0

    @property
    def feed_mm_s(self) -> float:
        """Speed of a move, in mm/s."""
        return self.rate * (self.speed if self.per_revolution else 1.0)

    def _select_plane(self, text: str) -> None:
        self.plane = text[-2:]

    def _straight_traverse(self, text: str) -> None:
        self.items.append(("rapid", self._machine(self._lengths(self._numbers(text)))))

    def _straight_feed(self, text: str) -> None:
        end = self._machine(self._lengths(self._numbers(text)))
        self.items.append(("straight", (*end, self.feed_mm_s)))

    def _arc_feed(self, text: str) -> None:
        e1, e2, c1, c2, turns, e3, *abc = self._numbers(text)
        first, second, normal = {"XY": (0, 1, 2), "XZ": (2, 0, 1), "YZ": (1, 2, 0)}[self.plane]
        end, centre = [0.0] * 3, [0.0] * 3
        end[first], end[second], end[normal] = e1, e2, e3
        centre[first], centre[second], centre[normal] = c1, c2, e3
        machine = self._machine(self._lengths(end + abc))
        middle = self._machine(self._lengths(centre + abc))
        numbers = (*machine, middle[first], middle[second], turns)
        self.items.append((f"arc{first}", (*numbers, self.feed_mm_s)))

    def _nurbs_feed(self, text: str) -> None:
        self.items.append(("nurbs", (self._numbers(text)[0],)))

    def _dwell(self, text: str) -> None:
        self.items.append(("dwell", (float(text),)))

    def _set_spindle_speed(self, text: str) -> None:
        self._spindle(self.rotation, self._numbers(text)[1])

    def _start_spindle_clockwise(self, text: str) -> None:
        self._spindle(1, self.speed)

    def _start_spindle_counterclockwise(self, text: str) -> None:
        self._spindle(-1, self.speed)

    def _stop_spindle_turning(self, text: str) -> None:
        self._spindle(0, self.speed)

    def _spindle(self, rotation: int, speed: float) -> None:
        self.rotation, self.speed = rotation, speed
        self.items.append(("spindle", (rotation, speed)))

    def _coolant(self, mist: int, flood: int) -> None:
        self.mist, self.flood = mist, flood
        self.items.append(("coolant", (mist, flood)))

    def _mist_on(self, text: str) -> None:
        self._coolant(1, self.flood)

    def _mist_off(self, text: str) -> None:
        self._coolant(0, self.flood)

    def _flood_on(self, text: str) -> None:
        self._coolant(self.mist, 1)

    def _flood_off(self, text: str) -> None:
        self._coolant(self.mist, 0)

    def _select_tool(self, text: str) -> None:
        self.items.append(("select", (float(text),)))

    def _change_tool(self, text: str) -> None:
        self.items.append(("change", ()))

    def _set_motion_output_bit(self, text: str) -> None:
        self.items.append(("digital", (float(text), 1, 1)))

    def _clear_motion_output_bit(self, text: str) -> None:
        self.items.append(("digital", (float(text), 0, 1)))

    def _set_aux_output_bit(self, text: str) -> None:
        self.items.append(("digital", (float(text), 1, 0)))

    def _clear_aux_output_bit(self, text: str) -> None:
        self.items.append(("digital", (float(text), 0, 0)))

    def _set_motion_output_value(self, text: str) -> None:
        self.items.append(("analog", (*self._numbers(text)[:2], 1)))

    def _set_aux_output_value(self, text: str) -> None:
        self.items.append(("analog", (*self._numbers(text)[:2], 0)))

    def _set_motion_control_mode(self, text: str) -> None:
        name = {"CANON_EXACT_STOP": 0, "CANON_EXACT_PATH": 1}.get(text, 2)
        tolerance = self._numbers(text)[0] * self.unit if name == 2 else 0.0
        self.items.append(("mode", (name, tolerance, 0.0)))

    def _set_naivecam_tolerance(self, text: str) -> None:
        if self.items and self.items[-1][0] == "mode" and self.items[-1][1][0] == 2:
            name, tolerance, _ = self.items.pop()[1]
            self.items.append(("mode", (name, tolerance, float(text) * self.unit)))

    def _message(self, text: str) -> None:
        self.items.append(("message", ()))

    def _program_stop(self, text: str) -> None:
        self.items.append(("stop", (0,)))

    def _optional_program_stop(self, text: str) -> None:
        self.items.append(("stop", (1,)))

    def _program_end(self, text: str) -> None:
        self.items.append(("end", ()))

    _finish = _program_end


def _without_idle_states(items: list[Item]) -> list[Item]:
    """Items without states of spindle and coolant that change nothing, or that nothing follows but the next state."""
    state: dict[str, tuple[float, ...]] = {"spindle": (0, 0.0), "coolant": (0, 0)}
    kept: list[Item] = []
    waiting: dict[str, tuple[float, ...]] = {}
    for item in items:
        if item[0] in state:
            waiting[item[0]] = item[1]
            continue
        if item[0] != "end":
            changed = [(name, new) for name, new in sorted(waiting.items()) if new != state[name]]
            kept += changed
            state |= dict(changed)
            waiting.clear()
        kept.append(item)
    return kept


def canonical(commands: Iterable[moves.Command]) -> list[Item]:
    """Commands of `read_gcode` as items, without overrides."""
    items: list[Item] = []
    position = moves.ORIGIN
    for command in commands:
        _add(items, position, command)
        if isinstance(command, moves.StraightMove | moves.ArcMove | moves.SplineMove):
            position = command.end
    return items


def _add(items: list[Item], start: moves.Position, command: moves.Command) -> None:
    match command:
        case moves.StraightMove(_, end, None):
            items.append(("rapid", end))
        case moves.StraightMove(_, end, moves.Feed() as feed):
            items.append(("straight", (*end, _speed(feed, start, end))))
        case moves.ArcMove(_, end, plane, centre, turns, feed):
            speed = math.nan if feed.duration_s else feed.feed_mm_s
            items.append((f"arc{plane.value[0]}", (*end, *centre, turns, speed)))
        case moves.SplineMove():
            items.append(("nurbs", (len(command.points),)))
        case moves.Dwell(_, duration_s):
            items.append(("dwell", (duration_s,)))
        case moves.Spindle(_, rotation, speed):
            items.append(("spindle", (rotation.value, speed)))
        case moves.Coolant(_, mist, flood):
            items.append(("coolant", (mist, flood)))
        case moves.ToolSelect(_, tool):
            items.append(("select", (tool,)))
        case moves.ToolChange():
            items.append(("change", ()))
        case moves.DigitalOutput(_, output, on, synchronised):
            items.append(("digital", (output, on, synchronised)))
        case moves.AnalogOutput(_, output, value, synchronised):
            items.append(("analog", (output, value, synchronised)))
        case moves.PathMode(_, blending, tolerance, fit):
            kind = list(moves.Blending).index(blending)
            items.append(
                ("mode", (kind, tolerance or 0.0, (tolerance if fit is None else fit) or 0.0))
            )
        case moves.Message():
            items.append(("message", ()))
        case moves.ProgramStop(_, optional):
            items.append(("stop", (optional,)))
        case moves.ProgramEnd():
            items.append(("end", ()))


def _speed(feed: moves.Feed, start: moves.Position, end: moves.Position) -> float:
    """The speed; of a move with a duration if it turns no axis, else unknown (NaN)."""
    if not feed.duration_s:
        return feed.feed_mm_s
    length = math.dist(start[:3], end[:3])
    slowest = 0.1 / 60.0
    return (
        math.nan
        if start[3:] != end[3:] or length / feed.duration_s < slowest
        else (length / feed.duration_s)
    )


def difference(
    ours: list[Item], theirs: list[Item], tolerance: float, *, is_part: bool = False
) -> str:
    """The first difference in words, empty if there is none. Straight moves of no length may be missing.

    is_part    whether theirs may be longer than ours
    """
    ours, theirs = _without_idle_states(ours), _without_idle_states(theirs)
    at = {"ours": 0, "theirs": 0}
    last: dict[str, tuple[float, ...] | None] = {"ours": moves.ORIGIN, "theirs": moves.ORIGIN}
    lists = {"ours": ours, "theirs": theirs}
    while at["ours"] < len(ours) or (at["theirs"] < len(theirs) and not is_part):
        pair = [lists[side][at[side]] if at[side] < len(lists[side]) else None for side in at]
        if pair[0] is not None and pair[1] is not None and _same(pair[0], pair[1], tolerance):
            steps: tuple[str, ...] = ("ours", "theirs")
        else:
            steps = tuple(
                side
                for side, item in zip(at, pair, strict=True)
                if item is not None and _is_standing(item, last[side], tolerance)
            )[:1]
        if not steps:
            return f"at {at['ours']} of {len(ours)}, {at['theirs']} of {len(theirs)}: {pair[0]} but {pair[1]}"
        for side in steps:
            name, numbers = lists[side][at[side]]
            if name in ("rapid", "straight") or name.startswith("arc"):
                last[side] = numbers[:6]
            elif name == "nurbs":
                # rs274 does not print where a spline ends: what comes next may stand there.
                last[side] = None if side == "theirs" else (math.inf,) * 6
            at[side] += 1
    return ""


def _same(ours: Item, theirs: Item, tolerance: float) -> bool:
    if ours[0] != theirs[0] or len(ours[1]) != len(theirs[1]):
        return False
    return all(
        math.isnan(p) or abs(p - q) <= tolerance + 1e-7 * abs(q)
        for p, q in zip(ours[1], theirs[1], strict=True)
    )


def _is_standing(item: Item, last: tuple[float, ...] | None, tolerance: float) -> bool:
    name, numbers = item
    return name in ("rapid", "straight") and (
        last is None or all(abs(p - q) <= tolerance for p, q in zip(numbers[:6], last, strict=True))
    )
