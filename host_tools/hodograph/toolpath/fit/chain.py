# SPDX-License-Identifier: MIT
"""Joins lines, corner curves and splines to one curve of continuous curvature. Used by fit/fitting. No I/O.

docs/theory/toolpath-fitting.md section 5.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...errors import PlanError
from ...spline.spatial.curve import hodograph_of
from ...spline.spatial.quaternion import root
from .corners import SHAPES, corners

Real = NDArray[np.float64]

_STEPS = 8
"""Greatest number of Newton steps."""
_JOINED = 1e-12
"""Residual at which the chain counts as joined."""
_NEARLY = 1e-10
"""Residual above which the solution is refused after the last step."""
_LEAST_MM = 1e-9
"""A leg longer than this is a straight piece of its own."""


@dataclass(frozen=True, eq=False)
class Segments:
    """PH segments that belong to stretches of the reference, in any order.

    origin    (n, 3) start points
    end       (n, 3) end points
    preimage  (n, 4, 3)
    low, high (n,) places of the reference where they begin and end
    """

    origin: Real
    end: Real
    preimage: Real
    low: Real
    high: Real

    @staticmethod
    def joined(parts: Sequence[Segments]) -> Segments:
        """All segments of several sets."""
        names = ("origin", "end", "preimage", "low", "high")
        return Segments(
            *(np.concatenate([getattr(part, name) for part in parts]) for name in names)
        )

    def ordered(self) -> Segments:
        """These segments in the order of their places."""
        order = np.argsort(self.low, kind="stable")
        return Segments(
            self.origin[order],
            self.end[order],
            self.preimage[order],
            self.low[order],
            self.high[order],
        )


def with_lines(given: Segments, first: Real, last: Real, length_mm: float) -> Segments:
    """The segments, with straight lines in the gaps between them, from `first` (3,) at place 0 to `last` (3,) at
    `length_mm`.
    """
    own = given.ordered()
    begin = np.concatenate((first[None], own.end))
    end = np.concatenate((own.origin, last[None]))
    low = np.concatenate((np.zeros(1), own.high))
    high = np.concatenate((own.low, np.array([length_mm])))
    leg = end - begin
    gap = np.linalg.norm(leg, axis=1) > _LEAST_MM
    preimage = np.repeat(root(leg[gap])[:, :, None], 3, axis=2)
    lines = Segments(begin[gap], end[gap], preimage, low[gap], high[gap])
    return Segments.joined((lines, own)).ordered()


def corner_segments(
    vertex: Real,
    before: Real,
    after: Real,
    place: Real,
    rate: tuple[Real, Real],
    shape: int,
    size_mm: Real,
) -> Segments:
    """Corner curves of tolerance `size_mm` (n,) at vertices (n, 3) between legs with unit vectors (n, 3).

    place  (n,) of the vertices
    rate   (n,) each: change of the place per mm of the leg before, and of the leg after
    """
    across = after - np.sum(before * after, axis=1)[:, None] * before
    sine = np.linalg.norm(across, axis=1)
    across /= sine[:, None]
    turn = np.arctan2(sine, np.sum(before * after, axis=1))
    unit = corners(SHAPES[shape], turn)
    joint = unit.joint * size_mm[:, None]
    points = (
        vertex[:, None]
        + joint.real[:, :, None] * before[:, None]
        + joint.imag[:, :, None] * across[:, None]
    )
    w = unit.w * np.sqrt(size_mm)[:, None, None]
    level = (before[:, 2] == 0.0) & (after[:, 2] == 0.0)
    preimage = np.where(
        level[:, None, None, None], _level_preimage(w, before, across), _turned(w, before, across)
    )
    reach = (unit.reach * size_mm)[:, None]
    # The two middle joints are at the place of the vertex; the others at their distance along the legs.
    count = SHAPES[shape].segments
    at = np.abs(joint) / np.abs(joint[:, :1]) * reach
    at[:, count // 2] = 0.0
    at[:, : count // 2] *= -rate[0][:, None]
    at[:, count // 2 + 1 :] *= rate[1][:, None]
    places = place[:, None] + at
    return Segments(
        points[:, :-1].reshape(-1, 3),
        points[:, 1:].reshape(-1, 3),
        preimage.reshape(-1, 4, 3),
        places[:, :-1].ravel(),
        places[:, 1:].ravel(),
    )


def _level_preimage(w: NDArray[np.complex128], before: Real, across: Real) -> Real:
    """The preimages in a plane of constant z keep v = p = 0; turns to the right are mirrored."""
    left = before[:, 0] * across[:, 1] - before[:, 1] * across[:, 0] > 0.0
    along = np.sqrt(before[:, 0] + 1j * before[:, 1])
    flat = np.where(left[:, None, None], w, np.conj(w)) * along[:, None, None]
    zero = np.zeros_like(flat.real)
    return np.stack((flat.real, zero, zero, flat.imag), axis=2)


def _turned(w: NDArray[np.complex128], first: Real, second: Real) -> Real:
    """The preimages turned so that x becomes `first` and y `second` (n, 3)."""
    third = np.cross(first, second)
    (xx, yx, zx), (xy, yy, zy), (xz, yz, zz) = first.T, second.T, third.T
    # The quaternion is the eigenvector of the greatest eigenvalue of this symmetric matrix (Bar-Itzhack 2000).
    rows = (
        (xx + yy + zz, zy - yz, xz - zx, yx - xy),
        (zy - yz, xx - yy - zz, xy + yx, xz + zx),
        (xz - zx, xy + yx, yy - xx - zz, yz + zy),
        (yx - xy, xz + zx, yz + zy, zz - xx - yy),
    )
    form = np.moveaxis(np.array(rows), 2, 0)
    a, b, c, d = np.linalg.eigh(form)[1][:, :, -1].T[:, :, None, None]
    u, q = w.real, w.imag
    # (a + b i + c j + d k)(u + q k)
    return np.stack((a * u - d * q, b * u + c * q, c * u - b * q, d * u + a * q), axis=2)


def straightened(preimage: Real, spans: Real, direction: Real) -> Real:
    """The first three segments (3, 4, 3) of a spline changed so that it leaves a straight line with curvature 0.

    spans      (3,) lengths of their parameter in the spline, which has continuous second derivatives
    direction  (3,) unit vector of the line
    Start, end and everything after the end stay the same. Raises PlanError: there is no such curve nearby.
    """
    size = np.sqrt(spans)[:, None]
    chord = hodograph_of(preimage).mean(axis=2).sum(axis=0)
    level = bool(np.all(preimage[:, 1:3] == 0.0) and direction[2] == 0.0)
    rows = [0, 3] if level else [0, 1, 2, 3]
    first, second = spans[0] / (spans[0] + spans[1]), spans[1] / (spans[1] + spans[2])
    own = (preimage / size[:, :, None]).copy()

    def assembled(free: Real) -> Real:
        """Segments (m, 3, 4, 3) from values of A at the start, and its coefficients on the first two spans: the columns
        of `free` (m, 4, 3).
        """
        out = np.repeat(own[None], free.shape[0], axis=0)
        begin, one, two = free[:, :, 0], free[:, :, 1], free[:, :, 2]
        middle = (1.0 - first) * one + first * two
        out[:, 0] = np.stack((begin, one, middle), axis=2)
        out[:, 1, :, 0], out[:, 1, :, 1] = middle, two
        out[:, 1, :, 2] = out[:, 2, :, 0] = (1.0 - second) * two + second * own[2, :, 1]
        return out * size[:, :, None]

    aside = _across(direction)

    def residual(free: Real) -> Real:
        """Residuals (m, 7) of the conditions."""
        hodograph = hodograph_of(assembled(free))
        missing = (hodograph.mean(axis=3).sum(axis=1) - chord) / np.linalg.norm(chord)
        here, beside = hodograph[:, 0, :, 0], hodograph[:, 0, :, 1]
        speed = np.linalg.norm(here, axis=1)[:, None]
        return np.concatenate((missing, here @ aside / speed, beside @ aside / speed), axis=1)

    free = np.stack((own[0, :, 0], own[0, :, 1], own[1, :, 1]), axis=1)
    step = 1e-6 * float(np.abs(free).max())
    changes = np.zeros((3 * len(rows), 4, 3))
    for k, row in enumerate(rows):
        changes[3 * k + np.arange(3), row, np.arange(3)] = step
    value = residual(free[None])[0]
    for _ in range(_STEPS):
        if float(np.abs(value).max()) <= _JOINED:
            break
        both = residual(np.concatenate((free + changes, free - changes)))
        slope = (both[: len(changes)] - both[len(changes) :]) / (2.0 * step)
        found = np.linalg.lstsq(slope.T, -value, rcond=1e-9)[0]
        free[rows] += found.reshape(-1, 3)
        value = residual(free[None])[0]
    if not float(np.abs(value).max()) <= _NEARLY:
        raise PlanError("no curve joins a straight line")
    return np.asarray(assembled(free[None])[0])


def _across(direction: Real) -> Real:
    """Two unit vectors as columns (3, 2) at right angles to a unit vector and to each other."""
    first = np.cross(direction, np.eye(3)[np.argmin(np.abs(direction))])
    first /= np.linalg.norm(first)
    return np.stack((first, np.cross(direction, first)), axis=1)
