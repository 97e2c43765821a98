# SPDX-License-Identifier: MIT
"""The stop table of a program: stop parameters and stop time bounds of each feed piece; docs/reference/protocol.md 1.4.
Used by program/, stream/, machine_limits and cli/path_commands. No I/O.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Real = NDArray[np.float64]
Codes = NDArray[np.uint8]
Unsigned = NDArray[np.uint32]

STOP_KINDS = ("hold", "fault")
"""Feed hold and controlled stop brake inside the program's limits, a fault stop inside the machine's."""

HOLD, FAULT = 0, 1
JERK_DOWN, DECELERATION, JERK_UP = 0, 1, 2
"""Columns of the codes."""

GREATEST_CODE = 255
_EIGHTHS = np.array([65536, 71468, 77935, 84990, 92681, 101070, 110217, 120193], dtype=np.uint64)
"""2^16 2^(i/8), rounded down."""
_UNITS = np.array([2.0**-18, 2.0**-24, 2.0**-18])
"""The unit of a mantissa in each column: mm/s^3, mm/s^2, mm/s^3."""


def mantissas(codes: ArrayLike) -> NDArray[np.uint64]:
    """What codes (any shape) stand for: decelerations in 2^-24 mm/s^2, jerks in 2^-18 mm/s^3; code 0: 0."""
    c = np.asarray(codes, dtype=np.uint64)
    return np.where(c > 0, _EIGHTHS[c & np.uint64(7)] << (c >> np.uint64(3)), np.uint64(0))


def numbers(codes: ArrayLike) -> Real:
    """Jerk, deceleration, jerk (…, 3) in mm and s of codes (…, 3)."""
    return np.asarray(mantissas(codes).astype(np.float64) * _UNITS)


def code_below(column: int, value: float) -> int:
    """The greatest code of a column whose number is at most `value` (mm, s); 0: that of code 1 is greater."""
    own = numbers(np.repeat(np.arange(GREATEST_CODE + 1)[:, None], 3, axis=1))[:, column]
    return int(np.searchsorted(own, value, side="right")) - 1


@dataclass(frozen=True)
class WorstStop:
    """The longest stop of a kind: its bound, the distance it takes at most, the piece it begins in."""

    time_s: float
    distance_mm: float
    piece: int


@dataclass(frozen=True, eq=False)
class Stops:
    """The stop table of an image, for M pieces; the second axis is the kind, HOLD or FAULT.

    codes      (M, 2, 3) of jerk, deceleration, jerk
    bound_us   (M, 2) from the command to rest, for a stop that is requested in this piece
    worst_us   (2,) the greatest of them; worst_um (2,) the longest distance
    """

    codes: Codes
    bound_us: Unsigned
    worst_us: tuple[int, int]
    worst_um: tuple[int, int]

    def __len__(self) -> int:
        return int(self.bound_us.shape[0])

    def late(self, kind: int, time_s: float) -> NDArray[np.bool_]:
        """The pieces (M,) in which stops of a kind may take longer than this."""
        return np.asarray(self.bound_us[:, kind] * 1e-6 > time_s)

    def worst(self, kind: int) -> WorstStop:
        """The worst stop of a kind."""
        return WorstStop(
            self.worst_us[kind] * 1e-6,
            self.worst_um[kind] * 1e-3,
            int(self.bound_us[:, kind].argmax()),
        )


def no_stops(count: int) -> Stops:
    """A table without any path stop, which no controller accepts. A program has it before its stops are planned."""
    return Stops(
        np.zeros((count, 2, 3), dtype=np.uint8),
        np.zeros((count, 2), dtype=np.uint32),
        (0, 0),
        (0, 0),
    )


def stops_dict(stops: Stops, start_mm: Real) -> dict[str, Any]:
    """The worst stops as plain numbers for JSON: by kind, time, distance and where they begin.

    start_mm  (M,) arc length at the start of each piece
    """
    out = {}
    for kind, name in enumerate(STOP_KINDS):
        worst = stops.worst(kind)
        out[name] = {
            "time_s": worst.time_s,
            "distance_mm": worst.distance_mm,
            "at_mm": float(start_mm[worst.piece]),
            "piece": worst.piece,
        }
    return out


def stops_text(stops: Stops, start_mm: Real, unit: str) -> Iterator[str]:
    """The stop table as text: one line for each kind. `unit`: of lengths of the path."""
    for kind, name in enumerate(("hold, stop", "fault stop")):
        worst = stops.worst(kind)
        yield (
            f"{name:<10} at most {worst.time_s:.4g} s and {worst.distance_mm:.4g} {unit} to rest, "
            f"longest from arc length {start_mm[worst.piece]:.6g} mm (piece {worst.piece})"
        )
