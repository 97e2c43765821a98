# SPDX-License-Identifier: MIT
"""What commands write: results on stdout, notes and progress on stderr."""

from __future__ import annotations

import json
import math
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from ..errors import InputError

LINE_AFTER_S, LINE_EVERY_S = 5.0, 10.0
"""Of progress where there is no terminal."""


def note(text: str) -> None:
    """One line for the user, on stderr."""
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
    """The lines of names and values in two columns, the first at least so wide."""
    width = max(least, *(len(name) for name, _ in rows))
    return [f"{name:<{width}}  {value}" for name, value in rows]


def number(value: float) -> str:
    """A number for people: six digits, no exponent where it can be avoided."""
    if value and (abs(value) >= 1e6 or abs(value) < 1e-4) and math.isfinite(value):
        return f"{value:.4e}"
    return f"{value:.6g}"


@contextmanager
def progress(title: str, unit: str, total: int | None = None) -> Iterator[Callable[[int], None]]:
    """Progress on stderr: a bar while it is a terminal, else a line now and then.

    Call the result with what is done so far.
    """
    if not sys.stderr.isatty():
        yield _Lines(title, unit, total)
        return
    from tqdm import tqdm

    with tqdm(total=total, desc=title, unit=unit, leave=False, delay=0.3) as bar:

        def advance(done: int) -> None:
            bar.update(done - bar.n)

        yield advance


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


def write_file(file: Path, data: bytes) -> None:
    """Writes a result, whole or not at all. Raises InputError."""
    fresh = file.with_name(file.name + ".part")
    try:
        fresh.write_bytes(data)
        fresh.replace(file)
    except OSError as error:
        fresh.unlink(missing_ok=True) if fresh.parent.is_dir() else None
        raise InputError(f"{file}: cannot be written: {error.strerror}") from None


def write_files(files: Mapping[Path, str], *, force: bool) -> None:
    """Writes texts by path; none when one is there already and may not be replaced. Raises InputError."""
    there = [str(file) for file in files if file.exists()]
    if there and not force:
        raise InputError(
            f"{', '.join(there)}: there already: name another --output, or add --force"
        )
    for file, text in files.items():
        write_file(file, text.encode())
