# SPDX-License-Identifier: MIT
"""The results as a table: a row for each run, in the order of their numbers, as CSV (RFC 4180, UTF-8)."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from typing import IO

import numpy as np
from numpy.typing import NDArray

from .design import Case, Design
from .execute import QUANTITIES
from .results import Results

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
    """What a group's runs have in common; "own" is what the path file asks for."""
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
