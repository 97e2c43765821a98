# SPDX-License-Identifier: MIT
"""Tunes a machine: from the requested properties to gains, feedforward and their results. Used by cli/tune_command.
Runs simulations in this process; reads the files of a path by `pipeline`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from ..config import Machine
from ..config.axis_table import Axis, Feedforward
from ..config.drive_file import Drive
from ..errors import PlanError
from ..pipeline import Pipeline
from .cases import CASES, Drives, Forward, Outcome, outcomes
from .design import Poles, feedforward_of, pole_for_stiffness, stiffness_n_um, with_poles
from .loop import loop_of, margins
from .result import AxisResult, CaseResult, PathResult, Side, Tuning
from .search import Wanted, best_poles

_GAINS = ("k_pp_rad_s_mm", "k_pv_nm_s_rad", "k_iv_per_s")
"""The gains that decide whether a loop is stable."""
_HALVINGS, _REFINED = 40, 10
"""Steps of the search for a stable gain."""
_OF_STABLE = 0.97
"""Share of the greatest stable gain found that is reported; the rounding to two digits stays below the gain."""
DIGITS = 6
"""Significant digits of the gains; the rounded gains are evaluated and written."""


@dataclass(frozen=True)
class Asked:
    """The requested properties of the loops. Without `bandwidth_hz` the goal is the least contour error on the paths.

    `interpolation` None keeps that of the drive files.
    """

    bandwidth_hz: float | None = None
    damping: float = 1.0
    stiffness_n_um: float | None = None
    interpolation: str | None = None
    velocity: str = "drive"
    wanted: Wanted = field(default_factory=Wanted)


def tune(
    machine: Machine,
    pipelines: Sequence[Pipeline],
    asked: Asked,
    progress: Callable[[int], None] = lambda done: None,
) -> Tuning:
    """Gains for both axes of the plane, with the same poles, so that both lag alike.

    Raises PlanError: not possible. Raises InputError: there is no model, or a path is wrong.
    """
    x, y = machine.models(machine.require_plane("tune"))
    given: Drives = (x, y)
    before = [_given(axis) for axis in machine.require_plane("tune")]
    drives = (_interpolated(x, asked), _interpolated(y, asked))
    programs = [(pipeline.image, machine.counts_per_mm) for pipeline in pipelines]
    tried = 0
    if asked.bandwidth_hz is None:
        poles, all_tried = best_poles(drives, programs, asked.wanted, asked.velocity, progress)
        tried = len(all_tried)
    else:
        natural = 2 * math.pi * asked.bandwidth_hz
        real = pole_for_stiffness(drives, natural, asked.damping, asked.stiffness_n_um)
        poles = Poles(natural, asked.damping, real)
    sides = [_side(*_tuned(drive, poles, asked.velocity)) for drive in drives]
    axes = [
        AxisResult(axis.name, old, new)
        for axis, old, new in zip(machine.require_plane("tune"), before, sides, strict=True)
    ]
    result = Tuning(machine, poles, (axes[0], axes[1]), (), tried)
    return replace(result, paths=tuple(_path(pipeline, result, given) for pipeline in pipelines))


def _interpolated(drive: Drive, asked: Asked) -> Drive:
    return replace(drive, interpolation=asked.interpolation or drive.interpolation)


def _tuned(drive: Drive, poles: Poles, velocity: str) -> tuple[Drive, Feedforward]:
    found, forward = feedforward_of(with_poles(drive, poles), velocity)
    found = replace(
        found,
        k_pp_rad_s_mm=_rounded(found.k_pp_rad_s_mm),
        k_pv_nm_s_rad=_rounded(found.k_pv_nm_s_rad),
        k_iv_per_s=_rounded(found.k_iv_per_s),
        k_pf_rad_mm=_rounded(found.k_pf_rad_mm),
    )
    return found, replace(
        forward,
        torque_permille_s2_m=_rounded(forward.torque_permille_s2_m),
        torque_permille_s_m=_rounded(forward.torque_permille_s_m),
    )


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


def _given(axis: Axis) -> Side:
    """The axis as in the files."""
    assert axis.drive is not None
    if not loop_of(axis.drive).stable:
        raise PlanError(_unstable_text(axis.name, axis.drive))
    return _side(axis.drive, axis.feedforward)


def _unstable_text(axis: str, drive: Drive) -> str:
    """The refusal of gains with which a loop is not stable: each value, and which of them alone can be lowered."""
    gains = ", ".join(f"{name} = {getattr(drive, name):g}" for name in _GAINS)
    stable = {name: _stable_below(drive, name) for name in _GAINS}
    lower = " or ".join(f"{name} to {value:g}" for name, value in stable.items() if value)
    remedy = f"lower {lower} there" if lower else "set all three to those of a stable loop there"
    return f"axis {axis}: the loop is not stable with {gains} in its drive file: {remedy}"


def _stable_below(drive: Drive, name: str) -> float:
    """A value of one gain, below its own, with which the loop is stable; 0: none was found."""
    low, high = getattr(drive, name), getattr(drive, name)
    for _ in range(_HALVINGS):
        low, high = 0.5 * low, low
        if loop_of(_with_gain(drive, name, low)).stable:
            break
    else:
        return 0.0
    for _ in range(_REFINED):
        middle = 0.5 * (low + high)
        stable = loop_of(_with_gain(drive, name, middle)).stable
        low, high = (middle, high) if stable else (low, middle)
    shown = float(f"{_OF_STABLE * low:.2g}")
    return shown if loop_of(_with_gain(drive, name, shown)).stable else low


def _with_gain(drive: Drive, name: str, value: float) -> Drive:
    changed: dict[str, Any] = {name: value}
    return replace(drive, **changed)


def _side(drive: Drive, forward: Feedforward) -> Side:
    loop = loop_of(drive)
    if not loop.stable:
        raise PlanError(
            f"k_pp {drive.k_pp_rad_s_mm:g}, k_pv {drive.k_pv_nm_s_rad:g}, k_iv {drive.k_iv_per_s:g}: the loop is not "
            f"stable at {drive.loop_rate_hz} samples a second: ask for less bandwidth"
        )
    return Side(drive, forward, margins(loop), stiffness_n_um(drive))


def _path(pipeline: Pipeline, tuning: Tuning, given: Drives) -> PathResult:
    machine, image = tuning.machine, pipeline.image

    def runs(drives: Drives, forward: Forward) -> list[Outcome]:
        return outcomes(image, machine.counts_per_mm, drives, forward)

    columns = zip(
        CASES,
        runs(given, machine.plane_feedforward),
        runs(tuning.drives, None),
        runs(tuning.drives, tuning.feedforward),
        strict=True,
    )
    return PathResult(pipeline.file.name, image, tuple(CaseResult(*row) for row in columns))
