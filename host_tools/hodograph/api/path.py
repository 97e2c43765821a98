# SPDX-License-Identifier: MIT
"""Paths, limits, and plans of the feed along a path. Used by api/job, and by programs of users. Reads path files and
the machine files that they name.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf
from os import PathLike
from pathlib import Path as FilePath
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..config import PathFile, PathSpec, SpacePathSpec, load_path_file
from ..errors import InputError
from ..feed import AxisLimits, FeedPlan, FeedRequest
from ..feed import FeedZone as FileZone
from ..feed import Limits as FileLimits
from ..feed.kinematics import axis_motion
from ..feed.limits import LEAST_RESERVE
from ..feed.request import OPTIMAL, PROFILES
from ..job import JobSection
from ..names import AXES
from ..pipeline import Pipeline, pipeline_of
from ..section_pipeline import SectionPipeline
from ..spline import PHSpline, coordinates
from ..spline.frames import frames
from ..spline.spatial import SpatialPHSpline
from ..toolpath.fit.fitting import FittedPath
from .machine import Machine
from .program import Program

Real = NDArray[np.float64]
Profile = Literal["optimal", "exponential", "minimax", "quintic"]
PerAxis = float | tuple[float, ...]
"""One number for all path axes, or one for each."""


@dataclass(frozen=True)
class FeedZone:
    """A stretch of the path, by arc length, with a feed limit of its own."""

    from_mm: float
    to_mm: float
    feed_mm_s: float


@dataclass(frozen=True)
class Limits:
    """The limits of a plan in addition to those of the machine; None: no limit.

    feed_mm_s, acceleration_mm_s2, jerk_mm_s3    of the motion along the path
    centripetal_mm_s2                            feed^2 times curvature
    axis_velocity_mm_s, axis_acceleration_mm_s2, axis_jerk_mm_s3
                                                 of the path axes: a number for all, or one for each
    volts                                        of each axis, by the plant in the drive files of the machine
    zones                                        stretches with a feed limit of their own
    reserve                                      share of axis accelerations, jerks and volts that a plan leaves free

    >>> Limits(feed_mm_s=100, axis_acceleration_mm_s2=(2000, 1500)).feed_mm_s
    100
    """

    feed_mm_s: float | None = None
    acceleration_mm_s2: float | None = None
    jerk_mm_s3: float | None = None
    centripetal_mm_s2: float | None = None
    axis_velocity_mm_s: PerAxis | None = None
    axis_acceleration_mm_s2: PerAxis | None = None
    axis_jerk_mm_s3: PerAxis | None = None
    volts: float | None = None
    zones: tuple[FeedZone, ...] = ()
    reserve: float = LEAST_RESERVE


@dataclass(frozen=True)
class LimitUsage:
    """The peak of a limited quantity: value, limit, arc length of the place."""

    value: float
    limit: float
    at_mm: float

    @property
    def ratio(self) -> float:
        """Value over limit: 1 is the limit itself."""
        return self.value / self.limit


@dataclass(frozen=True, eq=False)
class PathMotion:
    """The motion at given times. Along the path (…): arc length, feed and its derivatives. Of the axes (…, A): position
    and its derivatives; a path in the plane has z = 0 on a machine with three path axes.
    """

    t_s: Real
    arc_length_mm: Real
    feed_mm_s: Real
    feed_acceleration_mm_s2: Real
    feed_jerk_mm_s3: Real
    position_mm: Real
    velocity_mm_s: Real
    acceleration_mm_s2: Real
    jerk_mm_s3: Real


@dataclass(frozen=True, eq=False)
class Path:
    """A smooth path: a C2 PH quintic spline in the plane (A = 2) or in space (A = 3), with exact arc length.

    Made by `through`, `polygon` or `load_path`. Methods by arc length take numbers or arrays of any shape, 0 …
    `length_mm`, and raise InputError outside.

    >>> path = Path.through([[0, 0], [20, 0], [35, 10], [35, 30]])
    >>> round(path.length_mm, 3)
    59.685
    >>> path.point_mm([0.0, path.length_mm]).round(6)
    array([[ 0.,  0.],
           [35., 30.]])
    """

    _file: PathFile
    _curve: PHSpline | SpatialPHSpline = field(repr=False)
    notes: tuple[str, ...] = ()
    """Notes on how the spline was made, one line each."""
    _fitted: FittedPath | None = field(default=None, repr=False)
    """Of a toolpath."""

    @classmethod
    def through(
        cls,
        points_mm: ArrayLike,
        *,
        closed: bool = False,
        ends: Literal["cubic", "natural"] = "cubic",
        start_tangent: ArrayLike | None = None,
        end_tangent: ArrayLike | None = None,
        knots: Literal["chord", "centripetal", "uniform"] = "chord",
        name: str = "path",
    ) -> Path:
        """The path through points (n, A): x, y, or x, y, z, or these and up to three extra axes; rotary axes in
        degrees. If x, y and z are the same at all points, rotary axes move alone: they draw the path, and its lengths
        and feeds are in degrees.

        closed         the end is the start; each point is given once, 3 or more
        ends           of an open path: "cubic", or "natural" (no curvature)
        start_tangent, end_tangent   direction (2,), in space (3,), there, instead of `ends`
        knots          parameter lengths of the spans: "chord" (the distances of the points), "centripetal" (their
                       square roots), or "uniform"
        name           for messages and for the program

        Raises InputError, and PlanError where there is no such path.
        """
        points = _points(points_mm)
        return _path(points, True, closed, ends, start_tangent, end_tangent, knots, name)

    @classmethod
    def polygon(cls, points_mm: ArrayLike, *, closed: bool = False, name: str = "path") -> Path:
        """The path of a control polygon (n, A) of a cubic B-spline; open from 4 points on, closed from 3 on.

        Raises InputError, and PlanError where there is no such path.

        >>> Path.polygon([[0, 0], [40, 0], [40, 40], [0, 40]], closed=True).closed
        True
        """
        points = _points(points_mm)
        return _path(points, False, closed, "cubic", None, None, "chord", name)

    @property
    def name(self) -> str:
        """Name of the path."""
        return self._file.name

    @property
    def closed(self) -> bool:
        """Whether the end is the start."""
        return self._curve.closed

    @property
    def axes(self) -> int:
        """A: 2 in the plane, 3 in space, 4 to 6 with extra axes; where rotary axes move alone, those that draw the
        path.
        """
        return int(self.node_points_mm.shape[1])

    @property
    def length_mm(self) -> float:
        """Arc length of the whole."""
        return self._curve.length_mm

    @property
    def node_points_mm(self) -> Real:
        """Joints of the N segments, (N + 1, A), from start to end."""
        return self._curve.axes_nodes

    @property
    def node_arc_lengths_mm(self) -> Real:
        """Arc lengths of the joints, (N + 1,)."""
        return np.concatenate(([0.0], np.cumsum(self._curve.segment_lengths_mm)))

    @property
    def greatest_curvature_per_mm(self) -> float:
        """Greatest curvature, at its true extremum."""
        return self._curve.max_curvature_per_mm()

    def point_mm(self, arc_length_mm: ArrayLike) -> Real:
        """Points (…, A)."""
        return self._curve.axes_point(arc_length_mm)

    def tangent(self, arc_length_mm: ArrayLike) -> Real:
        """Unit tangents (…, 2), in space (…, 3)."""
        return coordinates(self._curve.tangent(arc_length_mm))

    def curvature_per_mm(self, arc_length_mm: ArrayLike) -> Real:
        """Curvature (…); in the plane positive where the path turns left."""
        return self._curve.curvature(arc_length_mm)

    def plan(
        self,
        limits: Limits | None = None,
        *,
        machine: Machine | None = None,
        profile: Profile = "optimal",
        nominal_mm_s: float | None = None,
        ramp_time_s: float | None = None,
        n_c: float | Literal["optimise"] = "optimise",
        degree: int = 5,
    ) -> Plan:
        """The feed along this path, from rest to rest.

        limits         in addition to those of the machine, which always apply
        machine        needed for a program, and for limits in volts
        profile        "optimal": least time inside all limits. "quintic", "exponential" and "minimax" accelerate for
                       `ramp_time_s`, run at `nominal_mm_s` and decelerate; the feed is lowered until all limits are
                       kept
        nominal_mm_s   feed; with "optimal" one more limit, which may be left out
        n_c            slope coefficient of "exponential"; "optimise": by pattern search
        degree         of "minimax"

        Raises InputError, and PlanError if the feed is not possible.

        >>> path = Path.through([[0, 0], [20, 0], [35, 10], [35, 30]])
        >>> plan = path.plan(Limits(feed_mm_s=100, acceleration_mm_s2=2000, jerk_mm_s3=50_000))
        >>> round(plan.duration_s, 3)
        0.687
        >>> slower = path.plan(profile="minimax", nominal_mm_s=50, ramp_time_s=0.1)
        >>> round(slower.duration_s, 3)
        1.294
        """
        if profile == OPTIMAL:
            feed = FeedRequest(profile, inf if nominal_mm_s is None else nominal_mm_s)
        elif profile in PROFILES and (nominal_mm_s is None or ramp_time_s is None):
            raise InputError(f'plan: profile "{profile}" needs nominal_mm_s and ramp_time_s')
        else:
            feed = FeedRequest(profile, nominal_mm_s or 0.0, ramp_time_s or 0.0, n_c, degree)
        path = self._file.given_path
        count = path.axes if isinstance(path, SpacePathSpec) else self.axes
        given = FileLimits() if limits is None else _file_limits(limits, count)
        file = replace(self._file, feed=feed, limits=given, machine_file=None)
        on = None if machine is None else machine._file
        if self._fitted is None:
            return Plan(self, machine, pipeline_of(file, on))
        if on is None:
            raise InputError(f"{self.name}: a path of a toolpath needs machine= to be planned")
        return Plan(self, machine, SectionPipeline(file, on, self._fitted))

    def __repr__(self) -> str:
        return f"Path({self.name!r}, {self.length_mm:.6g} mm)"


@dataclass(frozen=True, eq=False)
class Plan:
    """The feed along a path, from rest to rest; made by `Path.plan` or `load_plan`.

    With a machine it is the feed of the program. If a fault stop would take longer than `stop_time_ms` of the machine,
    the path is planned again with a reserve for stops, and `notes` has a line about it. The program is made at the
    first use of a property or method, which raises PlanError if none is possible.

    >>> from hodograph import example_file, load_plan
    >>> plan = load_plan(example_file("alpha"))
    >>> motion = plan.sample(np.linspace(0.0, plan.duration_s, 101))
    >>> motion.position_mm.shape
    (101, 2)
    >>> round(float(motion.feed_mm_s.max()), 3)
    100.0
    """

    path: Path
    machine: Machine | None
    _pipeline: Pipeline = field(repr=False)

    def __post_init__(self) -> None:
        _ = self._pipeline.plan  # errors come here

    @cached_property
    def _feed(self) -> FeedPlan:
        """The plan of the program; without a machine there is none."""
        return self._pipeline.plan if self.machine is None else self._pipeline.compilation.plan

    @property
    def profile(self) -> str:
        """Name of the feed profile."""
        return self._feed.profile

    @property
    def duration_s(self) -> float:
        """Time of the whole."""
        return self._feed.duration_s

    @property
    def feed_mm_s(self) -> float:
        """Greatest feed."""
        return self._feed.feed_mm_s

    @property
    def acceleration_mm_s2(self) -> float:
        """Greatest acceleration along the path."""
        return self._feed.peak_acceleration_mm_s2

    @property
    def jerk_mm_s3(self) -> float:
        """Greatest jerk along the path."""
        return self._feed.peak_jerk_mm_s3

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes, one line each: limits that lowered the feed, ineffective limits."""
        return self._pipeline.notes(self._feed)

    def usage(self) -> dict[str, LimitUsage]:
        """The peak of each limited quantity by its name ("feed_mm_s", "axis.jerk_mm_s3.x")."""
        return {
            name: LimitUsage(peak.value, peak.limit.given, peak.s_mm)
            for name, peak in self._pipeline.peaks_of(self._feed).items()
        }

    def sample(self, t_s: ArrayLike) -> PathMotion:
        """The motion at times 0 … `duration_s`, of any shape. Raises InputError outside."""
        t = np.array(t_s, dtype=np.float64)
        slack = 1e-12 * self.duration_s
        if not ((t >= -slack) & (t <= self.duration_s + slack)).all():
            raise InputError(f"sample: times must be from 0 to {self.duration_s:.9g} s")
        curve, feed = self._pipeline.curve, self._feed
        s = np.clip(feed.arc_length(t), 0.0, curve.length_mm)
        along = feed.feed(t), feed.acceleration(t), feed.jerk(t)
        axes = (np.moveaxis(each, 0, -1) for each in axis_motion(frames(curve, s), *along))
        return PathMotion(t, s, *along, curve.axes_point(s), *axes)

    def program(self) -> Program:
        """The program for the plan's machine, as its controller accepts it.

        Raises InputError without a machine, PlanError if a limit of the controller is not kept.
        """
        if self.machine is None:
            raise InputError(f"{self.path.name}: a program needs a machine: give machine= to plan")
        return Program(self._pipeline.image, self.machine, self._pipeline.standing_mm)

    def __repr__(self) -> str:
        return f"Plan({self.path.name!r}, {self.profile}, {self.duration_s:.6g} s)"


def load_path(file: str | PathLike[str]) -> Path:
    """The path of a path file (TOML), without its feed and limits. Raises InputError and PlanError."""
    return path_of(load_path_file(FilePath(file)))


def path_of(file: PathFile) -> Path:
    """The path that a path file describes."""
    return _path_in(file, pipeline_of(file))


def _path_in(file: PathFile, pipeline: Pipeline) -> Path:
    """The path of a pipeline that was made of a path file."""
    found = pipeline.found_spline
    return Path(file, found.spline, found.notes)


def path_of_section(section: JobSection) -> Path:
    """The path of a section of a job."""
    pipeline = section.pipeline
    return Path(pipeline.file, pipeline.curve, _fitted=section.fitted)


def _path(
    points: Real,
    through: bool,
    closed: bool,
    ends: str,
    start_tangent: ArrayLike | None,
    end_tangent: ArrayLike | None,
    knots: str,
    name: str,
) -> Path:
    """As `PathSpec` and `SpacePathSpec`."""
    tangents = [
        _direction(name, key, value, min(points.shape[1], 3))
        for key, value in (("start_tangent", start_tangent), ("end_tangent", end_tangent))
    ]
    start, end = tangents
    given: PathSpec | SpacePathSpec
    if points.shape[1] > 2:
        drawn, extra = points[:, :3], points[:, 3:]
        given = SpacePathSpec(closed, drawn, through, ends, start, end, knots, extra)
    else:
        plane = points[:, 0] + 1j * points[:, 1]
        given = PathSpec(closed, plane, through, ends, _plane(start), _plane(end), knots)
    return path_of(PathFile(FilePath(name), name, given, None, FileLimits(), None))


def _points(points_mm: ArrayLike) -> Real:
    try:
        points = np.array(points_mm, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError("points: must be numbers, of shape (n, 2) or (n, 3)") from None
    if points.ndim != 2 or not 2 <= points.shape[1] <= len(AXES):
        raise InputError(
            f"points: must have shape (n, 2), (n, 3), or (n, 4) to (n, 6) with extra axes, not {points.shape}"
        )
    return points


def _direction(name: str, key: str, value: ArrayLike | None, axes: int) -> Real | None:
    if value is None:
        return None
    direction = np.array(value, dtype=np.float64)
    if direction.shape != (axes,) or not np.isfinite(direction).all() or not direction.any():
        raise InputError(f"{name}: {key} must be a direction of {axes} numbers, not all 0")
    return direction


def _plane(direction: Real | None) -> complex | None:
    return None if direction is None else complex(direction[0], direction[1])


def load_plan(file: str | PathLike[str], machine: Machine | None = None) -> Plan:
    """The plan of a path file (TOML), from its [path], [feed] and [limits].

    machine   instead of the one that the file names

    Raises InputError and PlanError.
    """
    found = load_path_file(FilePath(file))
    pipeline = pipeline_of(found, None if machine is None else machine._file)
    if machine is None and pipeline.machine_or_none is not None:
        machine = Machine(pipeline.whole_machine)
    return Plan(_path_in(found, pipeline), machine, pipeline)


def _file_limits(limits: Limits, axes: int) -> FileLimits:
    """As a path file gives them."""
    return FileLimits(
        feed_mm_s=limits.feed_mm_s,
        acceleration_mm_s2=limits.acceleration_mm_s2,
        jerk_mm_s3=limits.jerk_mm_s3,
        centripetal_mm_s2=limits.centripetal_mm_s2,
        volts=limits.volts,
        axis=AxisLimits(
            velocity_mm_s=_per_axis("axis_velocity_mm_s", limits.axis_velocity_mm_s, axes),
            acceleration_mm_s2=_per_axis(
                "axis_acceleration_mm_s2", limits.axis_acceleration_mm_s2, axes
            ),
            jerk_mm_s3=_per_axis("axis_jerk_mm_s3", limits.axis_jerk_mm_s3, axes),
        ),
        zones=tuple(FileZone(zone.from_mm, zone.to_mm, zone.feed_mm_s) for zone in limits.zones),
        reserve=limits.reserve,
        names=AXES[:axes],
    )


def _per_axis(name: str, value: PerAxis | None, axes: int) -> tuple[float, ...] | None:
    """One number for each path axis; None: no limit."""
    if value is None:
        return None
    given = (value,) * axes if isinstance(value, (int, float)) else tuple(value)
    if len(given) != axes:
        raise InputError(f"limits: {name} must be one number, or {axes}, one for each path axis")
    return tuple(map(float, given))
