# SPDX-License-Identifier: MIT
"""Output of commands: results on stdout, notes and progress on stderr. Used by all commands. Writes files, too."""

from __future__ import annotations

import errno
import json
import math
import os
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from ..errors import InputError
from ..whole_files import replace_file
from .waiting import held, is_terminal, remove_line

LINE_AFTER_S, LINE_EVERY_S = 5.0, 10.0
"""Intervals of progress lines without a terminal."""


@dataclass
class Wanted:
    """What stderr shows in addition to errors: --quiet and --no-progress."""

    notes: bool = True
    progress: bool = True


WANTED = Wanted()
"""Settings of the command that runs in this process."""


def note(text: str) -> None:
    """One line for the user, on stderr."""
    if WANTED.notes:
        complain(text)


def complain(text: str) -> None:
    """One line for the user on stderr, also with --quiet: why a command fails."""
    remove_line()
    print(f"hodograph: {text}", file=sys.stderr)


def json_text(value: object) -> str:
    """A JSON document in one line. Raises ValueError for NaN and infinities."""
    return json.dumps(value, allow_nan=False, ensure_ascii=False)


def print_json(value: object) -> None:
    """The one JSON document of a command. NaN and infinities are a bug, so they raise."""
    sys.stdout.write(json_text(value) + "\n")


def print_rows(rows: Sequence[tuple[str, str]]) -> None:
    """Names and values, aligned."""
    print("\n".join(aligned(rows)))


def aligned(rows: Sequence[tuple[str, str]], least: int = 0) -> list[str]:
    """The lines of names and values in two columns; `width`: least width of the first."""
    width = max(least, *(len(name) for name, _ in rows))
    return [f"{name:<{width}}  {value}" for name, value in rows]


def duration_text(seconds: float) -> str:
    """A time as text: "12.3 ms", "4.56789 s", "2 min 5.3 s", "1 h 2 min 5 s"."""
    if 0.0 < seconds < 0.1:
        return f"{seconds * 1e3:.3g} ms"
    if seconds < 60.0:
        return f"{number(seconds)} s"
    minutes, rest = divmod(round(seconds, 1), 60.0)
    if minutes < 60:
        return f"{minutes:.0f} min {rest:.1f} s"
    hours, minutes = divmod(round(seconds) // 60, 60)
    return f"{hours} h {minutes} min {round(seconds) % 60} s"


def size_text(size: int) -> str:
    """A number of bytes as text: "7672 bytes", "129008 bytes (126 KiB)"."""
    for unit, power in (("GiB", 30), ("MiB", 20), ("KiB", 10)):
        if size >= 10 * 2**power:
            return f"{size} bytes ({size / 2**power:.3g} {unit})"
    return f"{size} bytes"


def number(value: float) -> str:
    """A number as text: six digits, without an exponent if possible."""
    if value and (abs(value) >= 1e6 or abs(value) < 1e-4) and math.isfinite(value):
        return f"{value:.4e}"
    return f"{value:.6g}"


@contextmanager
def progress(title: str, unit: str, total: int | None = None) -> Iterator[Callable[[int], None]]:
    """Progress on stderr: a bar on a terminal, else a line from time to time.

    Call the result with the finished part.
    """
    if not WANTED.progress:
        yield _nothing
        return
    if not is_terminal(sys.stderr):
        yield _Lines(title, unit, total)
        return
    from tqdm import tqdm

    with held(), tqdm(total=total, desc=title, unit=unit, leave=False, delay=0.3) as bar:

        def advance(done: int) -> None:
            bar.update(done - bar.n)

        yield advance


def _nothing(done: int) -> None:
    del done


class _Lines:
    """A line after LINE_AFTER_S, then at most one every LINE_EVERY_S."""

    def __init__(self, title: str, unit: str, total: int | None) -> None:
        self._title, self._unit, self._total = title, unit, total
        self._due_s = time.monotonic() + LINE_AFTER_S

    def __call__(self, done: int) -> None:
        now_s = time.monotonic()
        if now_s < self._due_s:
            return
        self._due_s = now_s + LINE_EVERY_S
        of = f" of {self._total} ({100 * done / self._total:.0f} %)" if self._total else ""
        note(f"{self._title}: {self._unit} {done}{of}")


def require_places(*files: Path | None, folders: Sequence[Path | None] = ()) -> None:
    """Raises InputError: a file or folder that a command writes at its end cannot be made (None is ignored).

    Call it first: a run takes long, and a motion of the machine cannot be repeated exactly. It writes nothing.
    """
    for file in filter(None, files):
        if _is_device(file):
            _require_place(file, None if os.access(file, os.W_OK) else errno.EACCES)
        else:
            _require_place(file, errno.EISDIR if file.is_dir() else _refusal(file.resolve().parent))
    for folder in filter(None, folders):
        above = (place for place in (folder, *folder.parents) if place.exists())
        _require_place(folder, _refusal(next(above)))


def _is_device(file: Path) -> bool:
    """Whether a file is a device, a pipe, or a link below /dev to what the shell has redirected: never replaced."""
    if not file.exists() or file.is_dir():
        return False
    return not file.is_file() or file.is_relative_to("/dev")


def _require_place(path: Path, code: int | None) -> None:
    if code is not None:
        raise InputError(f"{path}: cannot be written: {os.strerror(code)}")


def _refusal(folder: Path) -> int | None:
    """Why a folder cannot be written, as errno; None: it can."""
    if not folder.exists():
        return errno.ENOENT
    if not folder.is_dir():
        return errno.ENOTDIR
    return None if os.access(folder, os.W_OK | os.X_OK) else errno.EACCES


def write_file(file: Path, data: bytes) -> None:
    """Writes a result: a file whole or not at all, a device or a pipe directly. Raises InputError."""
    direct = _is_device(file)
    place = file if direct else file.resolve()
    try:
        if direct:
            file.write_bytes(data)
        else:
            replace_file(place, data)
    except OSError as error:
        raise InputError(f"{place}: cannot be written: {error.strerror}") from None


def require_new(*files: Path | None, force: bool) -> None:
    """Raises InputError: a file exists and may not be replaced (None is ignored)."""
    there = [str(file) for file in files if file is not None and file.exists()]
    if there and not force:
        raise InputError(
            f"{', '.join(there)}: there already: name another --output, or add --force"
        )


def write_files(files: Mapping[Path, str], *, force: bool) -> None:
    """Writes texts by path, one after the other. Raises InputError, before writing any: a file exists and may not be
    replaced.
    """
    require_new(*files, force=force)
    for file, text in files.items():
        write_file(file, text.encode())
