# SPDX-License-Identifier: MIT
"""The curve of a program: points to draw, and the distance from it (sim/offline/contour, docs/theory/numerics.md
section 14)."""

from __future__ import annotations

import zlib

import numpy as np
from numpy.typing import NDArray

from ..native import Contour, NativeProgram
from .decoder import Floats

DRAWN_POINTS = 3000
_TABLE_POINTS = 20000
_ON_PATH_UM = 1.0
"""Setpoints of the program are rounded to counts; what is farther from the curve than this is another motion."""


class ProgramPath:
    """Follows setpoints along the curve, so that it knows the arc length of each.

    The arc length is not on the bus: it is the way along the setpoints, corrected by the projection on the curve.
    Where the setpoints are not on the curve (a move to the start, say), it is looked for anew. Raises InputError for
    an image that is not a program.
    """

    def __init__(self, image: bytes, counts_per_mm: int) -> None:
        program = NativeProgram(image)
        self._contour = Contour(program)
        self._counts_per_mm = counts_per_mm
        self.crc32 = zlib.crc32(image[16:])
        self.period_us = program.period_us
        self.name = image[80:112].rstrip(b"\0").decode("utf-8", "replace")
        self.length_mm = int(program.pointer.header.length_q40_mm) / 2**40
        self.duration_s = program.duration_q32_s / 2**32
        self._arc_mm, self._points_mm = _table(program)
        self._tangents = _tangents(self._arc_mm, self._points_mm)
        self._last_mm: float | None = None
        self._last_counts: Floats | None = None

    def drawing(self) -> Floats:
        """Points of the curve in mm, (n, 2), at equal distances, the last one included."""
        arcs = np.linspace(0.0, self.length_mm, min(DRAWN_POINTS, self._arc_mm.size))
        return self._at(arcs, self._points_mm)

    def contour_errors_um(self, targets: Floats, actual: Floats) -> Floats:
        """Distance of the positions (n, 2) from the curve, in um, beside the setpoints (n, 2), all in counts.

        NaN where the setpoint is not on the curve, or something did not come.
        """
        errors = np.full(targets.shape[0], np.nan)
        there = np.flatnonzero(np.isfinite(targets).all(axis=1) & np.isfinite(actual).all(axis=1))
        if there.size == 0:
            return errors
        set_counts, act_counts = targets[there], actual[there]
        arcs, on_path = self._follow(set_counts)
        self._last_counts = set_counts[-1]
        self._last_mm = float(arcs[-1]) if on_path[-1] else None
        found = self._errors(arcs, act_counts)
        found[~on_path] = np.nan
        errors[there] = found
        return errors

    @property
    def arc_length_mm(self) -> float | None:
        """Where on the path the last setpoint was; None when it was not on it."""
        return self._last_mm

    def _follow(self, counts: Floats) -> tuple[Floats, NDArray[np.bool_]]:
        """Arc lengths of setpoints, and whether they are on the curve."""
        if self._last_mm is not None and self._last_counts is not None:
            way = self._way(np.vstack([self._last_counts, counts]))[1:]
            arcs, on_path = self._refine(self._last_mm + way, counts)
            if on_path.all():
                return arcs, on_path
        else:
            arcs, on_path = np.zeros(len(counts)), np.zeros(len(counts), dtype=bool)
        for here in (len(counts) - 1, 0):
            way = self._way(counts)
            again, good = self._refine(self._nearest(counts[here]) + way - way[here], counts)
            better = good & ~on_path
            arcs[better], on_path[better] = again[better], True
        return arcs, on_path

    def _way(self, counts: Floats) -> Floats:
        steps = np.hypot.reduce(np.diff(counts, axis=0), axis=1) / self._counts_per_mm
        return np.concatenate([[0.0], np.cumsum(steps)])

    def _refine(self, arcs: Floats, counts: Floats) -> tuple[Floats, NDArray[np.bool_]]:
        points = counts / self._counts_per_mm
        arcs = np.clip(arcs, 0.0, self.length_mm)
        for _ in range(3):
            tangents = self._at(arcs, self._tangents)
            away = points - self._at(arcs, self._points_mm)
            arcs = np.clip(arcs + np.sum(away * tangents, axis=1), 0.0, self.length_mm)
        return arcs, self._errors(arcs, counts) < _ON_PATH_UM

    def _nearest(self, counts: Floats) -> float:
        away = self._points_mm - counts / self._counts_per_mm
        return float(self._arc_mm[np.argmin(np.sum(away * away, axis=1))])

    def _errors(self, arcs: Floats, counts: Floats) -> Floats:
        arcs_q40 = np.rint(arcs * 2**40).astype(np.int64)
        return self._contour.errors_um(
            arcs_q40, np.rint(counts).astype(np.int32), self._counts_per_mm
        )

    def _at(self, arcs: Floats, table: Floats) -> Floats:
        return np.stack([np.interp(arcs, self._arc_mm, column) for column in table.T], axis=1)


def _table(program: NativeProgram) -> tuple[Floats, Floats]:
    """Arc lengths, ascending, and points of a program, at even times."""
    count = min(program.ticks, _TABLE_POINTS)
    end_q42 = program.duration_q32_s << 10
    times = np.array([end_q42 * i // (count - 1) for i in range(count)], dtype=np.uint64)
    points = program.points("double", times)
    arcs = points["arc_length_q40_mm"] / 2**40
    fresh = np.concatenate([[True], np.diff(arcs) > 0])
    xy = np.stack([points["x_q40_mm"], points["y_q40_mm"]], axis=1) / 2**40
    return np.asarray(arcs[fresh]), np.asarray(xy[fresh])


def _tangents(arcs: Floats, points: Floats) -> Floats:
    steps = np.gradient(points, arcs, axis=0)
    return np.asarray(steps / np.maximum(np.hypot.reduce(steps, axis=1), 1e-12)[:, None])
