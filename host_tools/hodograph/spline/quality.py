# SPDX-License-Identifier: MIT
"""How good a solution is: turning of the tangent and bending energy; docs/numerics.md 3.2."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .bernstein import (
    Complex,
    Real,
    basis,
    factor_angles,
    restricted,
    rotation,
    square,
    square_modulus,
)
from .extremum import curvature_numerator


def _rule(points: int, panels: int) -> tuple[Real, Real]:
    """Abscissae and weights on [0, 1] of composite Gauss-Legendre quadrature."""
    nodes, weights = np.polynomial.legendre.leggauss(points)
    xi = (np.arange(panels)[:, None] + (nodes + 1.0) / 2.0) / panels
    return xi.ravel(), np.tile(weights / (2.0 * panels), panels)


_SMOOTH_XI, _SMOOTH_WEIGHTS = _rule(6, 1)
_SHARP_XI, _SHARP_WEIGHTS = _rule(16, 8)


def turning(w: Complex) -> Real:
    """Net tangent turning (rad, not modulo 2 pi) of each span with w (N, 3): twice that of w."""
    first, second = factor_angles(w)
    return 2.0 * (first + second)


def sharpest_factor(w: Complex) -> Real:
    """Greatest turning (rad) that one of the two roots of w causes; near 2 pi close to a cusp."""
    first, second = factor_angles(w)
    return 2.0 * np.maximum(np.abs(first), np.abs(second))


def total_turning(quadratic: Complex) -> Real:
    """Integral of |d arg| (rad) over each span: turning to the left and to the right both count.

    The direction of turning changes at the zeros of Im(conj(w) w'), a quadratic.
    """
    first, middle, last = np.moveaxis(curvature_numerator(quadratic), -1, 0)
    b, a = 2.0 * (middle - first), last - 2.0 * middle + first
    root = np.sqrt(np.maximum(b * b - 4.0 * a * first, 0.0))
    plus = np.where(b >= 0.0, b + root, b - root)
    with np.errstate(all="ignore"):
        zeros = np.stack((-plus / (2.0 * a), -2.0 * first / plus))
    zeros = np.sort(np.clip(np.where(np.isfinite(zeros), zeros, 0.0), 0.0, 1.0), axis=0)
    begin, end = np.zeros_like(first), np.ones_like(first)
    out = np.zeros_like(first)
    for low, high in ((begin, zeros[0]), (zeros[0], zeros[1]), (zeros[1], end)):
        out = out + np.abs(rotation(restricted(quadratic, low, high)))
    return np.asarray(out)


def most_turning(w: Complex) -> Real:
    """Quick upper bound (rad) of twice total_turning: a root turns the tangent one way only."""
    first, second = factor_angles(w)
    return np.asarray(2.0 * (np.abs(first) + np.abs(second)))


def bending(w: Complex) -> Real:
    """Integral of curvature^2 over arc length (1/mm) of each PH span with w (N, 3)."""
    return _bending(square(w), _sharp(w))


def guide_bending(hodograph: Complex) -> Real:
    """The same of cubic spans with hodograph (N, 3)."""
    return _bending(hodograph, _sharp(hodograph))


def _sharp(quadratic: Complex) -> NDArray[np.bool_]:
    """Spans with a root so close that its factor turns by more than 45 degrees."""
    first, second = factor_angles(quadratic)
    return np.asarray(np.maximum(np.abs(first), np.abs(second)) > np.pi / 4.0)


def _bending(hodograph: Complex, sharp: NDArray[np.bool_]) -> Real:
    """Gauss quadrature of 6 points; 8 panels of 16 points for sharp spans.

    A figure of merit: good to several digits except next to a cusp, where it is huge anyway.
    """
    out = _quadrature(hodograph, _SMOOTH_XI, _SMOOTH_WEIGHTS)
    if sharp.any():
        out[sharp] = _quadrature(hodograph[sharp], _SHARP_XI, _SHARP_WEIGHTS)
    return out


def _quadrature(hodograph: Complex, xi: Real, weights: Real) -> Real:
    degree = hodograph.shape[1] - 1
    slope = degree * (hodograph[:, 1:] - hodograph[:, :-1])
    value = hodograph @ basis(degree, xi).T
    derivative = slope @ basis(degree - 1, xi).T
    cross = value.real * derivative.imag - value.imag * derivative.real
    square_speed = value.real * value.real + value.imag * value.imag
    with np.errstate(all="ignore"):
        density = cross * cross / (square_speed * square_speed * np.sqrt(square_speed))
    return np.asarray(density @ weights)


def tightness(w: Complex) -> Real:
    """Bending energy times length of spans with w (N, 3): no unit, turning^2 for a circle."""
    return np.asarray(bending(w) * square_modulus(w).mean(axis=-1))
