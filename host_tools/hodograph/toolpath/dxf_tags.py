# SPDX-License-Identifier: MIT
"""Tags of a DXF file: group code and value, a line each, one after the other; and the records that they form. Used by
toolpath/dxf and toolpath/dxf_curves. Reads the open file that it is given.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any, BinaryIO, NamedTuple

from ..errors import InputError, ToolpathError, brief
from .contours import Point, ShapeError

_MOST = 1e15
"""Greatest number in a file; its squares and products are far from the greatest of a float."""


def ezdxf_module(name: str) -> Any:
    """A module of ezdxf, which is an extra of the package."""
    try:
        return import_module(f"ezdxf.{name}")
    except ImportError:
        raise InputError(
            "DXF needs ezdxf, which is not installed: pip install 'hodograph[cad]'"
        ) from None


class Tag(NamedTuple):
    """A group code, its value, and the line that the value is in."""

    code: int
    value: bytes
    line: int


@dataclass(slots=True)
class Entity:
    """A record: its kind, the line of its name, and its tags without extended data. `parts` are its vertices."""

    kind: str
    line: int
    tags: list[Tag] = field(default_factory=list)
    parts: list[Entity] = field(default_factory=list)

    def all(self, code: int) -> list[Tag]:
        """All tags of a code."""
        return [tag for tag in self.tags if tag.code == code]

    def number(self, code: int, default: float | None = None) -> float:
        """The number of a tag. Raises ShapeError: there is none, and no default."""
        for tag in self.tags:
            if tag.code == code:
                return number_of(tag)
        if default is None:
            raise ShapeError(f"group {code} is missing")
        return default

    def integer(self, code: int, default: int) -> int:
        """The whole number of a tag."""
        return int(self.number(code, default))

    def point(self, code: int, default: Point | None = None) -> Point:
        """The point whose x has this code; z may be missing."""
        if default is not None and not self.all(code):
            return default
        return self.number(code), self.number(code + 10), self.number(code + 20, 0.0)

    def points(self, code: int) -> list[Point]:
        """All points whose x has this code, in their order; each x is followed by its y."""
        found: list[list[float]] = []
        for tag in self.tags:
            axis, rest = divmod(tag.code - code, 10)
            if rest or not 0 <= axis <= 2:
                continue
            if axis == 0:
                found.append([])
            if not found or len(found[-1]) != axis:
                raise ShapeError(
                    f"line {tag.line}: group {tag.code} without the coordinates before it"
                )
            found[-1].append(number_of(tag))
        if any(len(each) < 2 for each in found):
            raise ShapeError(f"a point of group {code} without y")
        return [(each[0], each[1], each[2] if len(each) > 2 else 0.0) for each in found]


def number_of(tag: Tag) -> float:
    """The value of a tag as a number of sensible size. Raises ShapeError, with its line."""
    try:
        value = float(tag.value)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or b"_" in tag.value:
        shown = brief(tag.value.decode("ascii", "replace"))
        raise ShapeError(f'line {tag.line}: "{shown}" of group {tag.code} is not a number')
    if abs(value) > _MOST:
        raise ShapeError(f"line {tag.line}: {value:g} of group {tag.code} is out of range")
    return value


class Tags:
    """The tags of a file one after the other; `next` is the next one. Comments (999) are skipped."""

    def __init__(self, file: BinaryIO, name: str) -> None:
        self._file = file
        self._name = name
        self._line = 0
        self.next = self._read()

    def error(self, line: int, text: str) -> ToolpathError:
        """The error of a damaged file, with its line."""
        return ToolpathError(self._name, max(1, line), 1, text)

    def take(self) -> Tag:
        """The next tag."""
        tag = self.next
        if tag.code == 0 and tag.value == b"EOF":
            raise self.error(tag.line, "EOF within a section: the file is damaged")
        self.next = self._read()
        return tag

    def _read(self) -> Tag:
        while True:
            raw = self._file.readline()
            value = self._file.readline()
            self._line += 2
            if not raw or not value:
                raise self.error(self._line - 1, "the file ends without EOF: it is not complete")
            try:
                code = int(raw)
            except ValueError:
                shown = brief(raw.decode("ascii", "replace"))
                text = f'"{shown}" is not a group code: this is no ASCII DXF, or damaged'
                raise self.error(self._line - 1, text) from None
            if code != 999:
                return Tag(code, value.strip(), self._line)

    def is_next(self, *values: bytes) -> bool:
        """Whether a record of one of these names begins."""
        return self.next.code == 0 and self.next.value in values
