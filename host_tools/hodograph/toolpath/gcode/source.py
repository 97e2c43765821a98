# SPDX-License-Identifier: MIT
"""A line of G-code as it was written, and the compact text that is parsed. Used by toolpath/gcode. No I/O.

RS274/NGC does not distinguish upper and lower case, and blanks have no meaning outside comments. The compact text is
the line in lower case without blanks; a comment becomes one character (`COMMENT`). For messages,
places in the compact text are converted back to columns of the line.
"""

from __future__ import annotations

import string

from ...errors import ToolpathError

COMMENT = "("
"""The character that replaces a comment in the compact text."""

BLANKS = " \t\r\n"
MAX_LINE = 4096
"""Longest line that is read, in characters."""

_COMPACT: dict[int, str | None] = {ord(blank): None for blank in BLANKS}
_COMPACT |= {ord(upper): upper.lower() for upper in string.ascii_uppercase}


class SourceLine:
    """Line `number` (1-based) of `file`.

    `text` is the compact text and `comments` holds the comments in parentheses, in their order. Comments that begin
    with a semicolon are dropped.
    Raises ToolpathError: line too long, comment not closed or nested.
    """

    __slots__ = ("_places", "comments", "file", "number", "raw", "text")

    def __init__(self, file: str, number: int, raw: str) -> None:
        """Make the compact text of `raw`."""
        self.file = file
        self.number = number
        self.raw = raw
        self.comments: list[str] = []
        self._places: list[int] | None = None
        if len(raw) > MAX_LINE:
            raise ToolpathError(
                file, number, MAX_LINE + 1, f"line longer than {MAX_LINE} characters: split it"
            )
        if COMMENT in raw or ";" in raw or ")" in raw:
            self._separate_comments()
        else:
            self.text = raw.translate(_COMPACT)

    def _separate_comments(self) -> None:
        characters, places = [], []
        at, raw = 0, self.raw
        while at < len(raw) and raw[at] != ";":
            if raw[at] == COMMENT:
                characters.append(COMMENT)
                places.append(at)
                at = self._end_of_comment(at)
            elif raw[at] not in BLANKS:
                characters.append(raw[at])
                places.append(at)
            at += 1
        self.text = "".join(characters).translate(_COMPACT)
        self._places = places

    def _end_of_comment(self, start: int) -> int:
        end = self.raw.find(")", start)
        nested = self.raw.find(COMMENT, start + 1)
        if end < 0:
            raise self._error_at(start, 'the comment is not closed: add ")"')
        if 0 <= nested < end:
            raise self._error_at(nested, 'a comment cannot contain "(": remove it')
        self.comments.append(self.raw[start + 1 : end])
        return end

    def error(self, at: int, text: str) -> ToolpathError:
        """An error at character `at` of the compact text; its end stands for the end of the line."""
        places = self._places
        if places is None:
            places = [index for index, each in enumerate(self.raw) if each not in BLANKS]
        end = len(self.raw.rstrip(BLANKS))
        return self._error_at(places[at] if at < len(places) else end, text)

    def _error_at(self, index: int, text: str) -> ToolpathError:
        return ToolpathError(self.file, self.number, index + 1, text)
