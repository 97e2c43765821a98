# SPDX-License-Identifier: MIT
"""The journal of a streamed job: what `hodograph stream --continue` needs to find the place where the machine rests.
Used by stream/ and cli/stream_command. Reads, replaces and locks the file that it is given, and checks size and time of
the job's files.

A JSON document that is replaced atomically: after a loss of power the old or the new one is there.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from filelock import lock_descriptor

from ..config import Machine
from ..errors import InputError
from ..whole_files import replace_file

VERSION = 4

_BESIDE_Q40 = 1 << 20
"""2^-20 mm: a rest this close to the start of a section counts as a rest at the start, where its commands at rest
follow.
"""


@dataclass(frozen=True)
class FileMark:
    """A file of the job. A change shows in its size or time."""

    path: str
    size: int
    modified_ns: int


@dataclass(frozen=True)
class Entry:
    """The job and its progress.

    files, machine, options  as on the command line
    section, arc_q40         the section in motion, and the arc length in it last reported
    committed_q40            arc length of the job in the controller up to which chunks were sent
    job                      number of the job in the controller
    job0                     number that it would have if it began with section 0
    first                    the section that it begins with
    starts                   sections of it from the one in motion to the last one sent, each with its start in the job
    done                     the job came to its end
    machine_sha256           `machine_mark` of the machine
    """

    files: tuple[FileMark, ...]
    machine: str
    options: dict[str, Any]
    job0: int
    section: int = 0
    arc_q40: int = 0
    committed_q40: int = 0
    done: bool = False
    first: int = 0
    starts: tuple[tuple[int, int], ...] = ()
    machine_sha256: str = ""

    @property
    def job(self) -> int:
        """Number of the job in the controller."""
        return self.job0 + self.first

    def place_at(self, arc_q40: int) -> tuple[int, int]:
        """Section, and arc length in it, at an arc length of the controller's job."""
        section, start_q40 = self.section, 0
        for number, begin_q40 in self.starts:
            if begin_q40 <= arc_q40 + _BESIDE_Q40:
                section, start_q40 = number, begin_q40
        within_q40 = arc_q40 - start_q40
        return section, within_q40 if within_q40 > _BESIDE_Q40 else 0


def mark(file: Path) -> FileMark:
    """The mark of a file as it is now. Raises InputError: it cannot be read."""
    try:
        found = file.stat()
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {error.strerror}") from None
    return FileMark(str(file.resolve()), found.st_size, found.st_mtime_ns)


def machine_mark(machine: Machine) -> str:
    """SHA-256 of what decides where a job's path is and how its curves run: work offset, start, outputs, the limits of
    the motion, and of each path axis counts, homing, drive scaling and limits.
    """
    axes = tuple(
        (
            axis.name,
            axis.unit,
            axis.counts_per_unit,
            axis.velocity_mm_s,
            axis.acceleration_mm_s2,
            axis.jerk_mm_s3,
            axis.homing,
            axis.scaling,
        )
        for axis in machine.path_axes
    )
    motion = (machine.feed_mm_s, machine.acceleration_mm_s2, machine.jerk_mm_s3)
    text = repr((machine.offset_mm, machine.start_mm, machine.outputs, motion, axes))
    return hashlib.sha256(text.encode()).hexdigest()


def require_same_machine(entry: Entry, machine: Machine) -> None:
    """Raises InputError: the rest of the job would be cut at another place, or on another curve."""
    if machine_mark(machine) != entry.machine_sha256:
        raise InputError(
            f"{entry.machine}: its work offset, start, axes, limits or outputs have been changed since the job was "
            "streamed: change them back, or stream the job from its start"
        )


JOURNAL_ELSEWHERE = "name another with hodograph stream --journal FILE, or set XDG_STATE_HOME"
"""The remedy in messages where the usual journal cannot be written."""


@contextmanager
def journal_lock(file: Path) -> Iterator[None]:
    """Locks a journal for this process. Raises InputError: another process has it, or its folder cannot be written."""
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(file.with_name(file.name + ".lock"), os.O_RDWR | os.O_CREAT, 0o666)
    except OSError as error:
        raise InputError(f"{_cannot_be_written(file, error)}: {JOURNAL_ELSEWHERE}") from None
    try:
        if not lock_descriptor(descriptor, blocking=False):
            raise InputError(
                f"{file}: another hodograph stream writes this journal: wait for its end, or give this job "
                "a journal of its own (hodograph stream --journal FILE)"
            )
        yield
    finally:
        os.close(descriptor)


def _cannot_be_written(file: Path, error: OSError) -> InputError:
    return InputError(f"{file}: the journal cannot be written: {error.strerror}")


class Journal:
    """Writes the journal of one job."""

    def __init__(self, file: Path, entry: Entry) -> None:
        """Raises InputError: it cannot be written."""
        self.file, self.entry = file, entry
        self._write()

    def update(self, **changes: Any) -> None:
        """Changes fields of the entry, and writes it if one of them changes."""
        entry = replace(self.entry, **changes)
        if entry != self.entry:
            self.entry = entry
            self._write()

    def _write(self) -> None:
        text = json.dumps({"version": VERSION, **asdict(self.entry)}, indent=1)
        try:
            self.file.parent.mkdir(parents=True, exist_ok=True)
            replace_file(self.file, (text + "\n").encode())
        except OSError as error:
            raise _cannot_be_written(self.file, error) from None


def load(file: Path) -> Entry:
    """The entry of a journal. Raises InputError: there is none, it is damaged, or its job is done."""
    try:
        found = json.loads(file.read_text(encoding="utf-8"))
        if found.pop("version") != VERSION:
            raise InputError(
                f"{file}: is of another version of hodograph: stream the job from its start"
            )
        found["files"] = tuple(FileMark(**one) for one in found["files"])
        found["starts"] = tuple((int(number), int(start)) for number, start in found["starts"])
        entry = Entry(**found)
        _check(entry)
    except FileNotFoundError:
        raise InputError(
            f"{file}: no job was streamed with this journal: nothing to continue"
        ) from None
    except OSError as error:
        raise InputError(f"{file}: the journal cannot be read: {error.strerror}") from None
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError, OverflowError):
        raise InputError(f"{file}: is no journal of a streamed job, or it is damaged") from None
    if entry.done:
        raise InputError(f"{file}: the last job came to its end: nothing to continue")
    for one in entry.files:
        if mark(Path(one.path)) != one:
            raise InputError(
                f"{one.path}: has been changed since the job was streamed: stream it from its start"
            )
    return entry


def _check(entry: Entry) -> None:
    """Raises KeyError and TypeError: something is missing, or is not what it should be."""
    whole = (entry.job0, entry.section, entry.arc_q40, entry.committed_q40, entry.first)
    if not all(isinstance(one, int) for one in whole) or not isinstance(entry.machine, str):
        raise TypeError
    if any(not isinstance(one.path, str) or "\0" in one.path for one in entry.files):
        raise TypeError
    if not isinstance(entry.options["tolerance_mm"], int | float):
        raise TypeError
    if not isinstance(entry.options["reading"], dict):
        raise TypeError
