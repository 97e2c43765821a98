# SPDX-License-Identifier: MIT
"""Peaks against dense samples, limits kept and passed, steps, zones, volts. Run by pytest; starts and writes
nothing.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from programs import random_program

from hodograph.config import load_drive
from hodograph.errors import InputError
from hodograph.feed import AxisLimits, FeedZone, Limits
from hodograph.pipeline import load_pipeline
from hodograph.program import Program
from hodograph.verify import verify_program
from hodograph.verify.cells import cut
from hodograph.verify.instants import motion_at
from hodograph.verify.peaks import GAP
from hodograph.verify.quantities import quantities

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
DRIVES = tuple(load_drive(EXAMPLES / "drives" / f"alpha_{axis}.toml") for axis in "xy")


@pytest.fixture(scope="module")
def alpha() -> Program:
    return load_pipeline(EXAMPLES / "alpha.toml").program


@pytest.mark.parametrize("seed", range(9))
def test_no_sample_is_above_a_peak_and_no_peak_far_above_the_samples(seed: int) -> None:
    program = random_program(seed)
    found = {peak.quantity: peak for peak in verify_program(program, Limits(), DRIVES).peaks}
    cells = cut(program)
    rng = np.random.default_rng(seed)
    u = np.concatenate((np.zeros(len(cells)), np.ones(len(cells)), rng.uniform(0, 1, 200_000)))
    every = np.arange(len(cells))
    cell = np.concatenate((every, every, rng.integers(0, len(cells), 200_000)))
    motion = motion_at(cells, cell, u)
    for row in quantities(cells, Limits(), DRIVES):
        dense = float(np.abs(row.of(motion)).max())
        peak = found[row.limit.quantity]
        assert dense <= peak.most * (1.0 + 1e-9), row.limit.quantity
        assert peak.value >= dense * (1.0 - 1.1 * GAP), row.limit.quantity
        assert peak.value <= peak.most <= peak.value * (1.0 + 2.2 * GAP), row.limit.quantity


def test_a_limit_just_above_a_peak_is_kept_and_one_below_is_not(alpha: Program) -> None:
    peaks = {peak.quantity: peak.value for peak in verify_program(alpha, Limits(), DRIVES).peaks}
    for name, make in (
        ("feed_mm_s", lambda v: Limits(v)),
        ("acceleration_mm_s2", lambda v: Limits(None, v)),
        ("jerk_mm_s3", lambda v: Limits(None, None, v)),
        ("centripetal_mm_s2", lambda v: Limits(centripetal_mm_s2=v)),
        ("x_velocity_mm_s", lambda v: Limits(axis=AxisLimits(velocity_mm_s=(v, 1e4)))),
        ("y_acceleration_mm_s2", lambda v: Limits(axis=AxisLimits(acceleration_mm_s2=(1e6, v)))),
        ("y_jerk_mm_s3", lambda v: Limits(axis=AxisLimits(jerk_mm_s3=(1e9, v)))),
        ("y_volts", lambda v: Limits(volts=v)),
    ):
        above = verify_program(alpha, make(peaks[name] * 1.0003), DRIVES)
        assert above.kept, name
        assert not above.excesses
        within = verify_program(alpha, make(peaks[name] * 0.9995), DRIVES)
        assert within.kept, name
        assert {excess.quantity for excess in within.excesses} == {name}
        below = verify_program(alpha, make(peaks[name] * 0.997), DRIVES)
        assert not below.kept, name
        assert [peak.quantity for peak in below.exceeded] == [name]
        assert below.excesses[0].usage == pytest.approx(1.0 / 0.997, rel=2e-4)


def test_the_place_of_an_excess(alpha: Program) -> None:
    """Tangential jerk peaks four times, near both ends of both ramps."""
    found = verify_program(alpha, Limits(jerk_mm_s3=47000.0))
    places = sorted(excess.s_mm for excess in found.excesses)
    assert len(places) >= 4
    assert min(places) < 0.1
    assert max(places) > alpha.length_mm - 0.1
    for excess in found.excesses:
        cells = cut(alpha)
        cell = int(np.searchsorted(cells.start_s, excess.t_s, side="right")) - 1
        u = (excess.t_s - cells.start_s[cell]) / cells.duration_s[cell]
        one = np.array([cell])
        assert cells.arc_length_mm(one, np.array([u]))[0] == pytest.approx(excess.s_mm, abs=1e-9)


def test_caps_bind_on_their_stretch_only(alpha: Program) -> None:
    zones = (FeedZone(20.0, 35.0, 100.1), FeedZone(30.0, 31.0, 99.0), FeedZone(0.0, 0.01, 50.0))
    found = verify_program(alpha, Limits(zones=zones))
    assert not found.kept
    assert len(found.excesses) == 1
    excess = found.excesses[0]
    assert (excess.quantity, excess.limit.value) == ("cap_mm_s", 99.0)
    assert 30.0 - 1e-9 <= excess.s_mm <= 31.0 + 1e-9
    slow = verify_program(alpha, Limits(zones=(FeedZone(0.0, 0.01, 50.0),)))
    assert slow.kept
    peak = next(peak for peak in slow.peaks if peak.quantity == "cap_mm_s")
    assert peak.value < 50.0
    assert peak.s_mm <= 0.01 + 1e-9


def test_a_jump_of_the_acceleration_is_found(alpha: Program) -> None:
    """The controller would refuse this one; the verifier sees it too."""
    limits = Limits(jerk_mm_s3=60000.0)
    assert verify_program(alpha, limits).kept
    pieces = alpha.pieces
    c = pieces.c_q40.copy()
    middle = len(pieces) // 2
    c[middle, 1] += 1 << 30
    found = verify_program(replace(alpha, pieces=replace(pieces, c_q40=c)), limits)
    assert not found.kept
    assert found.excesses[0].quantity == "acceleration_step_mm_s2"
    # As a jerk over one period it may be 0.1 % of the limit.
    assert found.excesses[0].limit.value == pytest.approx(60000.0 * 1e-3 * 1e-3, rel=1e-12)


def test_the_volts_move_the_plant_along_the_path(alpha: Program) -> None:
    """The plant of docs/theory/drives.md 13, driven by the volts at every instant, stays on the path."""
    cells = cut(alpha)
    volts = [row for row in quantities(cells, Limits(), DRIVES) if row.limit.key == "volts"]
    h = 1e-5
    t = np.arange(0.0, alpha.duration_s, h) + 0.5 * h
    t = t[t < alpha.duration_s]
    cell = np.searchsorted(cells.start_s, t, side="right") - 1
    motion = motion_at(cells, cell, (t - cells.start_s[cell]) / cells.duration_s[cell])
    for axis, (row, drive) in enumerate(zip(volts, DRIVES, strict=True)):
        decay = np.exp(-h / drive.time_constant_s)
        push = drive.gain_rad_s_v * (1.0 - decay) * row.of(motion)
        speed = 0.0
        worst = 0.0
        for k, one in enumerate(push):
            before, speed = speed, decay * speed + one
            middle = 0.5 * (before + speed) * drive.screw_mm_rad
            worst = max(worst, abs(middle - motion.axis_velocity[axis][k]))
        assert worst < 1e-3


def test_volts_need_drives(alpha: Program) -> None:
    with pytest.raises(InputError, match="volts needs a machine"):
        verify_program(alpha, Limits(volts=3.0))
    assert "x_volts" not in {p.quantity for p in verify_program(alpha, Limits()).peaks}
    weak = replace(DRIVES[0], volts_limit=1.0)
    found = verify_program(alpha, Limits(volts=3.0), (weak, DRIVES[1]))
    limits = {peak.quantity: peak.limit.value for peak in found.peaks}
    assert (limits["x_volts"], limits["y_volts"]) == (1.0, 3.0)
