# SPDX-License-Identifier: MIT
"""Quality of a spline in space: turning and bending energy of its spans, compared with its guide curve;
docs/theory/spatial-splines.md section 5. Used by spatial/build. No I/O.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..bernstein import Real, basis
from ..verdict import Verdict, compared, windows
from .curve import curvature_numerator, speed_of

Rates = Callable[[Real, Real], tuple[Real, Real, Real]]
"""A function of Bernstein coefficients of spans (N, …) and curve parameters xi (n,). Returns (N, n) each: parametric
speed, curvature * speed and curvature^2 * speed, the rates of turning and bending by xi.
"""

_UNEVEN = 2.0
"""Ratio of greatest to least parametric speed above which a span is sampled finely."""
_SHARP_RAD = 0.8
"""Turning of a span above which it is sampled finely."""
_SAMPLES = 8
"""Equal parts of a span of the guide, between whose tangents `_sampled_turning` adds the angles."""


def _rule(points: int, panels: int) -> tuple[Real, Real]:
    """Composite Gauss-Legendre rule on [0, 1]: nodes and weights."""
    nodes, weights = np.polynomial.legendre.leggauss(points)
    xi = (np.arange(panels)[:, None] + (nodes + 1.0) / 2.0) / panels
    return xi.ravel(), np.tile(weights / (2.0 * panels), panels)


_SMOOTH, _SHARP = _rule(6, 1), _rule(12, 8)
"""Quadratures of usual spans, and of those that are sampled finely."""


@dataclass(frozen=True, eq=False)
class SpaceShape:
    """Figures (N,) of each span.

    bending    integral of curvature^2 over arc length; 1/mm
    turning    integral of curvature over arc length; rad
    """

    bending: Real
    turning: Real


def judge(preimage: Real, guide_hodograph: Real, closed: bool) -> Verdict:
    """Compares a spline, given by its preimages (M, 4, 3), with its guide, given by its hodographs (M, 3, 3)."""
    own, guide = spline_shape(preimage), guide_shape(guide_hodograph)
    extra = windows(own.turning - guide.turning, closed)
    length = speed_of(preimage).mean(axis=-1)
    return compared(own.bending, guide.bending, extra, length, closed)


def spline_shape(preimage: Real) -> SpaceShape:
    """Figures of PH spans with preimages (N, 4, 3)."""
    return _shape(preimage, _spline_rates)[0]


def guide_shape(hodograph: Real) -> SpaceShape:
    """Figures of spans with quadratic hodographs (N, 3, 3): axes, then Bernstein coefficients.

    Quadrature misses the turning at a place where the guide stops and reverses. So the turning of a span with uneven
    speed is at least the sum of the angles between sampled tangents.
    """
    shape, uneven = _shape(hodograph, _guide_rates)
    shape.turning[uneven] = np.maximum(shape.turning[uneven], _sampled_turning(hodograph[uneven]))
    return shape


def _shape(spans: Real, rates: Rates) -> tuple[SpaceShape, NDArray[np.bool_]]:
    """Figures of spans, and which spans (N,) have an uneven parametric speed (_UNEVEN).

    Gauss quadrature with 6 points, or with 96 if the span turns by more than _SHARP_RAD or its speed is uneven.

    Bending has two correct digits or more, except next to a cusp. The error of turning is at most 3 %. It is the larger
    one because the integrand almost has a kink where the curvature nearly vanishes.
    """
    speed, turning, bending = rates(spans, _SMOOTH[0])
    turned, bent = turning @ _SMOOTH[1], bending @ _SMOOTH[1]
    uneven = speed.max(axis=1) > _UNEVEN * speed.min(axis=1)
    sharp = np.flatnonzero(uneven | ~(turned < _SHARP_RAD))
    if sharp.size:
        _, turning, bending = rates(spans[sharp], _SHARP[0])
        turned[sharp], bent[sharp] = turning @ _SHARP[1], bending @ _SHARP[1]
    return SpaceShape(bent, turned), uneven


def _spline_rates(preimage: Real, xi: Real) -> tuple[Real, Real, Real]:
    speed = speed_of(preimage) @ basis(4, xi).T
    numerator = curvature_numerator(preimage) @ basis(2, xi).T
    square = numerator.real * numerator.real + numerator.imag * numerator.imag
    with np.errstate(all="ignore"):
        return speed, np.sqrt(square) / speed, square / (speed * speed * speed)


def _guide_rates(hodograph: Real, xi: Real) -> tuple[Real, Real, Real]:
    first, middle, last = np.moveaxis(hodograph, -1, 0)
    cross = np.stack(
        (2.0 * _cross(first, middle), _cross(first, last), 2.0 * _cross(middle, last)), axis=-1
    )
    values = basis(2, xi).T
    speed_square, area_square = (
        np.sum((vector @ values) ** 2, axis=1) for vector in (hodograph, cross)
    )
    speed = np.sqrt(speed_square)
    with np.errstate(all="ignore"):
        bending = area_square / (speed_square * speed_square * speed)
        return speed, np.nan_to_num(np.sqrt(area_square) / speed_square), np.nan_to_num(bending)


def _cross(a: Real, b: Real) -> Real:
    (x, y, z), (x_b, y_b, z_b) = np.moveaxis(a, -1, 0), np.moveaxis(b, -1, 0)
    return np.stack((y * z_b - z * y_b, z * x_b - x * z_b, x * y_b - y * x_b), axis=-1)


def _sampled_turning(hodograph: Real) -> Real:
    """Sum (N,) of the angles between successive tangents at equal steps of xi."""
    tangents = hodograph @ basis(2, np.linspace(0.0, 1.0, _SAMPLES + 1)).T
    before, after = tangents[..., :-1], tangents[..., 1:]
    dot = np.sum(before * after, axis=1)
    size = np.sqrt(np.sum(before * before, axis=1) * np.sum(after * after, axis=1))
    with np.errstate(all="ignore"):
        cosine = np.nan_to_num(dot / size, nan=1.0)
    return np.asarray(np.sum(np.arccos(np.clip(cosine, -1.0, 1.0)), axis=-1))
