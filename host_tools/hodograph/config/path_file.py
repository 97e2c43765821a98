# SPDX-License-Identifier: MIT
"""Reads path files: the curve, the requested feed, its limits, and the machine to run it on. Used by many modules of
host_tools: the pipeline, jobs, streaming, reports, campaigns. Reads the file that it is given, and the paths that a
list names.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, PlanError
from ..feed import AxisLimits, FeedRequest, FeedZone, Limits
from ..feed.limits import GREATEST_RESERVE, LEAST_RESERVE, POLICIES
from ..feed.request import (
    GREATEST_DEGREE,
    GREATEST_FEED_MM_S,
    GREATEST_N_C,
    GREATEST_RAMP_S,
    LEAST_DEGREE,
    LEAST_FEED_MM_S,
    LEAST_RAMP_S,
    OPTIMAL,
    PROFILES,
)
from ..names import AXES, in_unit, is_toolpath
from ..spline import END_NAMES, KNOT_NAMES
from .outputs import PATH_OUTPUT, PathOutput, read_path_outputs
from .table import Table, read_toml

COORDINATE_LIMIT_MM = 4096.0

_CLOSING = 1e-3
"""Points nearer than this share of the median distance of points close a path."""
_SAME_MM = 1e-9
"""Points nearer than this are the same."""


@dataclass(frozen=True, eq=False)
class PathSpec:
    """Points (n,) as x + iy in mm, of a control polygon or to go through, the end conditions and knots."""

    closed: bool
    points: NDArray[np.complex128]
    through: bool
    ends: str
    start_tangent: complex | None
    end_tangent: complex | None
    knots: str


@dataclass(frozen=True, eq=False)
class SpacePathSpec:
    """As PathSpec, in space: points (n, 3) in mm, and directions (3,).

    extra  (n, E): the extra axes at the points, in mm; rotary axes in degrees
    """

    closed: bool
    points: NDArray[np.float64]
    through: bool
    ends: str
    start_tangent: NDArray[np.float64] | None
    end_tangent: NDArray[np.float64] | None
    knots: str
    extra: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def axes(self) -> int:
        """3, and the extra axes."""
        return 3 + int(self.extra.shape[1])

    @property
    def turns_alone(self) -> bool:
        """Whether rotary axes move while x, y and z stand: the unit of length is then the degree."""
        return bool(np.ptp(self.extra, axis=0).any()) and not np.ptp(self.points, axis=0).any()


@dataclass(frozen=True, eq=False)
class PathFile:
    """The contents of a path file. `feed` and `machine_file` are None when it has none."""

    file: Path
    name: str
    given_path: PathSpec | SpacePathSpec
    feed: FeedRequest | None
    limits: Limits
    machine_file: Path | None
    outputs: tuple[PathOutput, ...] = ()

    @property
    def turns_alone(self) -> bool:
        """As `SpacePathSpec.turns_alone`."""
        return isinstance(self.given_path, SpacePathSpec) and self.given_path.turns_alone

    @property
    def path(self) -> PathSpec:
        """The path in the plane; raises PlanError as `require_planar`."""
        return self.require_planar()

    def require_planar(self) -> PathSpec:
        """The path in the plane, for callers that support the plane only. Raises PlanError: the path is in space."""
        if isinstance(self.given_path, SpacePathSpec):
            raise PlanError(
                f"{self.file}: [path] has points [x, y, z]: this command takes a path in the plane; "
                "give points [x, y]"
            )
        return self.given_path


@dataclass(frozen=True, eq=False)
class ListedPath:
    """One of the paths of a file, and the rest before it.

    dwell_ms  standstill
    stop      one of STOPS
    """

    file: PathFile
    dwell_ms: int = 0
    stop: str = "none"


STOPS = ("none", "program", "optional")
LONGEST_DWELL_MS = 86_400_000
_RESTS = ("dwell_ms", "stop")
_OWN = ("feed", "limits")
"""Sections that a path of a list may have in place of those of the file."""
_SECTIONS = ("path", "feed", "limits", "machine", "output")
_PATH = ("closed", "control_points", "through", "ends", "start_tangent", "end_tangent", "knots")
_FEED = ("profile", "nominal_mm_s", "nominal_deg_s", "ramp_time_s", "n_c", "degree")
_LIMITS = (
    "feed_mm_s",
    "acceleration_mm_s2",
    "jerk_mm_s3",
    "feed_deg_s",
    "acceleration_deg_s2",
    "jerk_deg_s3",
    "centripetal_mm_s2",
    "volts",
    "policy",
    "reserve",
    "axis",
    "cap",
)
_AXIS_LIMITS = ("velocity_mm_s", "acceleration_mm_s2", "jerk_mm_s3")
_CAP = ("from_mm", "to_mm", "feed_mm_s")
_FEEDS, _ACCELERATIONS, _JERKS = (
    {"low": 0.001, "high": 1e5},
    {"low": 0.01, "high": 1e9},
    {"low": 0.1, "high": 1e12},
)


def load_path_file(file: Path) -> PathFile:
    """The path file `file`; raises InputError. Its machine file is not read."""
    if is_toolpath(file):
        raise InputError(
            f"{file}: is a toolpath, which only import, simulate, verify, report, compile, run and stream take: "
            f"hodograph run {file}, or give a path file"
        )
    root = Table(file, "", read_toml(file), _SECTIONS)
    if root.is_list("path"):
        raise root.error(
            "path",
            "is a list of paths, which is a job: only stream takes it, and run as its one file",
        )
    return _path_file(root, root.table("path", _PATH), root)


def is_list_of_paths(file: Path) -> bool:
    """Whether a path file has [[path]] in place of [path]. Raises InputError."""
    return Table(file, "", read_toml(file), _SECTIONS).is_list("path")


def load_paths(file: Path) -> tuple[ListedPath, ...]:
    """The paths of a path file, in order: of [path] the one, of [[path]] all. Raises InputError."""
    root = Table(file, "", {} if is_toolpath(file) else read_toml(file), _SECTIONS)
    if not root.is_list("path"):
        return (ListedPath(load_path_file(file)),)
    tables = root.tables("path", (*_PATH, *_RESTS, "output", *_OWN))
    if root.has("output"):
        raise root.error(
            "output", "applies to files with one [path]: put [[path.output]] after its [[path]]"
        )
    found = tuple(_listed(root, table, i) for i, table in enumerate(tables, 1))
    kinds = [type(one.file.given_path) for one in found]
    other = next((number for number, kind in enumerate(kinds, 1) if kind is not kinds[0]), None)
    if other is not None:
        raise root.error(
            "path",
            f"has points [x, y] and points [x, y, z]: [path {other}] differs from [path 1], give all of one kind",
        )
    for key in _RESTS:
        if tables[0].has(key):
            raise tables[0].error(
                key, "is about the rest between two paths: the first path has none"
            )
    return found


def _listed(root: Table, table: Table, number: int) -> ListedPath:
    dwell_ms = table.integer("dwell_ms", 0, low=0, high=LONGEST_DWELL_MS)
    file = _path_file(root, table, table, number)
    return ListedPath(file, dwell_ms, table.choice("stop", STOPS, STOPS[0]))


def _path_file(root: Table, table: Table, outputs: Table, number: int | None = None) -> PathFile:
    """A path of a file, with its outputs in the table `outputs`; of a list of paths the one with this number."""
    file = root.file
    machine = root.table("machine", ("file",), required=False)
    path = _path(table)
    unit = "deg" if isinstance(path, SpacePathSpec) and path.turns_alone else "mm"
    lengths = _Lengths(unit, number)
    with_feed, with_limits = (table if table.has(key) else root for key in _OWN)
    feed = _feed(with_feed.table("feed", _FEED), lengths) if with_feed.has("feed") else None
    axes = path.axes if isinstance(path, SpacePathSpec) else 2
    limits = _limits(with_limits.table("limits", _LIMITS, required=False), axes, lengths)
    return PathFile(
        file=file,
        name=file.stem,
        given_path=path,
        feed=feed,
        limits=limits,
        machine_file=machine.path("file") if machine.has("file") else None,
        outputs=read_path_outputs(
            outputs.tables("output", PATH_OUTPUT, required=False),
            f"{file}: [[output]]" if number is None else f"{file}: path {number}: [[path.output]]",
            len(path.points) if path.through else None,
        ),
    )


def _path(table: Table) -> PathSpec | SpacePathSpec:
    through = table.has("through")
    if through and table.has("control_points"):
        raise table.error("through", "is given together with control_points: keep one of the two")
    if not through and not table.has("control_points"):
        raise table.error("control_points", "is missing: add it, or through = [[x, y], ...]")
    closed = table.flag("closed")
    for key in ("ends", "start_tangent", "end_tangent"):
        if table.has(key) and (closed or not through):
            raise table.error(key, "applies to open paths with through points only: remove it")
    if table.has("knots") and not through:
        raise table.error("knots", "applies to through points only: remove it")
    key = "through" if through else "control_points"
    points = table.points(key, limit=COORDINATE_LIMIT_MM)
    if closed:
        rests = not np.ptp(points[:, :3], axis=0).any()
        _check_closing(table, key, points[:, 3:] if rests else points[:, :3])
    ends = table.choice("ends", END_NAMES, END_NAMES[0])
    knots = table.choice("knots", KNOT_NAMES, KNOT_NAMES[0])
    if points.shape[1] > 2:
        start, end = _direction(table, "start_tangent"), _direction(table, "end_tangent")
        drawn, extra = points[:, :3], points[:, 3:]
        path = SpacePathSpec(closed, drawn, through, ends, start, end, knots, extra)
        for name in ("start_tangent", "end_tangent"):
            if path.turns_alone and table.has(name):
                raise table.error(
                    name, "is a direction of x, y and z, which rest on this path: remove it"
                )
        return path
    return PathSpec(
        closed=closed,
        points=np.asarray(points[:, 0] + 1j * points[:, 1]),
        through=through,
        ends=ends,
        start_tangent=_tangent(table, "start_tangent"),
        end_tangent=_tangent(table, "end_tangent"),
        knots=knots,
    )


def _check_closing(table: Table, key: str, points: NDArray[np.float64]) -> None:
    """Refuses the last points of a closed path if they nearly repeat the first ones.

    That is: the last point, or two of the last three, are within `_CLOSING` of the median distance between consecutive
    points. The spline drops exact repeats.
    """
    count = points.shape[0]
    legs = np.linalg.norm(np.diff(points, axis=0), axis=1)
    near = _CLOSING * float(np.median(legs)) if count > 1 else 0.0
    for tail in (1, 3):
        if count < tail + 3:
            return
        misses = np.linalg.norm(points[-tail:] - points[:tail], axis=1)
        worst = int(np.argmax(misses))
        agree = np.count_nonzero(misses <= near)
        if misses[worst] > _SAME_MM and 2 * agree > tail:
            raise table.error(
                key,
                f"do not close: point {count - tail + worst} is {misses[worst]:.6g} mm away from "
                f"point {worst}, which it seems to repeat: give each point once, or repeat it exactly",
            )


def _tangent(table: Table, key: str) -> complex | None:
    if not table.has(key):
        return None
    value = complex(*table.pair(key, low=-1e9, high=1e9))
    if value == 0:
        raise table.error(key, "must not be [0, 0]: give a direction")
    return value


def _direction(table: Table, key: str) -> NDArray[np.float64] | None:
    if not table.has(key):
        return None
    vector = np.array(table.triple(key, low=-1e9, high=1e9))
    if not vector.any():
        raise table.error(key, "must not be [0, 0, 0]: give a direction")
    return vector


@dataclass(frozen=True)
class _Lengths:
    """The unit of lengths of a path, "mm" or "deg", and its number in a list; None: the file has one path."""

    unit: str
    number: int | None

    def key(self, table: Table, key: str) -> str:
        """The key in this unit. Raises InputError: the table has it in the other one."""
        own, other = in_unit(key, self.unit), in_unit(key, "mm" if self.unit == "deg" else "deg")
        if table.has(other):
            raise table.error(
                other, f"does not apply to {self._path}: give {own}{self._place(table)}"
            )
        return own

    def refuse(self, table: Table, key: str) -> None:
        """Raises InputError: the table has a key that this path cannot have."""
        if table.has(key):
            remedy = self._place(table) and f": give other limits{self._place(table)}"
            raise table.error(key, f"does not apply to {self._path}{remedy or ': remove it'}")

    @property
    def _path(self) -> str:
        moved = "moves rotary axes alone" if self.unit == "deg" else "moves x, y or z"
        return (
            f"a path that {moved}" if self.number is None else f"path {self.number}, which {moved}"
        )

    def _place(self, table: Table) -> str:
        """The place for keys of a path of a list, for messages; "": they are there already, or there is no list."""
        if self.number is None or table.section not in _OWN:
            return ""
        return f" in [path.{table.section}] after its [[path]]"


def _feed(table: Table, lengths: _Lengths) -> FeedRequest:
    profile = table.choice("profile", PROFILES, "exponential")
    feeds = {"low": LEAST_FEED_MM_S, "high": GREATEST_FEED_MM_S}
    nominal = lengths.key(table, "nominal_mm_s")
    if profile == OPTIMAL:
        nominal_mm_s = table.optional_number(nominal, **feeds)
        return FeedRequest(profile, inf if nominal_mm_s is None else nominal_mm_s)
    return FeedRequest(
        profile=profile,
        nominal_mm_s=table.number(nominal, **feeds),
        ramp_time_s=table.number("ramp_time_s", low=LEAST_RAMP_S, high=GREATEST_RAMP_S),
        n_c=_n_c(table),
        degree=table.integer("degree", 5, low=LEAST_DEGREE, high=GREATEST_DEGREE),
    )


def _n_c(table: Table) -> float | Literal["optimise"]:
    if table.is_text("n_c") or not table.has("n_c"):
        table.choice("n_c", ("optimise",), "optimise")
        return "optimise"
    return table.number("n_c", low=0, high=GREATEST_N_C)


def _limits(table: Table, axes: int, lengths: _Lengths) -> Limits:
    feed, acceleration, jerk = (
        lengths.key(table, key) for key in ("feed_mm_s", "acceleration_mm_s2", "jerk_mm_s3")
    )
    for key in ("centripetal_mm_s2", "cap") if lengths.unit == "deg" else ():
        lengths.refuse(table, key)
    return Limits(
        feed_mm_s=table.optional_number(feed, **_FEEDS),
        acceleration_mm_s2=table.optional_number(acceleration, **_ACCELERATIONS),
        jerk_mm_s3=table.optional_number(jerk, **_JERKS),
        policy=table.choice("policy", POLICIES, "respect"),
        centripetal_mm_s2=table.optional_number("centripetal_mm_s2", **_ACCELERATIONS),
        volts=table.optional_number("volts", low=1e-3, high=1e3),
        axis=_axis_limits(table.table("axis", _AXIS_LIMITS, required=False), axes),
        names=AXES[:axes],
        reserve=table.number("reserve", Limits.reserve, low=LEAST_RESERVE, high=GREATEST_RESERVE),
        zones=tuple(_zone(one) for one in table.tables("cap", _CAP, required=False)),
    )


def _axis_limits(table: Table, axes: int) -> AxisLimits:
    return AxisLimits(
        velocity_mm_s=table.optional_per_axis("velocity_mm_s", axes, **_FEEDS),
        acceleration_mm_s2=table.optional_per_axis("acceleration_mm_s2", axes, **_ACCELERATIONS),
        jerk_mm_s3=table.optional_per_axis("jerk_mm_s3", axes, **_JERKS),
    )


def _zone(table: Table) -> FeedZone:
    from_mm, to_mm = (table.number(key, low=0.0, high=1e7) for key in ("from_mm", "to_mm"))
    if not from_mm < to_mm:
        raise table.error("from_mm", f"is {from_mm:g}: must be below to_mm = {to_mm:g}")
    return FeedZone(from_mm, to_mm, table.number("feed_mm_s", **_FEEDS))
