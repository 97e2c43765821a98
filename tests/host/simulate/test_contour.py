# SPDX-License-Identifier: MIT
"""The contour error: known distances from the curve, crossings, joints and ends. Run by pytest; starts and writes
nothing.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hodograph.native import Contour, NativeProgram

from .conftest import Case, make_case

ALPHA = make_case("alpha")
CONTOUR = Contour(NativeProgram(ALPHA.image))


def crossing(case: Case) -> tuple[float, float]:
    """The two arc lengths where the curve meets itself."""
    s = np.linspace(0.0, case.spline.length_mm, 2000)
    p = case.spline.point(s)
    gap = np.abs(p[:, None] - p[None, :])
    gap[np.abs(s[:, None] - s[None, :]) < 10.0] = np.inf
    i, j = np.unravel_index(np.argmin(gap), gap.shape)
    return float(s[min(i, j)]), float(s[max(i, j)])


@settings(deadline=None, max_examples=300)
@given(
    place=st.floats(0.02, 0.98),
    away=st.floats(-0.2, 0.2),
    lag=st.floats(-0.5, 0.5),
)
def test_points_on_the_normal(place: float, away: float, lag: float) -> None:
    s = np.array([place * ALPHA.spline.length_mm])
    point = (ALPHA.spline.point(s) + 1j * away * ALPHA.spline.tangent(s))[0]
    found = CONTOUR.distance_mm(float(s[0]) + lag, point.real, point.imag)
    # 1e-8 mm: the program is the spline rounded to its format
    assert found == pytest.approx(abs(away), abs=1e-8)


def test_near_branch_at_the_crossing() -> None:
    first, second = crossing(ALPHA)
    for here, other in ((first, second), (second, first)):
        tangent = ALPHA.spline.tangent(np.array([here, other]))
        point = ALPHA.spline.point(np.array([here]))[0] + 0.05j * tangent[0]
        dense = ALPHA.spline.point(other + np.linspace(-0.2, 0.2, 4001))
        assert np.abs(dense - point).min() < 0.049
        assert CONTOUR.distance_mm(here, point.real, point.imag) == pytest.approx(0.05, abs=1e-8)


def test_errors_of_a_run_against_dense_samples(heart: Case) -> None:
    motion = heart.motion
    for k in range(0, len(motion.rows), 97):
        point = complex(*motion.act_mm[k])
        s = motion.arc_length_mm[k] + np.linspace(-0.4, 0.4, 8001)
        nearest = np.abs(heart.spline.point(s % heart.spline.length_mm) - point).min()
        # spacing 1e-4 mm: the nearest sample is at most hypot(d, 5e-5) away
        error_mm = motion.contour_error_um[k] / 1000.0
        assert error_mm <= nearest + 1e-8
        assert nearest <= np.hypot(error_mm, 5.1e-5) + 1e-8


def test_shapes_are_checked() -> None:
    with pytest.raises(ValueError, match="act_counts"):
        CONTOUR.errors_um(np.zeros(3, np.int64), np.zeros((2, 2), np.int32), 1_000_000)
