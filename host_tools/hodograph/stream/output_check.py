# SPDX-License-Identifier: MIT
"""Checks before any motion that a machine has the outputs and the rotary axes that a job uses. Used by
cli/stream_command. Reads the files of the job.

A toolpath is read part by part while the machine moves, so a missing output or axis would be found in motion. A scan of
the G-code text costs far less than reading it, but understands plain numbers only. If the scan finds an expression, an
output that the machine lacks, or a word other than 0 for an axis that it lacks, the whole file is read, which gives the
message. A scan that finds none of these is always right.
"""

from __future__ import annotations

import re
from pathlib import Path

from ..config import Machine, load_paths
from ..config.outputs import Channel
from ..errors import InputError
from ..job import missing_axes, no_such_axis, toolpath_commands
from ..job_outputs import EventMaker, is_output
from ..names import STANDARD_INPUT, is_toolpath
from ..path_outputs import require_output
from ..toolpath.files import ReadOptions, is_gcode
from ..toolpath.moves import AXES, Move

_COMMENT = re.compile(rb"\([^)]*\)|;.*|\s")
_NUMBER = rb"[+-]?(?:\d+\.?\d*|\.\d+)"
_LITERAL = re.compile(rb"/?\d*(?:[A-Z]" + _NUMBER + rb")*%?")
_WORD = re.compile(rb"([A-Z])(" + _NUMBER + rb")")
_MOST_SEEN = 1000
"""Words that are remembered, so that each is reported once."""
_DIGITAL, _ANALOGUE = (62.0, 63.0, 64.0, 65.0), (67.0, 68.0)


def require_outputs(file: Path, machine: Machine, reading: ReadOptions) -> None:
    """Raises InputError, naming the line: the machine lacks an output or a rotary axis that a file uses, or a value is
    too large. Standard input is not checked: it cannot be read twice.
    """
    if str(file) == STANDARD_INPUT:
        return
    if not is_toolpath(file):
        for listed in load_paths(file):
            for one in listed.file.outputs:
                require_output(listed.file, one, machine)
        return
    if is_gcode(file) and not _Scan(machine).is_sure(file):
        _read(file, machine, reading)


def _read(file: Path, machine: Machine, reading: ReadOptions) -> None:
    """Reads all commands. Raises InputError."""
    outputs, missing = machine.outputs, missing_axes(machine)
    maker = None if outputs is None else EventMaker(outputs, file)
    for command in toolpath_commands(file, machine, reading, []):
        if isinstance(command, Move):
            turned = [name for name in missing if command.end[AXES.index(name)] != 0.0]
            if turned:
                raise no_such_axis(file, command.line, turned[0], machine)
        elif maker is not None and is_output(command, outputs):
            maker.changed(0, [command])


class _Scan:
    """Scans the text of a file for words that the machine may lack."""

    def __init__(self, machine: Machine) -> None:
        outputs = machine.outputs
        self._missing = missing_axes(machine).upper().encode()
        self._any = outputs is not None
        own = () if outputs is None else outputs.channels
        self._digital = {float(one.number) for one in own if one.digital}
        self._analogue = {float(one.number): one for one in own if not one.digital}
        self._speed = None if outputs is None else outputs.codes.speed
        self._seen: set[bytes] = set()
        letters = (
            self._missing + (b"M" if self._any else b"") + (b"" if self._speed is None else b"S")
        )
        self._letters = re.compile(b"[" + letters + letters.lower() + b"]" if letters else rb"(?!)")

    def is_sure(self, file: Path) -> bool:
        """Whether the machine certainly has all outputs and axes of the file. Raises InputError: it cannot be read."""
        try:
            with file.open("rb") as lines:
                return all(line in self._seen or self._line(line) for line in lines)
        except OSError as error:
            raise InputError(f"{file}: cannot be read: {error.strerror}") from None

    def _line(self, line: bytes) -> bool:
        if not self._letters.search(line):
            return True
        text = _COMMENT.sub(b"", line).upper()
        if not self._letters.search(text):
            return True
        if not _LITERAL.fullmatch(text):
            return False
        words = [(name, float(value)) for name, value in _WORD.findall(text)]
        value = dict(words)
        sure = not any(number for name, number in words if name in self._missing)
        if self._any:
            sure = sure and all(self._has(number, value) for name, number in words if name == b"M")
        sure = sure and self._fits(self._speed, value.get(b"S"))
        if sure and len(self._seen) < _MOST_SEEN:
            self._seen.add(line)
        return sure

    def _has(self, code: float, value: dict[bytes, float]) -> bool:
        if code in _DIGITAL:
            return value.get(b"P") in self._digital
        if code in _ANALOGUE:
            channel = self._analogue.get(value.get(b"E", -1.0))
            return channel is not None and self._fits(channel, value.get(b"Q"))
        return True

    @staticmethod
    def _fits(channel: Channel | None, value: float | None) -> bool:
        if channel is None or value is None:
            return True
        try:
            channel.valued(0, value, "")
        except InputError:
            return False
        return True
