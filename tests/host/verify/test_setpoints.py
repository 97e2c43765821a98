# SPDX-License-Identifier: MIT
"""Differences of setpoints: by hand, in stretches, and beside the true derivatives. Run by pytest; starts and writes
nothing.
"""

from pathlib import Path

import numpy as np
import pytest

from hodograph.feed import Limits
from hodograph.pipeline import load_pipeline
from hodograph.verify import bus_noise, sampled, verify_program

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"


@pytest.mark.parametrize("name", ["alpha", "heart"])
def test_differences_are_those_of_the_kernels_and_near_the_derivatives(name: str) -> None:
    pipeline = load_pipeline(EXAMPLES / f"{name}.toml")
    found = {one.kernel: one for one in sampled(pipeline.accepted)}
    program = pipeline.accepted
    points = program.points("fixed", program.tick_times_q42_s())
    for axis in range(2):
        x = points["position_q40"][:, axis].astype(np.float64) * 2.0**-40
        x = np.concatenate((np.full(3, x[0]), x, np.full(3, x[-1])))
        acceleration = np.abs(np.diff(x, 2)).max() / 1e-6
        jerk = np.abs(np.diff(x, 3)).max() / 1e-9
        assert found["fixed"].acceleration_mm_s2[axis] == pytest.approx(acceleration, abs=1e-3)
        assert found["fixed"].jerk_mm_s3[axis] == pytest.approx(jerk, abs=1.0)
    peaks = {peak.quantity: peak for peak in verify_program(pipeline.program, Limits()).peaks}
    for one in found.values():
        # A difference is a mean of the derivative, plus what the kernel's rounding adds.
        for axis, name_ in enumerate("xy"):
            jerk = peaks[f"{name_}_jerk_mm_s3"].most
            assert one.jerk_mm_s3[axis] <= jerk + one.noise_mm_s3 + 0.01
            assert one.jerk_mm_s3[axis] >= 0.98 * jerk - one.noise_mm_s3
    assert found["double"].noise_mm_s3 == 0.0
    assert found["fixed"].noise_mm_s3 < 0.01 < found["float"].noise_mm_s3 < 200.0


def test_long_programs_are_read_in_stretches(monkeypatch: pytest.MonkeyPatch) -> None:
    program = load_pipeline(EXAMPLES / "alpha.toml").accepted
    whole = sampled(program)
    monkeypatch.setattr("hodograph.verify.setpoints._CHUNK", 37)
    assert sampled(program) == whole


def test_rounding_to_counts() -> None:
    """The worst case exists: roundings of alternating sign."""
    noise = bus_noise(1_000_000, 1000)
    assert (noise.acceleration_mm_s2, noise.jerk_mm_s3) == pytest.approx((2.0, 4000.0))
    worst = 0.5e-6 * (-1.0) ** np.arange(9)
    assert np.abs(np.diff(worst, 3)).max() / 1e-9 == pytest.approx(noise.jerk_mm_s3)
    assert np.abs(np.diff(worst, 2)).max() / 1e-6 == pytest.approx(noise.acceleration_mm_s2)
