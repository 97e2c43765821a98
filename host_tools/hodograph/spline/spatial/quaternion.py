# SPDX-License-Identifier: MIT
"""Quaternion arithmetic for PH curves in space: a quaternion polynomial A gives the derivative r' = A i A* of a curve;
A is a preimage of r' (docs/theory/spatial-splines.md section 2).

A quaternion A = u + v i + p j + q k is an array (…, 4) of u, v, p, q; a vector is (…, 3). All A e^(i phi) have the same
r'; they are the fibre of A.

Used by spline/spatial, program/check and fit/chain. No I/O.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..bernstein import Real


def left(a: Real) -> Real:
    """Matrices (…, 3, 4) with left(a) b = (a i b* + b i a*) / 2, the symmetric bilinear form of a i a*."""
    u, v, p, q = _components(a)
    out = np.empty((*a.shape[:-1], 3, 4))
    out[..., 0, 0], out[..., 0, 1], out[..., 0, 2], out[..., 0, 3] = u, v, -p, -q
    out[..., 1, 0], out[..., 1, 1], out[..., 1, 2], out[..., 1, 3] = q, p, v, u
    out[..., 2, 0], out[..., 2, 1], out[..., 2, 2], out[..., 2, 3] = -p, q, -u, v
    return out


def polar(a: Real, b: Real) -> Real:
    """(a i b* + b i a*) / 2 (…, 3): symmetric, bilinear, a i a* for a = b."""
    x, y, z = polar_of(_components(a), _components(b))
    out = np.empty((*x.shape, 3))
    out[..., 0], out[..., 1], out[..., 2] = x, y, z
    return out


def polar_of(a: Real | Sequence[Real], b: Real | Sequence[Real]) -> tuple[Real, Real, Real]:
    """The same by component: x, y and z from u, v, p, q of both."""
    u, v, p, q = a
    u_b, v_b, p_b, q_b = b
    return (
        (u * u_b + v * v_b) - (p * p_b + q * q_b),
        (u * q_b + q * u_b) + (v * p_b + p * v_b),
        (v * q_b + q * v_b) - (u * p_b + p * u_b),
    )


def _components(a: Real) -> tuple[Real, Real, Real, Real]:
    """u, v, p, q. For few quaternions np.moveaxis would take longer than the computation."""
    return a[..., 0], a[..., 1], a[..., 2], a[..., 3]


def along_fibre(a: Real) -> Real:
    """a i (…, 4): the direction in which a turns without changing a i a*."""
    return np.stack((-a[..., 1], a[..., 0], a[..., 3], -a[..., 2]), axis=-1)


def across_fibre(a: Real) -> Real:
    """Matrices (…, 4, 3) with columns a, a j, a k: the three directions that are orthogonal to a i."""
    u, v, p, q = _components(a)
    by_j, by_k = np.stack((-p, -q, u, v), axis=-1), np.stack((-q, p, -v, u), axis=-1)
    return np.stack((a, by_j, by_k), axis=-1)


def turned(a: Real, phi: Real | float) -> Real:
    """a e^(i phi), for angles `phi` (…,) in rad."""
    angle = np.asarray(phi)[..., None]
    return np.asarray(np.cos(angle) * a + np.sin(angle) * along_fibre(a))


def root(vector: Real) -> Real:
    """One quaternion (…, 4) with a i a* = `vector` (…, 3); 0 for 0.

    The greater of u^2 + v^2 and p^2 + q^2 is made real, so no direction is special. A vector with z = 0 has v = p = 0:
    (u, q) is then a square root of the complex number x + iy.
    """
    x, y, z = np.moveaxis(vector, -1, 0)
    great = np.sqrt((np.sqrt(x * x + y * y + z * z) + np.abs(x)) / 2.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        small_y = np.where(great > 0.0, y / (2.0 * great), 0.0)
        small_z = np.where(great > 0.0, z / (2.0 * great), 0.0)
    # exactly along y or z: the two parts are the same number, so that x of the curve stays 0 to the last bit
    small_y = np.where((x == 0.0) & (z == 0.0), np.copysign(great, y), small_y)
    small_z = np.where((x == 0.0) & (y == 0.0), np.copysign(great, z), small_z)
    zero = np.zeros_like(great)
    forward = np.stack((great, zero, -small_z, small_y), axis=-1)
    backward = np.stack((small_y, small_z, zero, great), axis=-1)
    return np.where((x >= 0.0)[..., None], forward, backward)


def phase_between(a: Real, b: Real) -> Real:
    """Angle (rad) by which `a` (…, 4) is turned in its fibre to be nearest to `b`; 0 where all are equally near."""
    return np.asarray(np.arctan2(np.sum(along_fibre(a) * b, axis=-1), np.sum(a * b, axis=-1)))
