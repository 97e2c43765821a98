# SPDX-License-Identifier: MIT
"""Reads points, one in a line, as a toolpath. docs/reference/points.md describes the file. Used by toolpath/files.
Takes the lines from an iterator that may read the file; no other I/O.

    with open("part.csv", encoding="utf-8", errors="surrogateescape") as lines:
        for command in read_points(lines, "part.csv", PointOptions(feed_mm_s=20.0)):
            ...

The lines are read as a stream: a file of any length takes the same memory.
"""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice, repeat

import numpy as np

from ..errors import InputError, ToolpathError, brief
from .moves import (
    ORIGIN,
    Blending,
    Command,
    Feed,
    FeedMode,
    Message,
    PathMode,
    Position,
    ProgramEnd,
    StraightMove,
)

COLUMNS = ("x", "y", "z", "a", "b", "c", "feed")
"""Names of columns; "-": the column is not read."""

MOST_MM = 1e9
"""Greatest coordinate, in mm or degrees."""

MOST_MM_S = 1e6
"""Greatest feed."""

_Row = tuple[int, Position, float | None]
"""Line number, position, and feed in mm/s (None: the line has none)."""

_BATCH = 4096
"""Lines that are read at once."""
_MOST_LINE = 4096
"""Characters of the longest line."""
_BLANKS = " \t\r\n\N{ZERO WIDTH NO-BREAK SPACE}"
_UTF_16 = ("\udcff\udcfe", "\udcfe\udcff")
"""Byte order marks, as surrogateescape has them."""

_SEPARATOR = re.compile(r"sep=(\S)", re.IGNORECASE)
"""A first line that spreadsheets write."""

_QUOTED = re.compile(r'\s*"([^"]*)"\s*')

_NUMERIC = re.compile(r"\s*[-+]?(?:[0-9.]|nan\b|inf)", re.IGNORECASE)
_COMMENTS = ("#", ";", "%", "//")
_AXES = {name: axis for axis, name in enumerate(COLUMNS[:6])}
_HEADER = re.compile(r"\s*([A-Za-z]+)\s*(?:[_ ]|\[|\()?\s*([A-Za-z/_]*)\s*[\])]?\s*")
_UNITS = {
    **dict.fromkeys(("", "mm", "deg", "mm/min", "mm_min"), 1.0),
    **dict.fromkeys(("in", "inch", "in/min", "in_min"), 25.4),
    "m": 1000.0,
    "cm": 10.0,
    "um": 1e-3,
    **dict.fromkeys(("mm/s", "mm_s"), 60.0),
    **dict.fromkeys(("m/min", "m_min"), 1000.0),
}
_LENGTHS = frozenset(("", "mm", "in", "inch", "m", "cm", "um"))
_FEEDS = frozenset(("", "mm/min", "mm_min", "in/min", "in_min", "mm/s", "mm_s", "m/min", "m_min"))


@dataclass(frozen=True)
class PointOptions:
    """How points become a toolpath.

    feed_mm_s   feed up to the first line that has one; None: the column "feed" has it in every line
    columns     names of the columns, of COLUMNS or "-"; empty: those of the header; without a header x y or x y z
    separator   the separator of columns, or "auto": tab, semicolon or comma, as in the first line, else blanks
    unit_mm     length of a unit of columns without a unit in the header
    scale       factor on x, y and z
    closed      whether the path returns to the first point
    noise_mm    greatest distance of points from the curve that they sample; 0: the tolerance alone counts
    start       position at which the toolpath starts; a coordinate without a column is 0 in all points
    Raises InputError: a number or name out of its range.
    """

    feed_mm_s: float | None = None
    columns: Sequence[str] = ()
    separator: str = "auto"
    unit_mm: float = 1.0
    scale: float = 1.0
    closed: bool = False
    noise_mm: float = 0.0
    start: Position = ORIGIN

    def __post_init__(self) -> None:
        """Check the ranges."""
        if self.feed_mm_s is not None and not 0.0 < self.feed_mm_s < MOST_MM_S:
            raise InputError(f"feed: {self.feed_mm_s:g} mm/s is not a positive feed")
        if not 1e-9 < self.scale < 1e9:
            raise InputError(f"scale of the points: {self.scale:g} must be above 1e-9, below 1e9")
        if not 1e-9 < self.unit_mm < 1e9:
            raise InputError(
                f"unit of the points: {self.unit_mm:g} mm must be above 1e-9 mm, below 1e9 mm"
            )
        if not 0.0 <= self.noise_mm < 1e6:
            raise InputError(f"noise: {self.noise_mm:g} mm is not a number of mm, at least 0")
        if self.separator not in ("auto", "blank", "\t") and len(self.separator.strip()) != 1:
            raise InputError(
                f'separator "{self.separator}" is not one character, "blank" or "auto"'
            )
        if self.columns:
            try:
                _check_columns(self.columns)
            except ValueError as error:
                raise InputError(f"columns: {error}") from None


def read_points(lines: Iterable[str], file: str, options: PointOptions) -> Iterator[Command]:
    """The commands of a file of points: rapid to the first point, straight moves from point to point, and the end.

    lines    lines of text, with or without their ends
    file     name for messages

    Points that repeat the one before them are left out with a message. Raises ToolpathError where the iterator reaches
    a line that is no point, a missing feed, or the end of a file with fewer than two different points. The commands
    before it have been yielded.
    """
    return _Reader(file, options).run(lines)


def _check_columns(names: Sequence[str]) -> None:
    known = [name for name in names if name != "-"]
    for name in known:
        if name not in COLUMNS:
            raise ValueError(
                f'"{brief(name)}" is not one of {", ".join(COLUMNS)}: give the columns, "-" for one not to read'
            )
        if known.count(name) > 1:
            raise ValueError(f'"{name}" twice')
    if not any(name in _AXES for name in known):
        raise ValueError("none of them is a coordinate")


@dataclass(frozen=True, slots=True)
class _Layout:
    """How a line is read: the separator (None: blanks), whether commas are decimal, and for each column its factor."""

    separator: str | None
    has_decimal_commas: bool
    count: int
    axes: tuple[tuple[int, int, float], ...]  # column, axis, factor to mm or degrees
    feed: tuple[int, float] | None  # column, factor to mm/s


class _Reader:
    """The reading of one file."""

    def __init__(self, file: str, options: PointOptions) -> None:
        self._file = file
        self._options = options
        self._repeated = 0
        self._first_repeated = 0

    def run(self, lines: Iterable[str]) -> Iterator[Command]:
        """All commands."""
        here = self._options.start
        first: Position | None = None
        speed = self._options.feed_mm_s
        feed: Feed | None = None
        number = moves = 0
        if self._options.noise_mm:
            yield PathMode(0, Blending.CONTINUOUS, None, self._options.noise_mm)
        for number, position, given in self._rows(lines):
            if feed is None or (given is not None and given != speed):
                speed = given if given is not None else speed
                feed = Feed(FeedMode.PER_MINUTE, feed_mm_s=speed or 0.0, feed_deg_s=speed or 0.0)
            if first is None:
                first = position
                if position != here:
                    yield StraightMove(number, position, None)
            elif position == here:
                self._repeat(number)
                continue
            else:
                if not speed:
                    raise self._error(number, 'no feed: give one (--feed MM/S), or a column "feed"')
                moves += 1
                yield StraightMove(number, position, feed)
            here = position
        if first is None or not moves:
            raise self._error(max(1, number), "fewer than two different points: that is no path")
        if self._options.closed and here != first and feed is not None:
            yield StraightMove(number, first, feed)
        if self._repeated:
            text = f"left out: {self._repeated} points that repeat the one before, first in line {self._first_repeated}"
            yield Message(self._first_repeated, text)
        yield ProgramEnd(number)

    def _repeat(self, number: int) -> None:
        self._repeated += 1
        self._first_repeated = self._first_repeated or number

    def _error(self, line: int, text: str, column: int = 1) -> ToolpathError:
        return ToolpathError(self._file, line, column, text)

    def _rows(self, lines: Iterable[str]) -> Iterator[_Row]:
        """All points."""
        source = enumerate(lines, 1)
        layout: _Layout | None = None
        while layout is None:
            entry = next(source, None)
            if entry is None:
                return
            number, text = entry[0], self._text(*entry)
            if number == 1 and text.startswith(_UTF_16):
                raise self._error(1, "text in UTF-16: save it as UTF-8")
            if number == 1 and (named := _SEPARATOR.fullmatch(text)):
                if self._options.separator == "auto":
                    self._options = replace(self._options, separator=named[1])
            elif text:
                layout, is_header = self._layout(number, text)
                if not is_header:
                    yield self._row(*entry, layout)
        while batch := list(islice(source, _BATCH)):
            rows = self._plain_rows(batch, layout)
            if rows is not None:
                yield from rows
                continue
            for number, line in batch:
                if self._text(number, line):
                    yield self._row(number, line, layout)

    def _text(self, number: int, line: str) -> str:
        """A line without its comment; empty if nothing else is in it. A semicolon begins one only in first place."""
        if len(line) > _MOST_LINE:
            raise self._error(number, f"line longer than {_MOST_LINE} characters: split it")
        text = line.strip(_BLANKS if number == 1 else None)
        return "" if text.startswith(_COMMENTS) else text.partition("#")[0].strip()

    def _plain_rows(self, batch: list[tuple[int, str]], layout: _Layout) -> Iterable[_Row] | None:
        """The points of lines in which there is nothing but numbers in range; None if there is anything else."""
        numbers, lines = zip(*batch, strict=True)
        if max(map(len, lines)) > _MOST_LINE:
            return None
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")  # lines without content
                table = np.loadtxt(lines, delimiter=layout.separator, comments=None, ndmin=2)
        except (ValueError, UserWarning):
            return None
        if table.shape != (len(lines), layout.count):
            return None
        columns: list[Iterable[float]] = [repeat(0.0) for _ in ORIGIN]
        for column, axis, factor in layout.axes:
            values = table[:, column] * factor
            if not (np.abs(values) < MOST_MM).all():
                return None
            columns[axis] = values.tolist()
        speeds: Iterable[float | None] = repeat(None)
        if layout.feed is not None:
            values = table[:, layout.feed[0]] * layout.feed[1]
            if not ((values > 0.0) & (values < MOST_MM_S)).all():
                return None
            speeds = values.tolist()
        return zip(numbers, zip(*columns, strict=False), speeds, strict=False)

    def _row(self, number: int, line: str, layout: _Layout) -> _Row:
        """The point of a line."""
        fields = _fields(self._text(number, line), layout.separator)
        if len(fields) != layout.count:
            raise self._error(
                number, f"{len(fields)} columns, where the first line has {layout.count}"
            )
        places = _places(line, fields)
        position = list(ORIGIN)
        for column, axis, factor in layout.axes:
            value = self._value(number, fields[column], places[column], layout) * factor
            if not abs(value) < MOST_MM:
                raise self._error(
                    number, f'"{brief(fields[column])}" is out of range', places[column]
                )
            position[axis] = value
        speed = None
        if layout.feed is not None:
            column, factor = layout.feed
            speed = self._value(number, fields[column], places[column], layout) * factor
            if not 0.0 < speed < MOST_MM_S:
                raise self._error(
                    number, f'"{brief(fields[column])}" is not a positive feed', places[column]
                )
        x, y, z, a, b, c = position
        return number, (x, y, z, a, b, c), speed

    def _value(self, number: int, text: str, place: int, layout: _Layout) -> float:
        if not _is_number(text, layout.has_decimal_commas):
            raise self._error(number, f'"{brief(text)}" is not a number', place)
        return _number(text, layout.has_decimal_commas)

    # ---- columns

    def _layout(self, number: int, text: str) -> tuple[_Layout, bool]:
        """How lines are read, by the first one, and whether it is a header."""
        separator = self._separator(text)
        has_commas = separator != ","
        fields = _fields(text, separator)
        is_header = not any(_NUMERIC.match(each) for each in fields)
        names, units = list(self._options.columns), [""] * len(self._options.columns)
        try:
            if not names:
                names, units = _header(fields) if is_header else _default_columns(len(fields))
            _check_columns(names)
        except ValueError as error:
            raise self._error(number, f"columns: {error}") from None
        if len(fields) < len(names):
            raise self._error(number, f"{len(fields)} columns, not {len(names)}")
        size = self._options.scale
        axes, feed = [], None
        for column, (name, unit) in enumerate(zip(names, units, strict=True)):
            if name == "feed":
                feed = (column, _UNITS[unit] / 60.0)
            elif name in "abc":
                axes.append((column, _AXES[name], 1.0))
            elif name != "-":
                axes.append(
                    (column, _AXES[name], size * (_UNITS[unit] if unit else self._options.unit_mm))
                )
        return _Layout(separator, has_commas, len(fields), tuple(axes), feed), is_header

    def _separator(self, text: str) -> str | None:
        given = self._options.separator
        if given == "blank":
            return None
        if given != "auto":
            return given
        return next((each for each in ("\t", ";", ",") if each in text), None)


def _fields(text: str, separator: str | None) -> list[str]:
    """The fields of a line, without quotes around them."""
    fields = text.split(separator)
    return [_QUOTED.sub(r"\1", each) for each in fields] if '"' in text else fields


def _places(line: str, fields: Sequence[str]) -> list[int]:
    """The columns (1-based) in which fields of a line begin."""
    places, at = [], 0
    for field in fields:
        at = max(at, line.find(field.strip(), at))
        places.append(at + 1)
        at += len(field.strip()) + 1  # after the separator, at least
    return places


def _number(text: str, has_decimal_commas: bool) -> float:
    return float(text.replace(",", ".") if has_decimal_commas else text)


def _is_number(text: str, has_decimal_commas: bool) -> bool:
    try:
        value = _number(text, has_decimal_commas)
    except ValueError:
        return False
    return math.isfinite(value) and "_" not in text and text.isascii()


def _default_columns(count: int) -> tuple[list[str], list[str]]:
    if count not in (2, 3):
        raise ValueError(f"{count} of them without a header: give their names")
    return list("xyz"[:count]), [""] * count


def _header(fields: Sequence[str]) -> tuple[list[str], list[str]]:
    """Names and units of a header: x, X_mm, "y [in]", feed (mm/min)."""
    names, units = [], []
    for field in fields:
        found = _HEADER.fullmatch(field.strip())
        name, unit = (found[1].lower(), found[2].lower()) if found else (field.strip(), "")
        name = "feed" if name == "f" else name
        fitting = (
            _FEEDS
            if name == "feed"
            else frozenset(("", "deg"))
            if name in ("a", "b", "c")
            else _LENGTHS
        )
        if name in COLUMNS and unit not in fitting:
            raise ValueError(
                f'unit "{brief(unit)}" of "{name}" is not one of: {", ".join(sorted(filter(None, fitting)))}'
            )
        names.append(name)
        units.append(unit)
    return names, units
