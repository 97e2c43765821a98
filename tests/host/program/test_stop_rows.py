# SPDX-License-Identifier: MIT
"""The rows of the stop search for the limits of axes: first to third derivatives of a path in space by its arc
length, against differences of exact points. Run by pytest; writes to temporary folders.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from hodograph.native.program import NativeProgram
from hodograph.native.stop_search import StopLimits, StopSearch, limits_struct
from hodograph.pipeline import load_pipeline
from hodograph.program import compiler, encode
from hodograph.program.stop_planning import with_bounds

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
STEP_MM = 2e-3
QUICK = 'profile = "minimax"\nnominal_mm_s = 20\nramp_time_s = 0.3'


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
def test_derivatives_of_all_axes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    text = (EXAMPLES / f"{name}.toml").read_text().replace("machines/", f"{EXAMPLES}/machines/")
    assert 'profile = "optimal"' in text
    file = tmp_path / "path.toml"
    file.write_text(text.replace('profile = "optimal"', QUICK))
    pipeline = load_pipeline(file, allow_space=True)
    monkeypatch.setattr(compiler, "plan_stops", lambda program, *_: with_bounds(program))
    native = NativeProgram(encode(compiler.compile_program(pipeline.curve, pipeline.plan)))
    search = StopSearch(native)
    path, kept = search._path(limits_struct(StopLimits()))
    count = len(kept[0])
    s_mm = np.array([path.rows[i].s_mm for i in range(count)])
    axes = native.axis_count
    found = np.array(
        [[list(path.bends[i].by_mm[order])[:axes] for i in range(count)] for order in range(3)]
    )
    curve = pipeline.curve
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
