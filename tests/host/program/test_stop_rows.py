# SPDX-License-Identifier: MIT
"""The rows of the stop search for the limits of axes: first to third derivatives of a path in space by its arc
length, against differences of exact points. Run by pytest; writes nothing.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from hodograph.feed import FeedRequest, Limits, plan_feed
from hodograph.native.program import NativeProgram
from hodograph.native.stop_search import StopLimits, StopSearch, limits_struct
from hodograph.pipeline import load_pipeline
from hodograph.program import compile_program, encode
from quick_stops import QUICK_STOPS

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
STEP_MM = 2e-3


def differences(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """First to third derivatives (3, N, axes) from points (N, 7, axes) at steps of STEP_MM."""
    weights = np.array(
        [
            [-1 / 60, 3 / 20, -3 / 4, 0, 3 / 4, -3 / 20, 1 / 60],
            [1 / 90, -3 / 20, 3 / 2, -49 / 18, 3 / 2, -3 / 20, 1 / 90],
            [1 / 8, -1, 13 / 8, 0, -13 / 8, 1, -1 / 8],
        ]
    )
    powers = STEP_MM ** np.arange(1.0, 4.0)
    return np.einsum("dk,nka->dna", weights, points) / powers[:, None, None]


@pytest.mark.parametrize("name", ["helix", "five_axes"])
def test_derivatives_of_all_axes(name: str) -> None:
    curve = load_pipeline(EXAMPLES / f"{name}.toml", allow_space=True).curve
    plan = plan_feed(curve.length_mm, FeedRequest("minimax", 20.0, 0.3), Limits())
    native = NativeProgram(encode(compile_program(curve, plan, QUICK_STOPS)))
    search = StopSearch(native)
    path, kept = search._path(limits_struct(StopLimits()))
    count = len(kept[0])
    s_mm = np.array([path.rows[i].s_mm for i in range(count)])
    axes = native.axis_count
    found = np.array(
        [[list(path.bends[i].by_mm[order])[:axes] for i in range(count)] for order in range(3)]
    )
    # Between joints, where the third derivative jumps.
    own = np.array([0.0, *np.cumsum(curve.segment_lengths_mm)])
    away = np.abs(s_mm[:, None] - own).min(axis=1)
    inside = away > 4 * STEP_MM
    assert inside.sum() > 100
    places = s_mm[inside, None] + STEP_MM * np.arange(-3, 4)
    points = np.asarray(curve.axes_point(places.ravel())).reshape(*places.shape, -1)[..., :axes]
    right = differences(points)
    largest = np.abs(right).max(axis=1, keepdims=True)
    assert (largest[:, :, :2] > 0).all()
    off = np.abs(found[:, inside] - right)
    for order, bound in enumerate((1e-7, 1e-5, 1e-4)):
        assert (off[order] <= bound * (1.0 + largest[order])).all(), (order, off[order].max())
