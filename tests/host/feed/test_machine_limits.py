# SPDX-License-Identifier: MIT
"""Each plan keeps the limits of a machine's axes, also if the path file has higher ones. Run by pytest; writes to
temporary folders.
"""

from __future__ import annotations

from dataclasses import replace
from math import isfinite
from pathlib import Path

import numpy as np
import pytest

from hodograph.config import Machine, load_machine, load_path_file
from hodograph.errors import PlanError
from hodograph.feed import AxisLimits, Limits
from hodograph.feed.limits import MACHINE_SHARE
from hodograph.native.program import NativeFault, NativeLimits, NativeProgram
from hodograph.pipeline import Pipeline
from hodograph.program import StopTerms
from hodograph.verify import verify_program

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
NEAR = "[[0, 0], [10, 0], [10.000001, 0], [20, 5]]"
FEEDS = {
    "quintic": 'profile = "quintic"\nnominal_mm_s = 100\nramp_time_s = 0.1\n',
    "optimal": 'profile = "optimal"\n',
}
QUANTITIES = [
    f"{axis}_{name}"
    for axis in "xy"
    for name in ("velocity_mm_s", "acceleration_mm_s2", "jerk_mm_s3")
]


def machine(**limits: float) -> Machine:
    """That of the alpha, with other limits of its axes."""
    found = load_machine(EXAMPLES / "machines" / "paper_alpha.toml")
    return replace(found, axes=tuple(replace(axis, **limits) for axis in found.axes))


class QuickStops(Pipeline):
    """Stops are searched with few trials: the test is about limits of the motion."""

    @property
    def stop_terms(self) -> StopTerms:
        return replace(super().stop_terms, quick=True)


def pipeline(folder: Path, points: str, profile: str, policy: str, on: Machine) -> Pipeline:
    file = folder / "path.toml"
    limits = f'[limits]\npolicy = "{policy}"\n'
    file.write_text(
        f'[path]\nclosed = false\nthrough = {points}\nknots = "uniform"\n[feed]\n{FEEDS[profile]}{limits}'
    )
    return QuickStops(load_path_file(file), on)


@pytest.mark.parametrize("policy", ["respect", "report"])
@pytest.mark.parametrize("profile", FEEDS)
def test_two_points_nearly_equal(tmp_path: Path, profile: str, policy: str) -> None:
    on = machine()
    made = pipeline(tmp_path, NEAR, profile, policy, on)
    found = verify_program(
        made.program,
        Limits(machine=made.limits.machine),
        [a.drive for a in on.path_axes if a.drive],
    )
    peaks = {peak.quantity: peak for peak in found.peaks}
    for name in QUANTITIES:
        assert isfinite(peaks[name].limit.value)
        assert peaks[name].within(0.0), name
    assert peaks["x_volts"].value <= 5.0
    assert peaks["y_volts"].value <= 5.0
    if profile == "quintic":
        assert any("machine axis x jerk_mm_s3 = 200000" in note for note in made.notes(made.plan))


@pytest.mark.parametrize(
    ("name", "stop_time_ms"),
    [
        ("velocity_mm_s", 250),
        ("acceleration_mm_s2", 500),  # a slow machine: it takes this long to stop
        ("jerk_mm_s3", 1000),
    ],
)
@pytest.mark.parametrize("profile", FEEDS)
def test_each_limit_binds(tmp_path: Path, profile: str, name: str, stop_time_ms: int) -> None:
    """A tenth of what the plan would use otherwise: then that is what it uses, nearly in full."""
    points = "[[0, 0], [10, 3], [20, -4], [35, 5]]"
    free = pipeline(tmp_path, points, profile, "respect", machine())
    peaks = {p.quantity: p for p in verify_program(free.program, free.limits).peaks}
    limit = 0.1 * max(peaks[f"{axis}_{name}"].value for axis in "xy")
    slow = replace(machine(**{name: limit}), stop_time_ms=stop_time_ms)
    made = pipeline(tmp_path, points, profile, "respect", slow)
    found = {p.quantity: p for p in verify_program(made.program, made.limits).peaks}
    used = max(found[f"{axis}_{name}"].value for axis in "xy")
    assert 0.9 * limit < used <= limit


def planned_beyond(monkeypatch: pytest.MonkeyPatch, share: float) -> None:
    """Plans use so much of the machine's limits: the controller has to refuse them above 1."""
    monkeypatch.setattr("hodograph.feed.limits.MACHINE_SHARE", share)


@pytest.mark.parametrize("profile", FEEDS)
@pytest.mark.parametrize(("share", "attempts"), [(1.001, 2), (1.005, 3)])
def test_a_plan_that_is_refused_is_planned_again_with_more_room(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, profile: str, share: float, attempts: int
) -> None:
    planned_beyond(monkeypatch, share)
    # A plan that uses a tenth of the usual jerk fully leaves no room for a brake until it is past the bend.
    slow = replace(machine(jerk_mm_s3=20000.0), stop_time_ms=1000)
    made = pipeline(tmp_path, NEAR, profile, "respect", slow)
    verdicts: list[NativeFault | None] = []
    check = NativeProgram.check

    def kept(self: NativeProgram, limits: NativeLimits | None = None) -> NativeFault | None:
        verdicts.append(check(self, limits))
        return verdicts[-1]

    monkeypatch.setattr(NativeProgram, "check", kept)
    assert made.image
    assert [verdict is None for verdict in verdicts] == [False] * (attempts - 1) + [True]
    assert made.compilation.plan.duration_s > made.plan.duration_s


def test_a_plan_that_stays_refused_is_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    planned_beyond(monkeypatch, 1.05)
    made = pipeline(tmp_path, NEAR, "quintic", "respect", machine(jerk_mm_s3=20000.0))
    with pytest.raises(PlanError, match=r"would refuse the program: above the jerk limit"):
        _ = made.image


def test_a_curve_that_no_feed_can_follow_is_named_with_place_and_curvature(tmp_path: Path) -> None:
    on = machine(jerk_mm_s3=1.0, acceleration_mm_s2=0.1, velocity_mm_s=0.01)
    with pytest.raises(
        PlanError,
        match=r"keeps .* at [\d.]+ mm, where the curvature is .* 1/mm \(radius .* mm\): raise",
    ):
        _ = pipeline(tmp_path, NEAR, "quintic", "respect", on).plan


def test_the_lower_limit_counts() -> None:
    path = AxisLimits(velocity_mm_s=(10.0, 30.0), jerk_mm_s3=(5.0, 5.0))
    both = path.and_of(AxisLimits(velocity_mm_s=(20.0, 20.0), acceleration_mm_s2=(1.0, 2.0)))
    assert both == AxisLimits((10.0, 20.0), (1.0, 2.0), (5.0, 5.0))
    limits = Limits(axis=path, machine=AxisLimits(velocity_mm_s=(20.0, 20.0)))
    assert limits.source("velocity_mm_s", 0) == "limits"
    assert limits.source("velocity_mm_s", 1) == "machine"
    assert np.allclose(limits.axes.velocity_mm_s, (10.0, 20.0 * MACHINE_SHARE))
