# SPDX-License-Identifier: MIT
"""Messages to the browsers, as JSON: rows in groups that keep each peak, with few digits, null for missing values. Used
by clients, pump and server. No I/O.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .decoder import Floats
from .derived import ProgramPath, Rows


def group_starts(count: int, size: int, most: int) -> NDArray[np.intp]:
    """First rows of groups over `count` rows: `size` rows each, more if there would be over `most` groups."""
    if count == 0:
        return np.empty(0, dtype=np.intp)
    size = max(1, size, -(-count // most))
    return np.arange(0, count, size)


def extremes(values: Floats, starts: NDArray[np.intp]) -> tuple[Floats, Floats]:
    """Least and greatest value of each group, by column; NaN: there is no value."""
    if starts.size == 0:
        empty = np.empty((0, *values.shape[1:]))
        return empty, empty
    return (
        np.fmin.reduceat(values, starts, axis=0),
        np.fmax.reduceat(values, starts, axis=0),
    )


GROUP_S = 0.010
"""Time that one group of the plots covers at the machine's own pace."""
MOST_GROUPS = 100
"""Most groups in a message; at full pace, and after a stall of more than a second, they are longer."""
POINT_S = 0.004
MOST_POINTS = 250
"""The same for the points of the path."""


def encode(message: dict[str, Any]) -> str:
    """JSON text. NaN and infinities are a bug, so they raise."""
    return json.dumps(message, allow_nan=False, ensure_ascii=False, separators=(",", ":"))


def numbers(values: Floats, digits: int) -> list[float | None]:
    """A column for JSON."""
    rounded = np.round(values, digits).tolist()
    return [value if math.isfinite(value) else None for value in rounded]


def path_message(
    path: ProgramPath | None, note: str = "", marks: Sequence[dict[str, Any]] = ()
) -> dict[str, Any]:
    """The program's curve, in space with z; axes after z over arc length.

    note   why there is no curve, or a remark on it
    marks  places where outputs switch
    """
    message: dict[str, Any] = {"type": "path", "note": note, "x": [], "y": []}
    if path is not None:
        points = path.drawing()
        message |= {
            **{name: numbers(column, 5) for name, column in zip("xyz", points.T, strict=False)},
            "name": path.name,
            "length_mm": path.length_mm,
            "duration_s": path.duration_s,
            "crc32": path.crc32,
        }
        if marks:
            message["marks"] = list(marks)
        arcs, extra = path.extra_drawing()
        if extra.shape[1]:
            message |= {
                "arc": numbers(arcs, 3),
                "extra": [numbers(column, 4) for column in extra.T],
            }
    return message


def job_message(
    job: int, points_mm: Floats, marks: Sequence[dict[str, Any]] = ()
) -> dict[str, Any]:
    """The known path of a streamed job, points (n, 2) or (n, 3), in place of that of a program. `marks`: places where
    outputs switch.
    """
    message: dict[str, Any] = {"type": "path", "note": "", "name": f"job {job}"}
    if marks:
        message["marks"] = list(marks)
    return message | {
        name: numbers(column, 5) for name, column in zip("xyz", points_mm.T, strict=False)
    }


def rows_message(
    rows: Rows,
    period_s: float,
    age_ms: float | None,
    drawn: int = 2,
    path_axes: int = 0,
    marks: Sequence[tuple[float, str]] = (),
    program: int | None = None,
) -> dict[str, Any]:
    """The rows of one poll, decimated.

    age_ms   age of the newest frame in it
    drawn    number of axes that draw the path; the others of the `path_axes` are given over arc length

    marks    outputs whose places were passed, with the times
    program  CRC-32 of the program along which the arc lengths are; None: of a job
    """
    starts = group_starts(rows.count, round(GROUP_S / period_s), MOST_GROUPS)
    message: dict[str, Any] = {
        "type": "rows",
        "age_ms": None if age_ms is None else round(age_ms, 1),
        "ticks": rows.count,
        "t": numbers(rows.t_s[starts], 4),
    }
    for name, values, digits in _series(rows):
        low, high = extremes(values, starts)
        message[name] = [numbers(low, digits), numbers(high, digits)]
    points = group_starts(rows.count, round(POINT_S / period_s), MOST_POINTS)
    if rows.cmd_mm.shape[1] >= 2:
        message["cmd"] = [numbers(column, 5) for column in rows.cmd_mm[points, :drawn].T]
        message["act"] = [numbers(column, 5) for column in rows.act_mm[points, :drawn].T]
    if marks:
        message["marks"] = [[round(t_s, 4), text] for t_s, text in marks]
    if path_axes > drawn:
        message["program"] = program
        message["arc"] = numbers(rows.arc_mm[points], 3)
        message["extra"] = [
            [numbers(column, 4) for column in values[points, drawn:path_axes].T]
            for values in (rows.cmd_mm, rows.act_mm)
        ]
    return message


def _series(rows: Rows) -> list[tuple[str, Floats, int]]:
    plain = [
        ("feed", rows.feed_mm_s, 3),
        ("acceleration", rows.acceleration_mm_s2, 1),
        ("jerk", rows.jerk_mm_s3, 0),
        ("contour", rows.contour_um, 3),
    ]
    following = rows.following_um
    return plain + [(f"following{i}", following[:, i], 2) for i in range(following.shape[1])]
