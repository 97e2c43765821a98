# SPDX-License-Identifier: MIT
"""Corner curves between two straight legs: chains of PH quintics with curvature 0 at both ends. Used by toolpath/fit.
No I/O.

docs/theory/toolpath-fitting.md section 4. The preimage w of a corner is a uniform quadratic B-spline, symmetric about
the bisector. Its few numbers were found by search for the least time through the corner at limited jerk. In the
jerk-limited regime a corner's shape does not depend on the limits; the tolerance only scales it.

There are several shapes: the more of its legs a corner may use, the less time it takes. The wide ones first swing to
the outer side of the tolerance.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from ...spline.bernstein import Complex, Real, basis, square

SHARPEST_RAD = 2.6
"""Sharper turns are stops: a corner curve would take as long."""

_PLACES = 33
"""Samples of a corner curve."""
_ANGLES = 60
"""Turning angles of the table of corners."""


@dataclass(frozen=True)
class Shape:
    """The inner coefficients of w as logarithms of their magnitudes, their angles as shares of a quarter of the turn,
    and the logarithm of the magnitude of the last one; that of the one before it is 0.
    """

    magnitude: tuple[float, ...]
    angle: tuple[float, ...]
    last: float

    @property
    def segments(self) -> int:
        """PH segments of the corner."""
        return 2 * (len(self.magnitude) + 1)

    def preimage(self, turn_rad: Real) -> Complex:
        """Bernstein coefficients (n, segments, 3) of w, for legs at angles -turn / 2 and turn / 2, of any size."""
        quarter = 0.25 * turn_rad[:, None]
        inner = np.exp(np.array(self.magnitude) + 1j * quarter * np.array(self.angle))
        outer = np.exp(np.array([0.0, self.last]) + 1j * quarter)
        half = np.concatenate((inner, outer), axis=1)
        z = np.concatenate((np.conj(half[:, ::-1]), half), axis=1)
        before, own, after = z[:, :-2], z[:, 1:-1], z[:, 2:]
        return np.stack((0.5 * (before + own), own, 0.5 * (own + after)), axis=2)


SHAPES = (
    Shape((-1.264,), (1.176,), -0.653),
    Shape((-1.041,), (1.022,), -0.62),
    Shape((), (), 1.099),
)
"""The shapes, the widest first. The last one uses the least length of its legs."""


def extent(turn_rad: Real, shape: int = -1) -> Real:
    """Length (n,) of its legs that a corner of tolerance 1 uses, for turns in 0 … SHARPEST_RAD; inf for turn 0."""
    turn, reach = _extents(shape)
    # Nearly proportional to 1 / turn, so that this product is smooth.
    with np.errstate(divide="ignore"):
        return np.asarray(np.interp(turn_rad, turn, reach * turn) / turn_rad)


@cache
def _extents(shape: int) -> tuple[Real, Real]:
    turn = np.linspace(0.02, SHARPEST_RAD, _ANGLES)
    return turn, corners(SHAPES[shape], turn).reach


@dataclass(frozen=True, eq=False)
class Corners:
    """Corner curves of tolerance 1 whose legs meet at 0, the first along the positive real axis.

    w      (n, segments, 3) Bernstein coefficients of the preimages
    joint  (n, segments + 1) complex; from leg to leg
    reach  (n,) length of each leg that the curve uses
    """

    w: Complex
    joint: Complex
    reach: Real


def corners(shape: Shape, turn_rad: Real) -> Corners:
    """The corner curves for turns (n,) to the left."""
    w = shape.preimage(turn_rad) * np.exp(0.25j * turn_rad)[:, None, None]
    hodograph = square(w)
    chord = hodograph.mean(axis=2)
    joint = np.concatenate((np.zeros((chord.shape[0], 1)), np.cumsum(chord, axis=1)), axis=1)
    reach = np.abs(joint[:, -1]) / (2.0 * np.cos(0.5 * turn_rad))
    half = (shape.segments + 1) // 2
    steps = np.concatenate((joint[:, :half, None], hodograph[:, :half] / 5.0), axis=2)
    points = np.cumsum(steps, axis=2) @ basis(5, np.linspace(0.0, 1.0, _PLACES)).T
    points = points.reshape(turn_rad.size, -1) - reach[:, None]
    after = points * np.exp(-1j * turn_rad)[:, None]
    off = np.minimum(_off_ray(-np.conj(points)), _off_ray(after))
    deviation = np.maximum(off.max(axis=1), np.abs(joint[:, shape.segments // 2] - reach))
    size = 1.0 / deviation
    placed = (joint - reach[:, None]) * size[:, None]
    return Corners(w * np.sqrt(size)[:, None, None], placed, reach * size)


def _off_ray(point: Complex) -> Real:
    """Distance of points from the positive real axis."""
    return np.asarray(np.where(point.real >= 0.0, np.abs(point.imag), np.abs(point)))
