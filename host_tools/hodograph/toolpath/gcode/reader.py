# SPDX-License-Identifier: MIT
"""Reads a program of G-code, line by line, as commands. Used by toolpath/files. Reads lines from an open file, one at a
time.

    with open("part.ngc", encoding="utf-8", errors="surrogateescape") as lines:
        for command in read_gcode(lines, "part.ngc"):
            ...

Lines are not kept: a program of any length takes the same memory. From the first line with an O-word on, the text is
kept until its end, since O-words jump in it. Commands are not kept.

Most lines of long programs are straight moves with X, Y, Z and F in this order. A shorter method reads them (`_PLAIN`),
with the same result as the interpreter, which gets all other lines.
"""

from __future__ import annotations

import re
from collections.abc import Generator, Iterable, Iterator
from itertools import chain, islice

from ..moves import Command, FeedMode, ProgramEnd, StraightMove
from .flow import MAY_BE_O_LINE, Flow, Structure, parse_o_line
from .interpreter import Interpreter
from .options import Options
from .source import COMMENT, SourceLine

# All repetitions are bounded, so that each match keeps the general limits of a line and of its numbers.
_BLANK = r"[ \t]{0,20}"
_SIZE = r"(?:[0-9]{1,9}(?:\.[0-9]{0,20})?|\.[0-9]{1,20})"
_PLAIN = re.compile(
    rf"{_BLANK}(?:[nN][0-9]{{1,9}}{_BLANK})?(?:[gG]0?([01])(?![0-9.]){_BLANK})?"
    rf"(?:[xX]([-+]?{_SIZE}){_BLANK})?(?:[yY]([-+]?{_SIZE}){_BLANK})?"
    rf"(?:[zZ]([-+]?{_SIZE}){_BLANK})?(?:[fF]({_SIZE}){_BLANK})?[\r\n]{{0,2}}"
)
_PERCENT = re.compile(r"[ \t]*%[ \t\r\n]*")
_BYTE_ORDER_MARK = "\N{ZERO WIDTH NO-BREAK SPACE}"

Entry = tuple[int, str]
"""A line with its number."""


def read_gcode(
    lines: Iterable[str], file: str = "<program>", options: Options | None = None
) -> Iterator[Command]:
    """The commands of a program; the last one is ProgramEnd.

    lines    lines of text, with or without their ends
    file     name for messages
    options  tables of the machine; None: all of them are 0

    The program ends with M2 or M30, with the second of two "%" lines, or with its last line; but if it begins with "%",
    one of the first two has to be there. Later lines are not read. Raises ToolpathError where the iterator reaches a
    line without meaning, or with an unsupported one. The commands before it have been yielded.
    """
    return _Reader(file, options or Options()).run(lines)


class _Reader:
    """The reading of one program."""

    def __init__(self, file: str, options: Options) -> None:
        self._file = file
        self._options = options
        self._interpreter = Interpreter(options)
        self._begun = False
        self._has_percent = False
        self._last_line = 0

    def run(self, lines: Iterable[str]) -> Iterator[Command]:
        """All commands."""
        source = _numbered(lines)
        while True:
            entry = yield from self._plain_moves(source)
            if entry is None:
                yield self._end_of_lines()
                return
            number, raw = entry
            if _PERCENT.fullmatch(raw):
                if self._percent(number):
                    yield ProgramEnd(number)
                    return
                continue
            if self._begins_flow(number, raw):
                self._begun = True
                yield from self._flow(number, self._rest(raw, source))
                return
            yield from self._commands(number, raw)
            if self._interpreter.ended:
                return

    def _plain_moves(self, source: Iterator[Entry]) -> Generator[Command, None, Entry | None]:
        """Yield straight moves while lines are plain; return the first line that is not, None if there is none."""
        modes = self._interpreter.modes
        where = self._interpreter.coordinates
        if not self._allows_plain():
            return self._next(source)
        match, unit, (shift_x, shift_y, shift_z) = _PLAIN.fullmatch, modes.unit_mm, where.shift[:3]
        x, y, z, a, b, c = modes.position
        is_rapid, feed = modes.motion == 0, modes.feed
        entry, number = None, self._last_line
        for number, raw in source:
            found = match(raw)
            if found is None:
                entry = (number, raw)
                break
            g, x_word, y_word, z_word, feed_word = found.groups()
            if feed_word is not None:
                modes.feed_word, modes.feed_unit_mm = float(feed_word), unit
                modes.update_feed()
                feed = modes.feed
            if g is not None:
                is_rapid = g == "0"
            if (x_word is y_word is z_word is None) or (feed is None and not is_rapid):
                entry = (number, raw)
                break
            if x_word is not None:
                x = float(x_word) * unit + shift_x
            if y_word is not None:
                y = float(y_word) * unit + shift_y
            if z_word is not None:
                z = float(z_word) * unit + shift_z
            yield StraightMove(number, (x, y, z, a, b, c), None if is_rapid else feed)
        self._last_line = number
        modes.position = (x, y, z, a, b, c)
        modes.motion = 0 if is_rapid else 10
        return entry

    def _allows_plain(self) -> bool:
        """Whether the state is such that a plain line is a straight move and nothing else."""
        modes = self._interpreter.modes
        return (
            self._options.fast_path
            and modes.motion in (0, 10)
            and modes.absolute
            and modes.feed_mode is not FeedMode.INVERSE_TIME
            and modes.cycle.level is None
            and modes.spline is None
            and modes.spline_handle is None
            and self._interpreter.coordinates.rotation_deg == 0.0
        )

    def _next(self, source: Iterator[Entry]) -> Entry | None:
        entry = next(source, None)
        if entry is not None:
            self._last_line = entry[0]
        return entry

    def _line(self, number: int, raw: str) -> SourceLine:
        self._last_line = number
        return SourceLine(self._file, number, raw)

    def _commands(self, number: int, raw: str) -> list[Command]:
        """Execute a line whose O-word, if it has one, is only a program number."""
        line = self._line(number, raw)
        if not line.text or self._is_deleted(line):
            return []
        if MAY_BE_O_LINE.match(raw) and parse_o_line(line):
            return self._interpreter.messages(line)
        self._begun = self._begun or line.text.strip(COMMENT) != ""
        return self._interpreter.execute(line)

    def _is_deleted(self, line: SourceLine) -> bool:
        return self._options.block_delete and line.text.startswith("/")

    def _percent(self, number: int) -> bool:
        """Note a line with "%" only; whether it ends the program.

        Raises ToolpathError: it neither begins the program nor ends one that began with it.
        """
        if self._has_percent:
            return True
        if self._begun:
            line = self._line(number, "%")
            raise line.error(0, '"%" within a program that does not begin with "%": remove it')
        self._has_percent = self._begun = True
        return False

    def _begins_flow(self, number: int, raw: str) -> bool:
        """Whether the line has an O-word that is more than a program number."""
        if MAY_BE_O_LINE.match(raw) is None:
            return False
        line = self._line(number, raw)
        o_line = None if self._is_deleted(line) else parse_o_line(line)
        return o_line is not None and o_line.keyword != ""

    def _flow(self, first: int, lines: list[str]) -> Iterator[Command]:
        """Execute lines among which O-words jump; `first` is the number of the first one."""
        maybe = (
            (index, self._line(first + index, raw))
            for index, raw in enumerate(lines)
            if MAY_BE_O_LINE.match(raw)
        )
        structure = Structure(entry for entry in maybe if not self._is_deleted(entry[1]))
        flow = Flow(structure, self._interpreter, self._options.most_jumps)
        index = 0
        while index < len(lines):
            o_line = structure.at.get(index)
            if o_line is not None:
                yield from self._interpreter.messages(o_line.line)
                index = flow.next_index(index, o_line)
                continue
            entry = yield from self._plain_moves(_entries(first, lines, index))
            if entry is None:
                break
            index = entry[0] - first
            if index not in structure.at:
                yield from self._commands(entry[0], entry[1])
                if self._interpreter.ended:
                    return
                index += 1
        self._last_line = first + len(lines) - 1
        yield self._end_of_lines()

    def _rest(self, raw: str, source: Iterator[Entry]) -> list[str]:
        """The line and all that follow it, up to the closing "%" if the program began with one."""
        lines = [raw]
        for _, each in source:
            if self._has_percent and _PERCENT.fullmatch(each):
                self._has_percent = False
                break
            lines.append(each)
        return lines

    def _end_of_lines(self) -> ProgramEnd:
        """The end of a program that has no M2. Raises ToolpathError: something is not complete."""
        line = self._line(self._last_line + 1, "")
        if self._has_percent:
            raise line.error(0, 'the program begins with "%", but has no M2, M30 or "%" at its end')
        if self._interpreter.modes.spline is not None:
            raise line.error(0, "G5.3 is missing at the end of the curve")
        return ProgramEnd(max(line.number - 1, 1))


def _numbered(lines: Iterable[str]) -> Iterator[Entry]:
    """Lines with their numbers, without the byte order mark that some editors write."""
    source = iter(lines)
    first = [line.removeprefix(_BYTE_ORDER_MARK) for line in islice(source, 1)]
    return chain(enumerate(first, 1), enumerate(source, 2))


def _entries(first: int, lines: list[str], index: int) -> Iterator[Entry]:
    for each in range(index, len(lines)):
        yield first + each, lines[each]
