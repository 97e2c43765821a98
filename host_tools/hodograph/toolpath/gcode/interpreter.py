# SPDX-License-Identifier: MIT
"""Executes blocks: from the words of a block and the modal state to commands. Used by gcode/flow and gcode/reader. No
I/O; changes its own object only.

The order of execution within a block is that of RS274/NGC (table in docs/reference/gcode.md). The reader stops at a
refused block, so its effect on the state does not matter.
"""

from __future__ import annotations

import re

from ..moves import (
    AXES,
    AnalogOutput,
    Blending,
    Command,
    Coolant,
    DigitalOutput,
    Dwell,
    Feed,
    FeedMode,
    Message,
    OverrideSwitch,
    PathMode,
    Plane,
    Position,
    ProgramEnd,
    ProgramStop,
    Rotation,
    Spindle,
    StraightMove,
    ToolChange,
    ToolOffset,
    ToolSelect,
)
from .arcs import arc
from .block import Block, motion_of, parse_block
from .codes import (
    AXIS_LETTERS,
    COOLANT,
    CYCLES,
    OUTPUT,
    OVERRIDES,
    POLAR_LETTERS,
    SPINDLE,
    STOPPING,
    TOOL_CHANGE,
    Group,
)
from .coordinates import G28_POINT, G30_POINT, SYSTEMS, Coordinates, position_of
from .cycles import cycle
from .modes import MM_PER_INCH, Modes
from .options import Options
from .parameters import SHOWS_DEBUG, Parameters
from .polar import polar_target
from .source import SourceLine
from .splines import NURBS, add_control_point, bezier, check_inside_nurbs, finish_nurbs
from .system_parameters import add_system_parameters

LEAST_INVERSE_TIME = 1e-6
MOST_OUTPUTS = 64
MOST_TOOLS = 99_999
_MESSAGE = re.compile(r"\s*(msg|debug)\s*,", re.IGNORECASE)
_PARAMETER_IN_TEXT = re.compile(r"#(?:(\d{1,4})|<([^<>]*)>)")

_PLANES = {170: Plane.XY, 180: Plane.ZX, 190: Plane.YZ}
_SYSTEM_CODES = (540, 550, 560, 570, 580, 590, 591, 592, 593)
_FEED_MODES = {930: FeedMode.INVERSE_TIME, 940: FeedMode.PER_MINUTE, 950: FeedMode.PER_REVOLUTION}
_ROTATIONS = {3: Rotation.CLOCKWISE, 4: Rotation.COUNTERCLOCKWISE, 5: Rotation.STOPPED}


class Interpreter:
    """The state of a program that is being read. `ended` is true after M2 or M30."""

    def __init__(self, options: Options) -> None:
        """State at the start of a program."""
        self.options = options
        self.parameters = Parameters()
        options.store_tables(self.parameters)
        self.coordinates = Coordinates(self.parameters, self.options.work)
        self.modes = Modes(position=options.start)
        self.ended = False
        add_system_parameters(self.parameters, self.modes, self.coordinates)

    def execute(self, line: SourceLine) -> list[Command]:
        """The commands of a line without an O-word.

        Raises ToolpathError: the line has no meaning, or none that is supported.
        """
        self.modes.line = line.number
        block = parse_block(line, self.parameters)
        commands = self.messages(line)
        for key, value in block.settings:
            self.parameters.set(key, value)
        if block.values or block.g or block.m:
            self._execute_words(block, commands)
        return commands

    def messages(self, line: SourceLine) -> list[Command]:
        """The messages in the comments of a line."""
        found: list[Command] = []
        for comment in line.comments:
            start = _MESSAGE.match(comment)
            is_debug = start is not None and start[1].lower() == "debug"
            if start and not (is_debug and self.parameters.number(SHOWS_DEBUG) == 0.0):
                text = comment[start.end() :].strip()
                if is_debug:
                    text = _PARAMETER_IN_TEXT.sub(self._parameter_text, text)
                printable = "".join(each if each.isprintable() else "?" for each in text)
                found.append(Message(line.number, printable))
        return found

    def _parameter_text(self, found: re.Match[str]) -> str:
        if found[1]:
            return f"{self.parameters.number(int(found[1])):.6g}"
        value = self.parameters.name("".join(found[2].split()).lower())
        return "######" if value is None else f"{value:.6g}"

    def _execute_words(self, block: Block, commands: list[Command]) -> None:
        if self.modes.spline is not None:
            check_inside_nurbs(block)
        motion = motion_of(block, self.modes.motion)
        self._set_feed(block)
        self._set_speed_and_tool(block, commands)
        self._execute_m(block, commands)
        self._set_modes(block, commands)
        self._execute_non_modal(block, commands)
        if motion is not None:
            self._execute_motion(block, motion, commands)
        self._stop(block, commands)

    def _set_feed(self, block: Block) -> None:
        modes = self.modes
        mode = block.g.get(Group.FEED_MODE)
        if mode is not None:
            modes.feed_mode = _FEED_MODES[mode]
            modes.feed_word = 0.0
            modes.update_feed()
        feed = block.values.get("f")
        if feed is None:
            return
        if feed < 0.0:
            raise block.error("f", "F must be 0 or more")
        if modes.feed_mode is not FeedMode.INVERSE_TIME:
            modes.feed_word = feed
            modes.feed_unit_mm = modes.unit_mm
            modes.update_feed()

    def _set_speed_and_tool(self, block: Block, commands: list[Command]) -> None:
        modes = self.modes
        speed = block.values.get("s")
        if speed is not None:
            if speed < 0.0:
                raise block.error("s", "S must be 0 or more: M4 turns the spindle the other way")
            modes.speed_rev_min = speed
            modes.update_feed()
            if SPINDLE not in block.m:
                commands.append(Spindle(block.line.number, modes.rotation, speed))
        if "t" in block.values:
            tool = block.integer("t", "T", 0, MOST_TOOLS)
            self.options.tool_offset(block, "t", tool)
            modes.selected_tool = tool
            commands.append(ToolSelect(block.line.number, tool))

    def _execute_m(self, block: Block, commands: list[Command]) -> None:
        modes, line = self.modes, block.line.number
        if OUTPUT in block.m:
            commands.append(_output(block, block.m[OUTPUT]))
        if TOOL_CHANGE in block.m:
            modes.tool = modes.selected_tool
            if modes.rotation is not Rotation.STOPPED:
                modes.rotation = Rotation.STOPPED
                commands.append(Spindle(line, modes.rotation, modes.speed_rev_min))
            commands.append(ToolChange(line, modes.tool))
        if SPINDLE in block.m:
            modes.rotation = _ROTATIONS[block.m[SPINDLE]]
            commands.append(Spindle(line, modes.rotation, modes.speed_rev_min))
        if COOLANT in block.m:
            modes.mist = block.m[COOLANT] == 7 or (modes.mist and block.m[COOLANT] == 8)
            modes.flood = block.m[COOLANT] == 8 or (modes.flood and block.m[COOLANT] == 7)
            commands.append(Coolant(line, modes.mist, modes.flood))
        if OVERRIDES in block.m:
            modes.overrides = block.m[OVERRIDES] == 48
            commands.append(OverrideSwitch(line, modes.overrides))

    def _set_modes(self, block: Block, commands: list[Command]) -> None:
        modes, g = self.modes, block.g
        if g.get(Group.NON_MODAL) == 40:
            commands.append(_dwell(block))
        if Group.PLANE in g:
            modes.plane = _PLANES[g[Group.PLANE]]
        if Group.UNITS in g:
            modes.unit_mm = MM_PER_INCH if g[Group.UNITS] == 200 else 1.0
        if Group.TOOL_LENGTH in g:
            self._set_tool_length(block, g[Group.TOOL_LENGTH], commands)
        if Group.COORDINATES in g:
            system = _SYSTEM_CODES.index(g[Group.COORDINATES]) + 1
            if system != self.coordinates.system:
                self.coordinates.select(system)
        if Group.PATH_MODE in g:
            modes.path_mode = self._path_mode(block, g[Group.PATH_MODE])
            commands.append(modes.path_mode)
        if Group.DISTANCE in g:
            modes.absolute = g[Group.DISTANCE] == 900
        if Group.ARC_DISTANCE in g:
            modes.absolute_centre = g[Group.ARC_DISTANCE] == 901
        if Group.RETRACT in g:
            modes.retract_to_r = g[Group.RETRACT] == 990

    def _set_tool_length(self, block: Block, code: int, commands: list[Command]) -> None:
        offset = list(position_of([0.0] * len(AXES)))
        if code == 430:
            tool = self.modes.tool
            if "h" in block.values:
                tool = block.integer("h", "H", 0, MOST_TOOLS)
            word = "h" if "h" in block.values else "g430"
            offset = list(self.options.tool_offset(block, word, tool))
            if self.options.tools is None and tool:
                commands.append(ToolOffset(block.line.number, tool))
        elif code == 431:
            offset = list(self.coordinates.tool)
            for axis, number in self._axis_words(block).items():
                offset[axis] = number
        self.modes.uses_tool_offset = code != 490
        self.coordinates.set_tool(position_of(offset))

    def _path_mode(self, block: Block, code: int) -> PathMode:
        line = block.line.number
        if code != 640:
            return PathMode(line, Blending.EXACT_PATH if code == 610 else Blending.EXACT_STOP)
        tolerances: dict[str, float | None] = {"p": None, "q": None}
        for letter in tolerances:
            if letter in block.values:
                if block.values[letter] < 0.0:
                    raise block.error(letter, f"{letter.upper()} of G64 must be 0 or more")
                tolerances[letter] = block.values[letter] * self.modes.unit_mm
        return PathMode(line, Blending.CONTINUOUS, tolerances["p"], tolerances["q"])

    def _axis_words(self, block: Block) -> dict[int, float]:
        """The axis words by axis, in mm and degrees."""
        modes = self.modes
        return {
            axis: block.values[letter] * modes.unit(letter)
            for axis, letter in enumerate(AXIS_LETTERS)
            if letter in block.values
        }

    def _execute_non_modal(self, block: Block, commands: list[Command]) -> None:
        code = block.g.get(Group.NON_MODAL)
        where = self.coordinates
        if code == 100:
            self._set_origin(block)
        elif code in (280, 300):
            self._go_home(block, G28_POINT if code == 280 else G30_POINT, commands)
        elif code in (281, 301):
            where.store_reference(G28_POINT if code == 281 else G30_POINT, self.modes.position)
        elif code == 920:
            self._set_g92(block)
        elif code == 53:
            commands.append(self._nurbs(block))
        switch = block.g.get(Group.OFFSET_SWITCH)
        if switch in (921, 922):
            where.clear_g92(forget=switch == 921)
        elif switch == 923:
            where.restore_g92()

    def _set_origin(self, block: Block) -> None:
        if "l" not in block.values or "p" not in block.values:
            raise block.error("g100", "G10 needs L2 or L20, and P")
        kind = block.integer("l", "L of G10", 0, 99)
        if kind not in (2, 20):
            raise block.error("l", f"G10 L{kind} is not supported: use L2 or L20")
        system = block.integer("p", "P of G10", 0, SYSTEMS) or self.coordinates.system
        want = self._axis_words(block)
        where = self.coordinates
        if kind == 20:
            if "r" in block.values:
                raise block.error("r", "G10 L20 cannot have R: use G10 L2")
            where.set_origin_here(system, self.modes.position, want)
            return
        if "r" in block.values:
            where.set_rotation(system, block.values["r"])
        where.set_origin(system, lambda axis, old: want.get(axis, old))

    def _set_g92(self, block: Block) -> None:
        want = self._axis_words(block)
        if not want:
            raise block.error("g920", "G92 needs an axis word")
        here, offset = self._program_position(), list(self.coordinates.g92)
        for axis, number in want.items():
            offset[axis] += here[axis] - number
        self.coordinates.set_g92(position_of(offset))

    def _go_home(self, block: Block, point: int, commands: list[Command]) -> None:
        """G28 and G30: by the programmed point, if there is one, to the stored point."""
        self.modes.spline_handle = None
        home, words, where = (
            self.coordinates.reference(point),
            self._axis_words(block),
            self.coordinates,
        )
        if words:
            between = self._end(block)
            self._rapid(block, between, commands)
            if where.rotation_deg != 0.0:
                target, old = where.to_program(home), where.to_program(between)
                home = where.to_path(_replaced(old, {axis: target[axis] for axis in words}))
            else:
                home = _replaced(between, {axis: home[axis] for axis in words})
        self._rapid(block, home, commands)

    def _rapid(self, block: Block, end: Position, commands: list[Command]) -> None:
        commands.append(StraightMove(block.line.number, end, None))
        self.modes.position = end

    def _program_position(self) -> Position:
        return self.coordinates.to_program(self.modes.position)

    def _end(self, block: Block) -> Position:
        """The path position that the axis words of a block give."""
        modes, where = self.modes, self.coordinates
        words = self._axis_words(block)
        if block.has_any(POLAR_LETTERS):
            return self._polar_end(block, words)
        if block.g.get(Group.NON_MODAL) == 530:
            return _replaced(
                modes.position, {axis: mm - where.work[axis] for axis, mm in words.items()}
            )
        if where.rotation_deg != 0.0:
            here = where.to_program(modes.position)
            return where.to_path(_replaced(here, words) if modes.absolute else _added(here, words))
        if not modes.absolute:
            return _added(modes.position, words)
        shifted = {axis: number + where.shift[axis] for axis, number in words.items()}
        return _replaced(modes.position, shifted)

    def _polar_end(self, block: Block, words: dict[int, float]) -> Position:
        here = self._program_position()
        target = polar_target(block, self.modes, here[:2])
        end = _replaced(here, words) if self.modes.absolute else _added(here, words)
        return self.coordinates.to_path(end if target is None else (*target, *end[2:]))

    def _feed(self, block: Block) -> Feed:
        """The feed of the motion of a block. Raises ToolpathError if it has none."""
        modes = self.modes
        if modes.feed_mode is FeedMode.INVERSE_TIME:
            rate = block.values.get("f", 0.0)
            if rate < LEAST_INVERSE_TIME:
                raise block.motion_error(
                    "each move after G93 needs F, the inverse of its time in minutes, of 1e-6 or more"
                )
            return Feed(FeedMode.INVERSE_TIME, duration_s=60.0 / rate)
        if modes.feed is not None:
            return modes.feed
        given = self.options.feed_mm_s
        if given is not None:
            modes.feed = Feed(FeedMode.PER_MINUTE, feed_mm_s=given, feed_deg_s=given)
            return modes.feed
        if modes.feed_word == 0.0:
            raise block.motion_error(
                "the move has no feed: write F before it or in its block, or give --feed"
            )
        raise block.motion_error("feed per revolution needs the speed of the spindle: write S")

    def _execute_motion(self, block: Block, motion: int, commands: list[Command]) -> None:
        modes, where = self.modes, self.coordinates
        absolute = block.g.get(Group.NON_MODAL) == 530
        if absolute and (motion not in (0, 10) or not modes.absolute):
            raise block.error("g530", "G53 needs G0 or G1, and G90")
        if motion not in CYCLES:
            modes.cycle.level = None
        if motion != 50:
            modes.spline_handle = None
        if motion in (0, 10):
            self._move_straight(block, motion, commands)
        elif motion in (20, 30, 50, 51):
            end = self._end(block)
            make = arc if motion in (20, 30) else bezier
            move = make(block, modes, where, motion, end, self._feed(block))
            commands.append(move)
            modes.position = move.end
        elif motion in CYCLES:
            more, modes.position = cycle(block, modes, where, motion, self._feed(block))
            commands.extend(more)
        elif motion == NURBS:
            add_control_point(block, modes, self._end(block))
            self._feed(block)
        # LinuxCNC leaves the motion before a Bézier curve active, against its manual. Here no motion is active then, so
        # that no program has a different meaning here.
        modes.motion = None if motion in (50, 51) else motion

    def _move_straight(self, block: Block, motion: int, commands: list[Command]) -> None:
        """G0 and G1; without axis words they only become the active motion."""
        if block.has_any(AXIS_LETTERS + POLAR_LETTERS):
            end = self._end(block)
            feed = self._feed(block) if motion == 10 else None
            commands.append(StraightMove(block.line.number, end, feed))
            self.modes.position = end

    def _nurbs(self, block: Block) -> Command:
        if Group.MOTION in block.g:
            raise block.error("g53", "G5.3 must be in a block without motion")
        move = finish_nurbs(block, self.modes, self._feed(block))
        self.modes.position = move.end
        self.modes.motion = None
        return move

    def _stop(self, block: Block, commands: list[Command]) -> None:
        code = block.m.get(STOPPING)
        if code is None:
            return
        if code in (0, 1):
            if code == 0 or self.options.optional_stops:
                commands.append(ProgramStop(block.line.number, code == 1))
            return
        commands.append(ProgramEnd(block.line.number))
        self.ended = True


def _replaced(position: Position, numbers: dict[int, float]) -> Position:
    return position_of(numbers.get(axis, old) for axis, old in enumerate(position))


def _added(position: Position, numbers: dict[int, float]) -> Position:
    return position_of(old + numbers.get(axis, 0.0) for axis, old in enumerate(position))


def _dwell(block: Block) -> Dwell:
    duration = block.values.get("p")
    if duration is None:
        raise block.error("g40", "G4 needs P, the time in s")
    if duration < 0.0:
        raise block.error("p", "P of G4 must be 0 or more")
    return Dwell(block.line.number, duration)


def _output(block: Block, code: int) -> Command:
    line = block.line.number
    if code in (67, 68):
        output = _needed_output(block, code, "e")
        if "q" not in block.values:  # LinuxCNC sets -1
            raise block.error(f"m{code}", f"M{code} needs Q, the value of the output")
        return AnalogOutput(line, output, block.values["q"], code == 67)
    output = _needed_output(block, code, "p")
    return DigitalOutput(line, output, code in (62, 64), code in (62, 63))


def _needed_output(block: Block, code: int, letter: str) -> int:
    if letter not in block.values:
        raise block.error(f"m{code}", f"M{code} needs {letter.upper()}, the number of the output")
    return block.integer(letter, f"{letter.upper()} of M{code}", 0, MOST_OUTPUTS - 1)
