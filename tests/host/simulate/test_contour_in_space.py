# SPDX-License-Identifier: MIT
"""Contour error in space: the distance of a point from the exact curve, whatever it is beside. Run by pytest; starts
and writes nothing.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from hodograph.feed import ControllerLimits
from hodograph.native import Contour, NativeProgram
from spatial_image import Segment, add_extra, chain, feed_along, image, wandering

CONTROLLER = ControllerLimits(200.0, 1000.0, 20000.0, 0.1)


def made(extras: int = 0) -> tuple[list[Segment], NativeProgram]:
    segments = chain(wandering(5, 12.0, bend=0.4), [3 << 40, -7 << 40, 2 << 40])
    for _ in range(extras):
        add_extra(segments, 8.0, 30.0, 0.2)
    return segments, NativeProgram(image(segments, feed_along(segments, 40.0, 0.3, CONTROLLER)))


def place(segment: Segment, xi: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Point, unit tangent and arc length."""
    *position, arc = (float(v) for v in segment.at(xi))
    rows = [[float(c) for c in row] for row in segment.hodograph()[:3]]
    slope = np.array(
        [sum(math.comb(4, k) * c[k] * xi**k * (1 - xi) ** (4 - k) for k in range(5)) for c in rows]
    )
    return np.array(position[:3]), slope / np.linalg.norm(slope), arc + segment.start / 2**40


@pytest.mark.parametrize("extras", [0, 2])
@pytest.mark.parametrize("away_mm", [0.0, 1e-6, 1e-3, 0.2])
def test_points_beside_the_curve(away_mm: float, extras: int) -> None:
    segments, program = made(extras)
    contour, rng = Contour(program), np.random.default_rng(7)
    for _ in range(200):
        segment, xi = segments[rng.integers(len(segments))], float(rng.uniform(0.02, 0.98))
        point, tangent, arc_mm = place(segment, xi)
        aside = np.cross(tangent, rng.normal(size=3))
        at = point + away_mm * aside / np.linalg.norm(aside)
        late_mm = float(rng.uniform(-1, 1)) * away_mm  # the foot is not where the command is
        assert contour.distance_mm(arc_mm + late_mm, *at) == pytest.approx(away_mm, abs=2e-9)


def test_counts_of_all_path_axes() -> None:
    segments, program = made(extras=2)
    point, tangent, arc_mm = place(segments[2], 0.4)
    aside = np.cross(tangent, [1.0, 0.0, 0.0])
    at = point + 0.05 * aside / np.linalg.norm(aside)
    counts = np.array([[*np.rint(at * 1e6), 123456, -5]], dtype=np.int32)
    arcs = np.array([round(arc_mm * 2**40)])
    contour = Contour(program)
    assert contour.errors_um(arcs, counts, 1_000_000)[0] == pytest.approx(50.0, abs=0.002)
    assert contour.errors_um(arcs, counts[:, :3], 1_000_000)[0] == pytest.approx(50.0, abs=0.002)
    with pytest.raises(ValueError, match="shape"):
        contour.errors_um(arcs, counts[:, :2], 1_000_000)
