# SPDX-License-Identifier: MIT
"""Degenerate points in space, as users type them: each gives a good curve, or one message with its place. Run by
pytest; writes to temporary folders.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from hodograph.config import SpacePathSpec, load_path_file
from hodograph.errors import InputError
from hodograph.pipeline import pipeline_of
from hodograph.spline.spatial import SpatialPHSpline

Points = list[list[float]]

HELIX = [[20 * np.cos(t), 20 * np.sin(t), 2 * t] for t in np.arange(17) * np.pi / 4]
LOOP: Points = [[0, 0, 0], [10, 0, 2], [10, 10, 4], [0, 10, 2]]
LINE: Points = [[0, 0, 0], [1, 2, 3], [2, 4, 6], [5, 10, 15]]

STRAIGHT: dict[str, Points] = {
    "collinear": LINE,
    "collinear, uneven": [[0, 0, 0], [1e-4, 2e-4, 3e-4], [2, 4, 6], [5, 10, 15]],
    "two points": [[0, 0, 0], [10, 5, 3]],
    "straight up": [[0, 0, 0], [0, 0, 5], [0, 0, 20]],
    "straight down": [[0, 0, 20], [0, 0, 5], [0, 0, 0]],
    "with rotary axes": [[0, 0, 0, 0, 0], [10, 0, 0, 45, 90], [20, 0, 0, 90, 180]],
    "up with a rotary axis": [[0, 0, 0, 0], [0, 0, 5, 30], [0, 0, 20, 0]],
    "two points with a rotary axis": [[0, 0, 0, 0], [10, 0, 0, 30]],
}
CURVED: dict[str, tuple[Points, bool]] = {
    "reversing": ([[0, 0, 0], [10, 0, 10], [0, 0, 0]], False),
    "reversing on a line": ([[0, 0, 0], [10, 0, 0], [5, 0, 0], [20, 0, 0]], False),
    "up, then down": ([[0, 0, 0], [0, 0, 10], [0, 0, 0]], False),
    "a point again, later": (
        [[0, 0, 0], [10, 0, 0], [10, 10, 5], [0, 0, 0], [-10, -10, 5]],
        False,
    ),
    "helix": (HELIX, False),
    "three points": ([[0, 0, 0], [10, 5, 3], [20, 0, 9]], False),
    "right angle": ([[0, 0, 0], [10, 0, 0], [10, 0, 10]], False),
    "nearly equal": ([[0, 0, 0], [10, 0, 0], [10.000001, 0, 0], [20, 5, 5]], False),
    "nearly straight up": ([[0, 0, 0], [1e-9, 0, 5], [0, 1e-9, 20]], False),
    "closed, three points": ([[0, 0, 0], [10, 0, 2], [5, 9, 4]], True),
    "closed, on a line": ([[0, 0, 0], [10, 0, 2], [20, 0, 4]], True),
    "there and back, twice": ([[0, 0, 0], [10, 3, 2], [0, 0, 0], [10, 3, 2]], False),
    "closed, nearly straight up": (
        [[0, 0, 0], [1e-9, 0, 10], [0, 1e-9, 20], [1e-9, 1e-9, 30]],
        True,
    ),
    "closed, end repeated": ([*LOOP, [0, 0, 0]], True),
}
REFUSED: dict[str, tuple[str, Points, bool, str]] = {
    "one point": ("through", [[0, 0, 0]], False, "1 through points: an open path needs at least 2"),
    "neighbours": (
        "through",
        [[0, 0, 0], [9, 0, 0], [9, 0, 0], [9, 5, 5]],
        False,
        "through point 2 repeats through point 1 at (9, 0, 0): remove one of them",
    ),
    "all equal": (
        "through",
        [[1, 1, 1]] * 3,
        False,
        "point 1 repeats through point 0 at (1, 1, 1)",
    ),
    "all equal, rotary axes too": (
        "through",
        [[1, 2, 3, 4]] * 2,
        False,
        "point 1 repeats through point 0 at (1, 2, 3)",
    ),
    "turning at rest on the way": (
        "through",
        [[0, 0, 0, 0], [9, 0, 0, 45], [9, 0, 0, 90], [20, 0, 0, 90]],
        False,
        "through point 2 has the x, y and z of through point 1, while other axes move: end the path there",
    ),
    "closed, two points": (
        "through",
        [[0, 0, 0], [9, 0, 2]],
        True,
        "2 through points: a closed path needs at least 3",
    ),
    "closed, end almost repeated": (
        "through",
        [*LOOP, [0, 0, 1e-4]],
        True,
        "through do not close: point 4 is 0.0001 mm away from point 0",
    ),
    "closed, an axis does not come back": (
        "through",
        [[*p, 90.0 * k] for k, p in enumerate([*LOOP, LOOP[0]])],
        True,
        "through point 4 repeats through point 0 in x, y and z, but number 4 is 360, not 0",
    ),
    "polygon of three": (
        "control_points",
        LINE[:3],
        False,
        "3 control points: an open path needs at least 4",
    ),
    "polygon all equal": (
        "control_points",
        [[1, 1, 1]] * 4,
        False,
        "control point 1 repeats control point 0",
    ),
    "seven numbers": ("through", [[0] * 7, [1] * 7], False, "point 0 has 7 numbers: at most 6"),
    "mixed": ("through", [[0, 0, 0], [1, 2]], False, "point 1 must be [x, y, z] like the first"),
}


def solved(
    folder: Path, points: Points, closed: bool = False, key: str = "through"
) -> SpatialPHSpline:
    file = folder / "path.toml"
    flag = str(closed).lower()
    file.write_text(f"[path]\nclosed = {flag}\n{key} = {[list(map(float, p)) for p in points]}\n")
    given = load_path_file(file)
    assert isinstance(given.given_path, SpacePathSpec)
    found = pipeline_of(given).found_spline
    assert found.bending_ratio < 2.0, "also where the guide reverses on a straight line"
    curve = found.spline
    assert isinstance(curve, SpatialPHSpline)
    return curve


@pytest.mark.parametrize("name", STRAIGHT)
def test_points_on_a_line_give_the_line(tmp_path: Path, name: str) -> None:
    points = np.array(STRAIGHT[name], dtype=float)
    curve = solved(tmp_path, STRAIGHT[name])
    start, end = points[0, :3], points[-1, :3]
    assert curve.length_mm == pytest.approx(float(np.linalg.norm(end - start)), rel=1e-12)
    s = np.linspace(0.0, curve.length_mm, 300)
    shown = curve.point(s)
    along = start + s[:, None] * (end - start) / curve.length_mm
    assert np.abs(shown - along).max() < 1e-9
    assert curve.max_curvature_per_mm() < 1e-9
    if points.shape[1] > 3:
        assert np.abs(curve.axes_nodes[:, 3:] - points[:, 3:]).max() < 1e-9


@pytest.mark.parametrize("name", CURVED)
def test_other_points_give_a_curve_through_them(tmp_path: Path, name: str) -> None:
    given, closed = CURVED[name]
    points = np.array(given, dtype=float)
    if closed and np.array_equal(points[0], points[-1]):
        points = points[:-1]
    curve = solved(tmp_path, given, closed)
    nodes = curve.axes_nodes[:-1] if closed else curve.axes_nodes
    assert np.abs(nodes - points).max() < 1e-9
    loop = np.vstack((points, points[:1])) if closed else points
    chords = float(np.linalg.norm(np.diff(loop, axis=0), axis=1).sum())
    assert chords * (1 - 1e-12) <= curve.length_mm < 3.0 * chords, "no whip"
    assert np.isfinite(curve.max_curvature_per_mm())


def test_straight_polygons_give_the_line(tmp_path: Path) -> None:
    for points in (LINE, [[0, 0, float(k)] for k in (0, 3, 6, 9)]):
        curve = solved(tmp_path, points, key="control_points")
        assert curve.max_curvature_per_mm() < 1e-9


@pytest.mark.parametrize("name", REFUSED)
def test_what_has_no_curve_has_one_message(tmp_path: Path, name: str) -> None:
    key, points, closed, words = REFUSED[name]
    with pytest.raises(InputError, match=re.escape(words)) as caught:
        solved(tmp_path, points, closed, key)
    text = str(caught.value)
    assert "path.toml: [path] " in text
    assert "\n" not in text
    assert caught.value.exit_status == 2
