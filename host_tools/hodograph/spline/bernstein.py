# SPDX-License-Identifier: MIT
"""Small functions for polynomials in Bernstein form, vectorised over spans (last axis: coefficients). Used by spline/,
program/check and toolpath/fit/corners. No I/O.

Everything here is exact algebra on polynomials over [0, 1]; docs/theory/numerics.md section 4.
"""

from __future__ import annotations

from math import comb

import numpy as np
from numpy.typing import NDArray

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]


def basis(degree: int, xi: Real) -> Real:
    """Values of the Bernstein polynomials at `xi` (n,) as an array (n, degree + 1)."""
    out = np.empty((*xi.shape, degree + 1))
    rest = 1.0 - xi
    power = np.ones_like(xi)
    for k in range(degree + 1):
        out[..., k] = comb(degree, k) * power
        power = power * xi
    power = np.ones_like(xi)
    for k in range(degree, -1, -1):
        out[..., k] *= power
        power = power * rest
    return out


def square(w: Complex) -> Complex:
    """Coefficients (…, 5) of w^2 for quadratics `w` (…, 3)."""
    w0, w1, w2 = w[..., 0], w[..., 1], w[..., 2]
    return np.stack((w0 * w0, w0 * w1, (2.0 * w1 * w1 + w0 * w2) / 3.0, w1 * w2, w2 * w2), axis=-1)


def square_modulus(w: Complex) -> Real:
    """Coefficients (…, 5) of |w|^2 for quadratics `w` (…, 3); paper (9)."""
    u0, u1, u2 = w[..., 0].real, w[..., 1].real, w[..., 2].real
    v0, v1, v2 = w[..., 0].imag, w[..., 1].imag, w[..., 2].imag
    middle = (2.0 * (u1 * u1 + v1 * v1) + u0 * u2 + v0 * v2) / 3.0
    return np.stack(
        (u0 * u0 + v0 * v0, u0 * u1 + v0 * v1, middle, u1 * u2 + v1 * v2, u2 * u2 + v2 * v2),
        axis=-1,
    )


def halves(w: Complex) -> tuple[Complex, Complex]:
    """The quadratics `w` (…, 3) on [0, 1/2] and [1/2, 1] in their own [0, 1], by de Casteljau."""
    w0, w1, w2 = w[..., 0], w[..., 1], w[..., 2]
    left, right = (w0 + w1) / 2.0, (w1 + w2) / 2.0
    middle = (left + right) / 2.0
    return np.stack((w0, left, middle), axis=-1), np.stack((middle, right, w2), axis=-1)


def restricted(quadratic: Complex, low: Real, high: Real) -> Complex:
    """Quadratics (…, 3) on [low, high] (…,) in their own [0, 1]: values of the polar form."""
    q0, q1, q2 = quadratic[..., 0], quadratic[..., 1], quadratic[..., 2]
    low0, high0 = 1.0 - low, 1.0 - high
    start = low0 * low0 * q0 + 2.0 * low * low0 * q1 + low * low * q2
    middle = low0 * high0 * q0 + (low * high0 + high * low0) * q1 + low * high * q2
    end = high0 * high0 * q0 + 2.0 * high * high0 * q1 + high * high * q2
    return np.stack((start, middle, end), axis=-1)


def factor_angles(quadratic: Complex) -> tuple[Real, Real]:
    """Angles (rad) by which the two linear factors of quadratics (…, 3) turn over [0, 1].

    Each lies within (-pi, pi): [0, 1] seen from a root spans less than pi. A factor that is
    constant, or a quadratic that starts at 0, counts as 0. docs/theory/numerics.md 3.1.
    """
    c = quadratic[..., 0]
    b = 2.0 * (quadratic[..., 1] - c)
    a = quadratic[..., 2] - 2.0 * quadratic[..., 1] + c
    root = np.sqrt(b * b - 4.0 * a * c)
    # t = 1 / xi solves c t^2 + b t + a = 0, whose roots are finite when c is not 0; a factor of
    # the quadratic is then (1 - t xi), which turns from 1 to 1 - t.
    plus = np.where((np.conj(b) * root).real >= 0.0, b + root, b - root)
    with np.errstate(all="ignore"):
        t1 = np.where(c == 0.0, 0.0, -plus / (2.0 * c))
        t2 = np.where(plus == 0.0, 0.0, -2.0 * a / plus)
    return np.angle(1.0 - t1), np.angle(1.0 - t2)


def rotation(quadratic: Complex) -> Real:
    """Angle (rad, not modulo 2 pi) by which complex quadratics (…, 3) turn about 0."""
    first, second = factor_angles(quadratic)
    return np.asarray(first + second)
