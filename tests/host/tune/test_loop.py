# SPDX-License-Identifier: MIT
"""The linear model compared with the simulated drive, and margins with the behaviour at their ends. Run by pytest;
starts and writes nothing.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from hodograph.config import Drive
from hodograph.names import INTEGRALS
from hodograph.native import DriveModel
from hodograph.tune.design import Poles, feedforward_of, stiffness_n_um, with_poles
from hodograph.tune.loop import loop_of, margins

Drives = tuple[Drive, Drive]


@pytest.mark.parametrize("sensed", [False, True])
@pytest.mark.parametrize("hz", [2.0, 20.0, 60.0])
@pytest.mark.parametrize("integral", INTEGRALS)
def test_closed_loop_is_that_of_the_simulated_drive(
    drives: Drives, hz: float, sensed: bool, integral: str
) -> None:
    drive = replace(
        with_poles(drives[0], Poles(1000.0, 0.7, 200.0)) if sensed else drives[0],
        interpolation="cubic",
        volts_limit=30.0,
        speed="differences" if sensed else "exact",
        delay_samples=int(sensed),
        integral=integral,
    )
    rad_s, amplitude_mm, periods = 2 * math.pi * hz, 0.4 / hz, 2000
    t_s = np.arange(1, periods + 1) * 1e-3
    start = np.minimum(t_s / 0.5, 1.0) ** 3
    targets = np.rint(1e6 * amplitude_mm * start * np.sin(rad_s * t_s)).astype(np.int32)
    positions, volts_mv = DriveModel(drive).follow(targets)
    assert 20 < abs(volts_mv).max() < 30_000
    last = t_s > 1.5
    measured = (
        np.mean(positions[last] * np.exp(-1j * rad_s * t_s[last])) * 2j / (1e6 * amplitude_mm)
    )
    expected = loop_of(drive).closed(np.array([rad_s]))[0]
    assert abs(measured - expected) < 0.02 * max(0.2, abs(expected - 1))


def test_offsets_that_invert_the_plant_make_the_loop_follow(drives: Drives) -> None:
    """Speed and acceleration of the command as volts: the remainder is what the loop itself does too late."""
    for drive in drives:
        tuned, forward = feedforward_of(drive)
        volts_m = drive.rated_torque_nm * drive.torque_to_volts / 1000
        offsets = np.array([forward.torque_permille_s_m, forward.torque_permille_s2_m])
        rad_s = 2 * np.pi * np.array([2.0, 10.0, 40.0])
        loop = loop_of(tuned)
        left = np.abs(loop.closed(rad_s, *(offsets * volts_m / 1000)) - 1)
        without = np.abs(loop.closed(rad_s) - 1)
        assert np.all(left < without)
        assert left[2] < 0.4 * without[2]


def test_steps_begin_and_end_where_they_must(drives: Drives) -> None:
    t_s, moved, pushed = loop_of(drives[0]).steps(0.2)
    assert moved[0] == pushed[0] == 0
    assert moved[-1] == pytest.approx(1, abs=1e-4)
    assert moved.max() < 1.001
    assert abs(pushed[-1]) < 1e-4 * pushed.max()
    assert 0.001 < t_s[np.argmax(pushed)] < 0.02
    assert pushed.max() == pytest.approx(1 / stiffness_n_um(drives[0]), rel=0.6)


def test_poles_are_those_asked_for(drives: Drives) -> None:
    for natural, damping, real in ((200.0, 0.7, 40.0), (600.0, 0.9, 140.0), (600.0, 0.5, 90.0)):
        for drive in drives:
            placed = with_poles(drive, Poles(natural, damping, real))
            found = loop_of(replace(placed, loop_rate_hz=64000)).poles()
            pair = natural * (-damping + 1j * math.sqrt(max(0.0, 1 - damping**2)))
            for pole in (pair, np.conj(pair), -real):
                assert np.abs(found - pole).min() < 0.06 * natural
            assert np.max(found.real) < 0


def test_late_sensing_costs_phase(drives: Drives) -> None:
    plain = with_poles(drives[0], Poles(1000.0, 0.7, 200.0))
    late = replace(plain, speed="differences", delay_samples=1)
    lost = margins(loop_of(plain)).phase_deg - margins(loop_of(late)).phase_deg
    delay = margins(loop_of(plain), 1.5 / plain.loop_rate_hz)
    assert 5 < lost < 30
    assert margins(loop_of(late)).phase_deg == pytest.approx(delay.phase_deg, abs=1.0)


def test_gain_margins_end_where_the_loop_becomes_unstable(drives: Drives) -> None:
    stiff = with_poles(drives[1], Poles(900.0, 0.8, 200.0))
    late = replace(stiff, speed="differences", delay_samples=1)
    assert not loop_of(
        replace(late, k_pv_nm_s_rad=1.02 * margins(loop_of(late)).gain_up * late.k_pv_nm_s_rad)
    ).stable
    for drive in (drives[0], stiff, late):
        found = margins(loop_of(drive))
        assert 0.01 < found.gain_down < 0.5

        def unstable(factor: float, drive: Drive = drive) -> bool:
            louder = replace(drive, k_pv_nm_s_rad=drive.k_pv_nm_s_rad * factor)
            return bool(np.max(loop_of(louder).poles().real) > 0)

        assert unstable(0.98 * found.gain_down)
        assert not unstable(1.02 * found.gain_down)


def test_a_dead_time_uses_up_the_phase_and_no_more(drives: Drives) -> None:
    loop = loop_of(drives[0])
    whole = margins(loop)
    assert 20 < whole.phase_deg < 90
    half = margins(loop, whole.delay_s / 2)
    assert half.phase_deg == pytest.approx(whole.phase_deg / 2, rel=0.01)
    assert half.crossover_hz == pytest.approx(whole.crossover_hz, rel=1e-6)
    assert margins(loop, 0.999 * whole.delay_s).modulus < 0.01 < half.modulus < whole.modulus
    rises = margins(loop, 125e-6).gain_up
    assert 1.5 < rises < 50
    rad_s = loop.grid()
    response = rises * loop.open(rad_s, 125e-6)
    assert np.abs(1 + response).min() < 0.01


def test_the_paper_s_loop(drives: Drives) -> None:
    found = margins(loop_of(drives[0]))
    assert found.crossover_hz == pytest.approx(118.0, abs=0.1)
    assert found.phase_deg == pytest.approx(60.0, abs=0.1)
    assert stiffness_n_um(drives[0]) == pytest.approx(144.9, abs=0.1)


def test_feedforward_knows_late_sensing(drives: Drives) -> None:
    """Constant acceleration: what the loop makes of a speed half a sample late is what the offsets leave out."""
    late = replace(with_poles(drives[0], Poles(900.0, 0.8, 200.0)), speed="differences")
    plain, own = feedforward_of(drives[0])[1], feedforward_of(late)[1]
    volts = (plain.torque_permille_s2_m - own.torque_permille_s2_m) * late.rated_torque_nm
    by_lag = volts * late.torque_to_volts * late.screw_mm_rad / 1e6
    gain = late.torque_to_volts * late.k_pv_nm_s_rad
    assert by_lag == pytest.approx(gain * 0.5 / 16000, rel=1e-9)
    assert own.torque_permille_s_m < plain.torque_permille_s_m


def test_feedforward_inverts_the_plant(drives: Drives) -> None:
    """A plant driven by the offsets alone, at constant acceleration from rest, goes as commanded."""
    for drive in drives:
        tuned, forward = feedforward_of(drive)
        assert tuned.k_pf_rad_mm == pytest.approx(1 / 1.59)
        a_m_s2, t = 1.7, 0.03
        permille = forward.torque_permille_s2_m * a_m_s2, forward.torque_permille_s_m * a_m_s2
        volts = [p / 1000 * drive.rated_torque_nm * drive.torque_to_volts for p in permille]
        # w' = (K V - w) / T with V = volts[0] + volts[1] t has the solution w = a t / g.
        speed = 1000 * a_m_s2 * t / drive.screw_mm_rad
        drawn = drive.gain_rad_s_v * (volts[0] + volts[1] * t) - speed
        assert drawn / drive.time_constant_s == pytest.approx(1000 * a_m_s2 / drive.screw_mm_rad)
