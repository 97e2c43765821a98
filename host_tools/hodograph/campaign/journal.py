# SPDX-License-Identifier: MIT
"""The file that lets a campaign go on: a line for each program and each batch of runs that is done.

Lines are only ever added. A line that was cut off (the process was killed in the middle of it) is dropped when the file
is opened again. The first line tells which campaign it belongs to.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

from filelock import lock_descriptor

from ..errors import InputError
from .execute import Built, Outcome
from .results import Results

NAME = "runs.journal"


class Journal:
    """What is done, on disk and in memory."""

    def __init__(self, stream: IO[bytes], results: Results) -> None:
        self._stream = stream
        self.results = results
        self.programs: dict[int, Built] = {}

    def add_program(self, built: Built) -> None:
        """Keeps a program."""
        self.programs[built.number] = built
        image = base64.b64encode(built.image).decode()
        self._write({"program": [built.number, built.ticks, built.error, image]})

    def add_runs(self, outcomes: Sequence[Outcome]) -> None:
        """Keeps the results of a batch."""
        self.results.put(outcomes)
        rows = [[o.number, list(o.values), o.encoders_sha256, o.error] for o in outcomes]
        self._write({"runs": rows})

    def _write(self, value: dict[str, Any]) -> None:
        self._stream.write(json.dumps(value, separators=(",", ":")).encode() + b"\n")
        self._stream.flush()

    def read(self, fingerprint: str, *, fresh: bool) -> None:
        """Takes up what the file holds. Raises InputError: it is of another campaign and may not be replaced."""
        good = 0
        self._stream.seek(0)
        for number, line in enumerate(self._stream):
            value = _value(line)
            if number == 0 and (fresh or value is None or value.get("campaign") != fingerprint):
                if not fresh and value is not None:
                    raise InputError(
                        f"{self._stream.name}: holds runs of another campaign (the file, one that it names or "
                        "hodograph itself is not what it was): give --fresh to begin anew, or another folder with -o"
                    )
                break
            if value is None:
                break
            good += len(line)
            self._take(value)
        self._stream.seek(good)
        self._stream.truncate()
        if good == 0:
            self._write({"campaign": fingerprint})

    def _take(self, value: dict[str, Any]) -> None:
        if "program" in value:
            number, ticks, error, image = value["program"]
            self.programs[number] = Built(number, base64.b64decode(image), ticks, error)
        for number, values, digest, error in value.get("runs", ()):
            self.results.put([Outcome(number, tuple(values), digest, error)])


def _value(line: bytes) -> dict[str, Any] | None:
    """The object of a line; None: it was cut off."""
    if not line.endswith(b"\n"):
        return None
    try:
        value = json.loads(line)
    except ValueError:
        return None
    return value if isinstance(value, dict) else None


@contextmanager
def journal(folder: Path, fingerprint: str, total: int, *, fresh: bool) -> Iterator[Journal]:
    """The journal in a folder, which is made if need be, for this process alone. Raises InputError."""
    file = folder / NAME
    try:
        folder.mkdir(parents=True, exist_ok=True)
        stream = file.open("a+b")
    except OSError as error:
        raise InputError(f"{file}: cannot be written: {error.strerror}") from None
    with stream:
        if not lock_descriptor(stream.fileno(), blocking=False):
            raise InputError(
                f"{file}: another `hodograph campaign` is at work on it: wait for it, or use another folder with -o"
            )
        made = Journal(stream, Results(total))
        made.read(fingerprint, fresh=fresh)
        yield made
