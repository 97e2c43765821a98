# SPDX-License-Identifier: MIT
"""Drawings as text, the moves that readers make of them, and points of these moves. Used by the tests of toolpaths.
Writes files.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.spatial import cKDTree

from hodograph.toolpath.drawing import DrawingOptions
from hodograph.toolpath.dxf import read_dxf
from hodograph.toolpath.moves import (
    ORIGIN,
    ArcMove,
    Command,
    Message,
    Position,
    ProgramEnd,
    SplineMove,
    StraightMove,
)
from hodograph.toolpath.svg import read_svg

Move = StraightMove | ArcMove | SplineMove
Points = NDArray[np.float64]

IN_FILE_ORDER: dict[str, Any] = {"order": "file", "gap_mm": 0.0}
"""Options that leave contours as they are."""


def svg_commands(folder: Path, text: str, **options: Any) -> list[Command]:
    """The commands of a drawing in SVG."""
    path = folder / "drawing.svg"
    path.write_text(text, encoding="utf-8")
    return _commands(read_svg(path, DrawingOptions(**{"feed_mm_s": 10.0, **options})))


def svg_page(body: str, *, width: float = 100.0, height: float = 50.0, head: str = "") -> str:
    """A page with user units of a millimetre."""
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
        f'xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" width="{width}mm" height="{height}mm" '
        f'viewBox="0 0 {width} {height}" {head}>\n{body}\n</svg>\n'
    )


def dxf_commands(path: Path, **options: Any) -> list[Command]:
    """The commands of a drawing in DXF."""
    return _commands(read_dxf(path, DrawingOptions(**{"feed_mm_s": 10.0, **options})))


def _commands(commands: Iterable[Command]) -> list[Command]:
    found = list(commands)
    assert isinstance(found[-1], ProgramEnd)
    return found


def moves_in(commands: Iterable[Command]) -> list[Move]:
    """All moves."""
    return [each for each in commands if isinstance(each, Move)]


def messages_in(commands: Iterable[Command]) -> list[str]:
    """The texts of all messages."""
    return [each.text for each in commands if isinstance(each, Message)]


def contours_of(commands: Iterable[Command], start: Position = ORIGIN) -> list[list[Points]]:
    """The moves at feed between rapid moves, each as points from its start to its end."""
    found: list[list[Points]] = [[]]
    here = start
    for move in moves_in(commands):
        if move.feed is None:
            found.append([])
        else:
            found[-1].append(points_of(move, here))
        here = move.end
    return [contour for contour in found if contour]


def points_of(move: Move, start: Position, count: int = 129) -> Points:
    """Points of a move, both ends included, shape (count, 3)."""
    t = np.linspace(0.0, 1.0, count)
    first, last = np.array(start[:3]), np.array(move.end[:3])
    if isinstance(move, StraightMove):
        return first + np.outer(t, last - first)
    if isinstance(move, ArcMove):
        x, y = move.centre
        u, v = first[:2] - (x, y), last[:2] - (x, y)
        angle = math.atan2(u[0] * v[1] - u[1] * v[0], float(u @ v))
        angle = math.copysign(angle % math.tau if move.turns > 0 else -angle % math.tau, move.turns)
        angle += math.copysign(math.tau * (abs(move.turns) - 1), move.turns)
        if np.allclose(u, v, atol=1e-12):
            angle = math.tau * move.turns
        c, s = np.cos(angle * t), np.sin(angle * t)
        radius = 1.0 + t * (np.hypot(*v) / np.hypot(*u) - 1.0)
        columns = [x + radius * (c * u[0] - s * u[1]), y + radius * (s * u[0] + c * u[1])]
        return np.column_stack([*columns, first[2] + t * (last[2] - first[2])])
    assert move.points[0][:3] == start[:3]
    weights = np.array(move.weights)
    points = np.array(move.points)[:, :3]
    homogeneous = np.column_stack([points * weights[:, None], weights])
    values = BSpline(np.array(move.knots), homogeneous, move.degree)(t)
    found: Points = values[:, :3] / values[:, 3:]
    return found


def length_of(contour: Sequence[Points]) -> float:
    """The length of a contour, by its points."""
    return float(sum(np.linalg.norm(np.diff(part, axis=0), axis=1).sum() for part in contour))


def dense(parts: Iterable[Points], spacing: float) -> Points:
    """Points on polylines, at most `spacing` apart."""
    found = []
    for part in parts:
        steps = np.diff(part, axis=0)
        count = max(1, math.ceil(float(np.linalg.norm(steps, axis=1).max()) / spacing))
        share = np.arange(count)[None, :, None] / count
        found += [(part[:-1, None] + share * steps[:, None]).reshape(-1, 3), part[-1:]]
    return np.concatenate(found)


def distance_both_ways(some: Iterable[Points], others: Iterable[Points], spacing: float) -> float:
    """The Hausdorff distance of two sets of polylines, at most `spacing` too great."""
    first, second = dense(some, spacing), dense(others, spacing)
    there = np.asarray(cKDTree(second).query(first)[0])
    back = np.asarray(cKDTree(first).query(second)[0])
    return float(max(there.max(), back.max()))
