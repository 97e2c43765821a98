# SPDX-License-Identifier: MIT
"""Points that nearly repeat on a path of six axes: a plan in few intervals, which the controller accepts. Run by
pytest; writes to temporary folders.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from hodograph.feed.optimal import window
from hodograph.pipeline import Pipeline, load_pipeline
from six_axes import six_axis_machine, six_axis_path

pytestmark = pytest.mark.usefixtures("stops_planned_once", "few_knots")

POINTS = [[0, 0, 0, 0, 0, 0], [10, 5, 1, 5, 5, 20], [20, 5, 3, 10, 8, 40], [30, 0, 5, 0, 0, 0]]
MOST_KNOTS = 500
"""Of a path of 0.8 s. A plan that took a feed near 0 for the true one had 31350."""


def with_near(folder: Path, apart_mm: float, turned_deg: float) -> Pipeline:
    """The path with a point more beside the second one, from which a, b and c turn by so much."""
    x, y, z, a, b, c = POINTS[1]
    near = [x + apart_mm, y, z, a + turned_deg, b - turned_deg, c + turned_deg]
    points = [*POINTS[:2], near, *POINTS[2:]]
    return load_pipeline(
        six_axis_path(folder, six_axis_machine(folder, stop_time_ms=1000), points), allow_space=True
    )


@pytest.fixture
def few_knots(monkeypatch: pytest.MonkeyPatch) -> None:
    chosen = window.choose_knots

    def counted(*given: Any) -> Any:
        knots = chosen(*given)
        assert knots.size <= MOST_KNOTS
        return knots

    monkeypatch.setattr(window, "choose_knots", counted)


@pytest.mark.parametrize("apart_mm", [1e-2, 1e-3, 1e-4])
def test_axes_that_turn_between_near_points(tmp_path: Path, apart_mm: float) -> None:
    """One of them turns back there: the feed is low for 20 ms, not for minutes."""
    pipeline = with_near(tmp_path, apart_mm, apart_mm)
    assert pipeline.plan.duration_s < 0.85


@pytest.mark.parametrize("apart_mm", [1e-7, 1e-5])
def test_points_at_which_the_rounding_of_extra_axes_counts(tmp_path: Path, apart_mm: float) -> None:
    pipeline = with_near(tmp_path, apart_mm, 0.0)
    assert pipeline.accepted.check() is None
    assert pipeline.plan.duration_s < 0.85
