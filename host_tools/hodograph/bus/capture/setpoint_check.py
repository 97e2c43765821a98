# SPDX-License-Identifier: MIT
"""The setpoint step check: each setpoint step in a recording has to keep the controller's limits. Used by all modules
that record or analyse setpoints. No I/O.

It checks the targets that a drive executes: a target after another one, both sent with controlword bits 0 to 3 set, to
a drive that has reported Operation enabled. (Before that, targets follow the axis. During homing, with controlword bit
4, drives ignore them.) With T the period, d = r_k - r_(k-1) the step of the plane's axes in counts:

speed         |d| <= v T. A chord is never longer than its arc, so only rounding is added: half a count a
              coordinate at either end, at most sqrt(2) counts, and as much for the kernel's own error.
acceleration  | |d_k| - |d_(k-1)| | <= a T^2: the second difference of arc length is a mean of F'' over two
              periods, and F'' is within the limit. Rounding counts twice. A chord is shorter than its arc by
              s theta^2 / 24 (theta: the turn of the path within the step), so where the path turns, that much
              is added for both; theta counts up to half a radian, so that a step aside is not excused by its own turn.
turn          |d_k - d_(k-1)| <= sqrt(a^2 + n^2) T^2, where the program's greatest normal acceleration n is known. It
              holds for each axis, so it is checked too while only some of the path's drives follow.
axis          Of each axis by itself, as far as the limits of the machine's axes are known: the first, second and third
              difference are means of velocity, acceleration and jerk over one to three periods, so at most v T, a T^2
              and j T^3. Rounding adds 1, 2 and 4 counts, and as much for the kernel's own error. Acceleration and jerk
              may be 1 % above: the controller lets joints of a program step by 0.5 % of them
              (docs/guides/limits.md), and
              a difference may reach over two. A recording that begins in motion shows no jerk before its third step.

If a SYNC passed without a setpoint, the drive stood at its target, and it executes the next setpoint within one period.
If a SYNC is missing, the drive stood too, and executes the last of the setpoints that came: their steps together are
the step of one period. A single garbled statusword does not hide a drive that follows. Three axes draw a path in space,
with sqrt(3) in place of sqrt(2). Axes that do not draw the path are checked one by one by their own limits; axes that
hold their position also for speed and acceleration.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...errors import RunError
from .decode import RPDO1, SYNC_ID, TPDO1
from .gaps import Gaps
from .recorder import Frames

if TYPE_CHECKING:
    from ...config import Machine

SPEED, ACCELERATION, TURN = "speed", "acceleration", "turn"
AXIS_RULES = ("axis speed", "axis acceleration", "axis jerk")
"""By the number of differences less one."""
_DRAWN = (2, 3)
"""Number of axes that draw a path: in the plane, in space."""
_ROUNDING_COUNTS = 2 * math.sqrt(2.0)
"""Least allowance for the rounding of setpoints, in counts; it grows with the number of axes."""
_ENABLED, _HOMING = 0x0F, 0x10
_STATE_MASK, _OPERATION_ENABLED = 0x6F, 0x27
_LARGEST_TURN = 0.5
"""Greatest angle of one step that is taken into account, rad."""
_JOINTS = 1.01
"""Factor on the limits of acceleration and jerk of an axis."""

Float = NDArray[np.float64]
Bool = NDArray[np.bool_]


AxisSteps = tuple[float, float, float]
"""Greatest first, second and third difference of an axis, in counts."""


@dataclass(frozen=True)
class StepLimits:
    """Limits in counts per period and per period squared; infinite: no limit."""

    speed: float
    acceleration: float
    normal: float = math.inf
    axes: tuple[AxisSteps, ...] = ()
    """Limits of each axis; empty: not known."""
    path: int = 2
    """Number of axes that follow a path; at most the first three draw it."""

    def of(self, rule: str, group: tuple[int, ...]) -> float:
        """What a rule allows to this group of axes, which count from 1."""
        if rule in AXIS_RULES:
            axis = group[0] - 1
            return self.axes[axis][AXIS_RULES.index(rule)] if axis < len(self.axes) else math.inf
        holds = len(group) == 1 and group[0] > self.path
        if not holds and len(group) != min(self.path, _DRAWN[-1]):
            return math.inf
        if rule == TURN:
            return math.hypot(self.acceleration, self.normal)
        return self.speed if rule == SPEED else self.acceleration


@dataclass(frozen=True)
class Step:
    """A step by one rule: the found value, and the parts of it for rounding and for the curvature of the path."""

    sync: int
    axes: tuple[int, ...]
    rule: str
    found_counts: float
    aside_counts: float
    group: tuple[int, ...]
    """All axes that the rule checked; `axes` are those of them that followed."""

    @property
    def needed(self) -> float:
        """The least limit that allows the step."""
        return self.found_counts - self.aside_counts

    def jump(self, limits: StepLimits) -> Jump:
        """The message for a step that breaks the limit."""
        allowed = limits.of(self.rule, self.group) + self.aside_counts
        return Jump(self.sync, self.axes, self.rule, self.found_counts, allowed)


@dataclass(frozen=True)
class Jump:
    """A step that breaks a limit: at which SYNC of the recording, of which axes (from 1), by which rule."""

    sync: int
    axes: tuple[int, ...]
    rule: str
    found_counts: float
    allowed_counts: float

    def __str__(self) -> str:
        *before, last = (str(axis) for axis in self.axes)
        names = f"{', '.join(before)} and {last}" if before else last
        return (
            f"setpoint jump at SYNC {self.sync} of the recording, axis {names}: {self.rule} "
            f"{self.found_counts:.1f} counts, allowed {self.allowed_counts:.1f}"
        )


def step_limits(machine: Machine, setpoints: NDArray[np.int32] | None = None) -> StepLimits:
    """The controller's limits; with a program's nominal setpoints also its normal acceleration at 100 % feed."""
    normal = math.inf
    if setpoints is not None:
        second = np.diff(setpoints.astype(np.float64), n=2, axis=0)
        normal = float(np.linalg.norm(second[:, : _DRAWN[-1]], axis=1).max(initial=0.0))
    return limits_at(
        *(machine.feed_mm_s, machine.acceleration_mm_s2, machine.period_us, machine.counts_per_mm),
        normal,
        [(a.velocity_mm_s, a.acceleration_mm_s2, a.jerk_mm_s3) for a in machine.axes],
        [axis.counts_per_unit for axis in machine.axes],
        machine.path_count,
    )


def limits_at(
    feed_mm_s: float,
    acceleration_mm_s2: float,
    period_us: int,
    counts_per_mm: int,
    normal: float = math.inf,
    axes: Sequence[tuple[float, float, float]] = (),
    axis_counts: Sequence[int] = (),
    path: int = 2,
) -> StepLimits:
    """Limits of speed and acceleration along the path and of velocity, acceleration and jerk of each axis, 0: none, in
    the units of steps. `axis_counts`: counts of a unit of each axis; `path`: how many follow the path.
    """
    period_s = period_us * 1e-6
    speed = feed_mm_s * period_s * counts_per_mm
    acceleration = acceleration_mm_s2 * period_s**2 * counts_per_mm
    units = (period_s, _JOINTS * period_s**2, _JOINTS * period_s**3)
    of_axes = [
        [limit * counts * unit or math.inf for limit, unit in zip(axis, units, strict=True)]
        for axis, counts in zip(axes, axis_counts, strict=True)
    ]
    return StepLimits(
        *(speed or math.inf, acceleration or math.inf, normal),
        tuple((v, a, j) for v, a, j in of_axes),
        min(path, len(axes) or path),
    )


class SetpointJumpError(RunError):
    """A setpoint jumps, or frames are missing where it seems to."""


def require_no_jump(frames: Frames, nodes: Sequence[int], limits: StepLimits) -> None:
    """Raises SetpointJumpError with the first step that breaks a limit. If frames are missing beside every such step,
    the error names the first gap: what was on the bus there is not known.
    """
    jumps = find_jumps(frames, nodes, limits)
    if not jumps:
        return
    gaps = Gaps(frames, nodes)
    beside = [gaps.text(jump.sync) for jump in jumps]
    real = [jump for jump, gap in zip(jumps, beside, strict=True) if gap is None]
    if not real:
        raise SetpointJumpError(
            f"frames missing in the recording: {beside[0]}: what the setpoints did there is not known: record again; "
            "if frames are missing again, look for errors on the bus (hodograph status)"
        )
    more = f" ({len(real) - 1} more)" if len(real) > 1 else ""
    raise SetpointJumpError(f"{real[0]}{more}")


def find_jumps(frames: Frames, nodes: Sequence[int], limits: StepLimits) -> list[Jump]:
    """All steps that break a limit, in the order of the recording."""
    jumps = [
        step.jump(limits)
        for measured in _measured(frames, nodes)
        for step in measured.beyond(limits.of(measured.rule, measured.names))
    ]
    return sorted(jumps, key=lambda jump: jump.sync)


def worst_steps(frames: Frames, nodes: Sequence[int], syncs: range) -> list[Step]:
    """For each rule and each group of axes, the step at one of these SYNCs that comes nearest to its limit."""
    steps = (measured.worst(syncs) for measured in _measured(frames, nodes))
    return [step for step in steps if step is not None]


def find_rough_starts(frames: Frames, nodes: Sequence[int], tolerance_counts: int) -> list[str]:
    """Steps of drives that began to follow at a target other than their reported position."""
    found = []
    for node in nodes:
        at, control, target = _setpoints(frames, node)
        follows = _commanded(control) & _enabled(frames, node, at)
        begins = np.flatnonzero(follows[1:] & ~follows[:-1]) + 1
        said = np.flatnonzero((frames["id"] == TPDO1 + node) & (frames["length"] >= 6))
        last = np.searchsorted(said, at[begins]) - 1
        begins, last = begins[last >= 0], last[last >= 0]
        away = np.abs(target[begins] - _integers(frames["data"][said[last]]))
        found += [
            f"node {node} began to follow {away[i]:.0f} counts from where it was"
            for i in np.flatnonzero(away > tolerance_counts)
        ]
    return found


def _setpoints(frames: Frames, node: int) -> tuple[NDArray[np.intp], NDArray[np.uint16], Float]:
    """The setpoints of one node: places in the recording, controlwords, targets."""
    at = np.flatnonzero((frames["id"] == RPDO1 + node) & (frames["length"] >= 6))
    control = np.ascontiguousarray(frames["data"][at, 0:2]).view("<u2")[:, 0]
    return at, control, _integers(frames["data"][at])


def _integers(data: NDArray[np.uint8]) -> Float:
    return np.ascontiguousarray(data[:, 2:6]).view("<i4")[:, 0].astype(np.float64)


@dataclass(frozen=True)
class _Steps:
    """Rows by SYNC, columns by axis: counts; whether the drive followed; whether the step is a guess."""

    counts: Float
    followed: Bool
    guessed: Bool

    def of(self, axes: tuple[int, ...]) -> _Steps:
        return _Steps(self.counts[:, axes], self.followed[:, axes], self.guessed[:, axes])


def _steps(frames: Frames, sync_at: NDArray[np.intp], nodes: Sequence[int]) -> _Steps:
    shape = (sync_at.size, len(nodes))
    steps = _Steps(
        np.zeros(shape), np.zeros(shape, dtype=np.bool_), np.zeros(shape, dtype=np.bool_)
    )
    for axis, node in enumerate(nodes):
        at, control, target = _setpoints(frames[sync_at[0] :], node)
        at += sync_at[0]
        if at.size < 2:
            continue
        sync = np.searchsorted(sync_at, at) - 1
        commanded = _commanded(control)
        follows = commanded & _enabled(frames, node, at)
        valid = follows[1:] & commanded[:-1]
        # Two setpoints for one SYNC: the larger step counts, or both together, which the drive executes in one period.
        steps.followed[sync[1:][valid], axis] = True
        step = np.where(valid, np.diff(target), 0.0)
        larger = np.argsort(np.abs(step), kind="stable")
        counts, together = steps.counts[:, axis], np.zeros(sync_at.size)
        counts[sync[1:][larger]] = step[larger]
        np.add.at(together, sync[1:], step)
        counts[:] = np.where(np.abs(together) > np.abs(counts), together, counts)
        for i in np.flatnonzero(valid & (np.diff(sync) > 1)):
            steps.followed[sync[i] + 1 : sync[i + 1], axis] = True  # it stands
        if valid[0] and follows[0]:  # begun in motion, perhaps: as fast as it goes on
            steps.followed[sync[0], axis], steps.counts[sync[0], axis] = True, step[0]
            steps.guessed[sync[0], axis] = True
    return steps


def _commanded(control: NDArray[np.uint16]) -> Bool:
    """Whether each setpoint commands to follow, outside of homing."""
    enabled = (control & _ENABLED) == _ENABLED
    stretch = np.cumsum(~enabled)
    homing = np.unique(stretch[enabled & ((control & _HOMING) != 0)])
    return np.asarray(enabled & ~np.isin(stretch, homing))


def _enabled(frames: Frames, node: int, at: NDArray[np.intp]) -> Bool:
    """Whether one of the drive's last two words before each of these frames was Operation enabled."""
    said = np.flatnonzero((frames["id"] == TPDO1 + node) & (frames["length"] >= 2))
    if not said.size:
        return np.zeros(at.size, dtype=np.bool_)
    words = np.ascontiguousarray(frames["data"][said, 0:2]).view("<u2")[:, 0]
    enabled = (words & _STATE_MASK) == _OPERATION_ENABLED
    enabled[1:] |= enabled[:-1].copy()
    last = np.searchsorted(said, at) - 1
    return np.asarray((last >= 0) & enabled[last])


@dataclass(frozen=True)
class _Measured:
    """One rule for one group of axes, by SYNC from the second on: the limited value, and its allowance."""

    rule: str
    axes: tuple[int, ...]
    value: Float
    aside: Float
    checked: Bool
    followed: Bool

    @property
    def names(self) -> tuple[int, ...]:
        """The axes, which count from 1."""
        return tuple(axis + 1 for axis in self.axes)

    def step(self, row: int) -> Step:
        names = tuple(axis + 1 for axis, f in zip(self.axes, self.followed[row], strict=True) if f)
        found, aside = float(self.value[row]), float(self.aside[row])
        return Step(row + 1, names, self.rule, found, aside, self.names)

    def beyond(self, limit: float) -> list[Step]:
        over = self.checked & (self.value > limit + self.aside)
        return [self.step(int(row)) for row in np.flatnonzero(over)]

    def worst(self, syncs: range) -> Step | None:
        wanted = self.checked.copy()
        wanted[: max(0, syncs.start - 1)] = False
        wanted[max(0, syncs.stop - 1) :] = False
        if not wanted.any():
            return None
        needed = np.where(wanted, self.value - self.aside, -np.inf)
        return self.step(int(np.argmax(needed)))


def _measured(frames: Frames, nodes: Sequence[int]) -> list[_Measured]:
    sync_at = np.flatnonzero(frames["id"] == SYNC_ID)
    if sync_at.size < 2:
        return []
    steps = _steps(frames, sync_at, nodes)
    groups = [tuple(range(count)) for count in _DRAWN if count <= len(nodes)]
    groups += [(axis,) for axis in range(len(nodes)) if axis >= _DRAWN[0] or len(nodes) == 1]
    rules = [rule for group in groups for rule in _rules(steps.of(group), group)]
    return rules + [
        rule for axis in range(len(nodes)) for rule in _axis_rules(steps.of((axis,)), (axis,))
    ]


def _axis_rules(steps: _Steps, axes: tuple[int]) -> list[_Measured]:
    """The differences of one axis. Before it followed, it stood."""
    counts = np.where(steps.followed, steps.counts, 0.0)[:, 0]
    followed, known = steps.followed[1:], ~steps.guessed[:, 0]
    out = []
    for order, rule in enumerate(AXIS_RULES):
        value = np.zeros(counts.size)
        value[order:] = np.abs(np.diff(counts, n=order))
        checked = followed[:, 0].copy()
        if order == 2:
            checked &= known[1:] & known[:-1]
            checked[1:] &= known[:-2]
        aside = np.full(checked.size, 2.0 * 2.0**order)
        out.append(_Measured(rule, axes, value[1:], aside, checked, followed))
    return out


def _rules(steps: _Steps, axes: tuple[int, ...]) -> list[_Measured]:
    # There is no step before the first followed one: the axis stood.
    followed = steps.followed
    both = followed[1:] & followed[:-1]
    now, before = steps.counts[1:], np.where(both, steps.counts[:-1], 0.0)
    length, length_before = np.linalg.norm(now, axis=1), np.linalg.norm(before, axis=1)
    whole = np.all(followed[1:], axis=1)
    turned = np.minimum(_turn(now, before, length, length_before), _LARGEST_TURN)
    bow = (length + length_before) * turned**2 / 24
    change = np.linalg.norm(now - before, axis=1)
    ones, some = np.ones_like(length), np.any(followed[1:], axis=1)
    rounding = max(_ROUNDING_COUNTS, 2 * math.sqrt(len(axes)))
    once, twice = rounding * ones, 2 * rounding * ones
    return [
        _Measured(SPEED, axes, length, once, some, followed[1:]),
        _Measured(
            *(ACCELERATION, axes, np.abs(length - length_before), twice + bow),
            *(whole, followed[1:]),
        ),
        _Measured(TURN, axes, change, twice, some, followed[1:]),
    ]


def _turn(now: Float, before: Float, length: Float, length_before: Float) -> Float:
    """Angle between a step and the one before; 0 where one of them is too short to have a direction."""
    product = length * length_before
    cosine = np.sum(now * before, axis=1) / np.where(product > 0, product, 1.0)
    angle = np.arccos(np.clip(cosine, -1.0, 1.0))
    return np.where(product > 0, angle, 0.0)
