# SPDX-License-Identifier: MIT
"""Results of runs: in arrays by number (100 bytes for each run), as a table (CSV, RFC 4180), and in a journal from
which a campaign can continue. Used by campaign/ and cli/campaign_command. Makes the folder; reads, writes and locks the
journal.

Lines of the journal are only ever added. A line that was cut off (the process was killed in the middle of it) is
dropped when the file is opened again. The first line names the campaign that it belongs to.
"""

from __future__ import annotations

import base64
import csv
import json
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import numpy as np
from filelock import lock_descriptor
from numpy.typing import NDArray

from ..errors import InputError
from .execute import QUANTITIES, Built, Outcome
from .run_settings import Case, Design


class Results:
    """The results of the runs of a campaign."""

    def __init__(self, total: int) -> None:
        self.done: NDArray[np.bool_] = np.zeros(total, dtype=np.bool_)
        self.values: NDArray[np.float64] = np.full((total, len(QUANTITIES)), np.nan)
        self.encoders_sha256: NDArray[np.bytes_] = np.zeros(total, dtype="S64")
        self.errors: dict[int, str] = {}

    def put(self, outcomes: Iterable[Outcome]) -> None:
        """Adds results; a run that has results already keeps them."""
        for outcome in outcomes:
            number = outcome.number
            if self.done[number]:
                continue
            self.done[number] = True
            if outcome.error:
                self.errors[number] = outcome.error
                continue
            self.values[number] = outcome.values
            self.encoders_sha256[number] = outcome.encoders_sha256.encode()

    @property
    def count(self) -> int:
        """Runs that are done."""
        return int(np.count_nonzero(self.done))

    def missing(self, first: int, last: int) -> list[int]:
        """Numbers from `first` to before `last` that are not done."""
        return [int(i) + first for i in np.flatnonzero(~self.done[first:last])]


_CASE = ("path", "profile", "feed_mm_s", "gains", "fault")


def header(design: Design) -> list[str]:
    """Names of the columns."""
    varied = ("sample", *design.varied_columns, "rules")
    return ["run", *_CASE, *varied, *QUANTITIES, "encoders_sha256", "error"]


def rows(design: Design, results: Results) -> Iterator[list[str]]:
    """Rows of the runs that are done. Numbers are the shortest text that gives the same double again."""
    for group in range(design.total // design.group_size):
        case = case_texts(design, design.case(group))
        for number in range(group * design.group_size, (group + 1) * design.group_size):
            if results.done[number]:
                yield [str(number), *case, *_run(design, number), *_result(results, number)]


def case_texts(design: Design, case: Case) -> list[str]:
    """The common settings of a group's runs; "own" is the setting of the path file."""
    feed_mm_s = design.feeds_mm_s[case.feed]
    return [
        design.names[case.path],
        design.profiles[case.profile] or "own",
        "own" if feed_mm_s is None else repr(feed_mm_s),
        design.gains[case.gains].name,
        design.faults[case.fault].name,
    ]


def _run(design: Design, number: int) -> list[str]:
    sample, varied = design.varied(number)
    return [str(sample), *(repr(value) for _, value in varied), design.rules(number)]


def _result(results: Results, number: int) -> list[str]:
    error = results.errors.get(number)
    if error is not None:
        return [*[""] * (len(QUANTITIES) + 1), error]
    values = [repr(float(value)) for value in results.values[number]]
    return [*values, results.encoders_sha256[number].decode(), ""]


def varied_numbers(design: Design, group: int) -> NDArray[np.float64]:
    """The figures that vary, (runs of the group, columns)."""
    first = group * design.group_size
    return np.array(
        [
            [value for _, value in design.varied(number)[1]]
            for number in range(first, first + design.group_size)
        ]
    )


def write_csv(design: Design, results: Results, stream: IO[str]) -> None:
    """The whole table."""
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(header(design))
    writer.writerows(rows(design, results))


NAME = "runs.journal"


class Journal:
    """The journal of a campaign: finished programs and runs, on disk and in memory."""

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
        """Reads the file. Raises InputError: it is of another campaign and may not be replaced."""
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
