# SPDX-License-Identifier: MIT
"""Figures of a toolpath: the path with the feed as colour, corners with their tolerance, the feed over time. Used by
report/toolpath_report. Returns PNG bytes; no I/O.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib import pyplot
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PatchCollection
from matplotlib.patches import Circle, Polygon
from numpy.typing import NDArray

from ..job import Job, JobSection
from ..job_simulation import JobMotion
from .style import BLUE, GREY, INK, ORANGE, SOFT, plan_axes, png

Real = NDArray[np.float64]

CORNERS = 4
"""Corners shown enlarged."""

_LEAST_TURN_RAD = np.radians(5.0)
"""A vertex that turns more is a corner in the figure."""
_HALF_WIDTH = 6.0
"""Half the width of an enlarged corner, in tolerances."""

_SAMPLES = 400


@dataclass(frozen=True, eq=False)
class Place:
    """A place of the path that is shown enlarged: a programmed vertex.

    section, vertex  the section, and the number of the vertex in its reference
    distance_mm      distance of the curve from it
    """

    section: JobSection
    vertex: int
    distance_mm: float


def path_figure(run: JobMotion) -> bytes:
    """The path from above: the feed as colour, rapid moves dashed."""
    figure, axes = pyplot.subplots(figsize=(9.6, 6.4))
    points, feeds = [], []
    for section, motion in zip(run.job.sections, run.motions, strict=True):
        if section.stands_at is not None:
            continue
        at = motion.cmd_mm[: motion.ticks, :2]
        rapid = section.is_rapid_at(motion.arc_length_mm[: motion.ticks])
        for first, last in _stretches(rapid):
            part = at[first : last + 1]
            axes.plot(*part.T, color=SOFT, linewidth=0.9, linestyle=(0, (4, 3)), zorder=2)
        cutting = ~rapid[:-1]
        points.append(np.stack([at[:-1], at[1:]], axis=1)[cutting])
        feeds.append(motion.feed_mm_s[: motion.ticks - 1][cutting])
    lines = LineCollection(
        list(np.concatenate(points or [np.zeros((0, 2, 2))])), linewidths=1.8, zorder=3
    )
    lines.set_array(np.concatenate(feeds or [np.zeros(0)]))
    axes.add_collection(lines)
    axes.autoscale()
    plan_axes(axes)
    axes.set_title(f"{run.job.file.name}: feed along the path; dashed: rapid moves")
    figure.colorbar(lines, ax=axes, label="feed, mm/s", shrink=0.8)
    return png(figure)


def _stretches(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last index of each run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(np.int8)))
    return [(int(a), int(b) - 1) for a, b in edges.reshape(-1, 2)]


def widest_corners(job: Job) -> list[Place]:
    """The vertices that the curve passes at the greatest distance, one for each kind of corner."""
    moving = [section for section in job.sections if section.stands_at is None]
    found = [place for section in moving for place in _corners_of(section)]
    found.sort(key=lambda place: -place.distance_mm)
    shown: list[Place] = []
    kinds: set[tuple[int, int, int]] = set()
    for place in found:
        kind = _kind(place)
        if kind not in kinds:
            kinds.add(kind)
            shown.append(place)
        if len(shown) == CORNERS:
            break
    return shown


def _corners_of(section: JobSection) -> list[Place]:
    reference, curve = section.fitted.reference, section.fitted.curve
    direction = np.diff(reference.point, axis=0) / reference.length_mm[:, None]
    turn = np.arccos(np.clip(np.sum(direction[:-1] * direction[1:], axis=1), -1.0, 1.0))
    found = []
    for vertex in (np.flatnonzero(turn > _LEAST_TURN_RAD) + 1).tolist():
        at_mm = float(section.fitted.arc_length_at(reference.place_mm[[vertex]])[0])
        near = _near(section, at_mm)
        gap = np.linalg.norm(curve.point(near) - reference.point[vertex], axis=1)
        found.append(Place(section, vertex, float(gap.min())))
    return found


def _near(section: JobSection, at_mm: float) -> Real:
    """Arc lengths (n,) around one, as far as an enlarged corner shows."""
    half = 2.0 * _HALF_WIDTH * section.tolerance_mm
    low, high = max(0.0, at_mm - half), min(section.fitted.curve.length_mm, at_mm + half)
    return np.linspace(low, high, _SAMPLES)


def _kind(place: Place) -> tuple[int, int, int]:
    """The kind of corners: their turn in steps of 10 degrees, and their distance."""
    reference = place.section.fitted.reference
    a, b = np.diff(reference.point[place.vertex - 1 : place.vertex + 2], axis=0)
    cosine = a @ b / (np.linalg.norm(a) * np.linalg.norm(b))
    turn = int(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))) // 10.0)
    share = int(10.0 * place.distance_mm / max(place.section.tolerance_mm, 1e-9))
    return turn, share, int(a[2] != 0.0 or b[2] != 0.0)


def corner_figure(places: list[Place]) -> bytes:
    """Programmed and resulting path at corners, with the tolerance around the programmed one."""
    columns = min(2, len(places))
    rows = -(-len(places) // columns)
    figure, grid = pyplot.subplots(rows, columns, figsize=(9.6, 4.6 * rows), squeeze=False)
    for axes, place in zip(grid.flat, places, strict=False):
        _corner(axes, place)
    for axes in list(grid.flat)[len(places) :]:
        axes.set_visible(False)
    grid[0, 0].legend(loc="upper left")
    return png(figure)


def _corner(axes: Axes, place: Place) -> None:
    section = place.section
    reference, tolerance_um = section.fitted.reference, 1e3 * section.tolerance_mm
    frame = _plane_of(reference.point[place.vertex - 1 : place.vertex + 2])
    origin = reference.point[place.vertex]
    first = max(0, place.vertex - 20)
    programmed = 1e3 * (reference.point[first : place.vertex + 21] - origin) @ frame.T
    _tube(axes, programmed, tolerance_um)
    axes.plot(*programmed.T, ".-", color=INK, linewidth=1.0, markersize=4, label="programmed")
    at_mm = float(section.fitted.arc_length_at(reference.place_mm[[place.vertex]])[0])
    curve = 1e3 * (section.fitted.curve.point(_near(section, at_mm)) - origin) @ frame.T
    axes.plot(*curve.T, color=BLUE, linewidth=1.8, label="C2 PH curve")
    half = _HALF_WIDTH * tolerance_um
    axes.set(
        xlim=(-half, half), ylim=(-half, half), xlabel="along the leg, µm", ylabel="across, µm"
    )
    axes.set_aspect("equal", adjustable="box")
    line = int(reference.line[min(place.vertex, reference.count - 1)])
    axes.set_title(f"line {line}: {1e3 * place.distance_mm:.2f} µm from the vertex")


def _plane_of(points: Real) -> Real:
    """Two unit vectors (2, 3) of the plane of three points, the first along their first leg."""
    along = points[1] - points[0]
    along /= np.linalg.norm(along)
    other = points[2] - points[1]
    across = other - (other @ along) * along
    length = np.linalg.norm(across)
    if length < 1e-12 * np.linalg.norm(other):  # straight on or back: any direction across
        across = np.cross(along, np.eye(3)[int(np.argmin(np.abs(along)))])
        length = np.linalg.norm(across)
    return np.stack([along, across / length])


def _tube(axes: Axes, points: Real, radius: float) -> None:
    """All places at most `radius` from a chain of chords."""
    patches: list[Any] = [Circle((float(x), float(y)), radius) for x, y in points]
    for a, b in pairwise(points):
        length = float(np.hypot(*(b - a)))
        if length > 0.0:
            side = radius * np.array([a[1] - b[1], b[0] - a[0]]) / length
            patches.append(Polygon([a + side, b + side, b - side, a - side]))
    axes.add_collection(PatchCollection(patches, facecolor="#fbe6d3", edgecolor="none", zorder=0))
    axes.plot([], [], color=ORANGE, alpha=0.3, linewidth=8, label="tolerance")


def feed_figure(run: JobMotion) -> bytes:
    """The feed over time; dashed: where a section ends."""
    figure, axes = pyplot.subplots(figsize=(9.6, 2.8))
    begin = 0
    turns = any(section.stands_at is not None for section in run.job.sections)
    unit = "feed, mm/s; deg/s where rotary axes move alone" if turns else "feed, mm/s"
    for motion in run.motions:
        t_s = (begin + np.arange(motion.ticks)) * run.period_s
        axes.plot(t_s, motion.feed_mm_s[: motion.ticks], color=BLUE, linewidth=1.1)
        begin += motion.ticks - 1
        axes.axvline(begin * run.period_s, color=GREY, linewidth=0.7, linestyle=(0, (2, 3)))
    axes.set(xlabel="time, s (dashed: ends of sections)", ylabel=unit)
    axes.set_title("Feed")
    axes.set_ylim(bottom=0.0)
    axes.margins(x=0)
    return png(figure)
