# SPDX-License-Identifier: MIT
"""Starting values: continuous square root of the guide's hodograph; docs/theory/numerics.md 3.1. Used by spline/build.
No I/O.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .bernstein import Complex, Real, halves, rotation

_REST = 1e-6
"""Share of the size of a hodograph up to which it counts as 0 at a joint."""
_NUDGE = 1e-3
"""Share of that size by which a hodograph that is 0 is moved aside."""


def without_rests(hodograph: Complex, closed: bool) -> Complex:
    """The hodograph (M, 3) with zeros at the joints moved aside by a thousandth, to the left.

    A guide that stops and reverses exactly at a joint has no tangent there. For quality and starting values only, never
    for end tangents.
    """
    before = hodograph if closed else hodograph[:-1]
    after = np.roll(hodograph, -1, axis=0) if closed else hodograph[1:]
    size = np.abs(before[:, 1]) + np.abs(after[:, 1])
    rests = np.flatnonzero(np.abs(after[:, 0]) <= _REST * size)
    if rests.size == 0:
        return hodograph
    out = hodograph.copy()
    direction = before[rests, 1] - after[rests, 1]
    direction = np.where(direction == 0.0, 1.0, direction)
    out[rests, 2] = _NUDGE * size[rests] * 1j * direction / np.abs(direction)
    out[(rests + 1) % hodograph.shape[0], 0] = out[rests, 2]
    return out


@dataclass(frozen=True)
class Branch:
    """Tangent angle (rad) of the guide, followed: at the nodes (M + 1,), mid-span (M,)."""

    node_angle: Real
    middle_angle: Real


def followed_branch(hodograph: Complex) -> Branch:
    """Lifted tangent angle of a C1 piecewise quadratic hodograph (M, 3)."""
    first, second = halves(hodograph)
    half_turns = np.stack((rotation(first), rotation(second)), axis=-1)
    lifted = np.cumsum(half_turns.ravel()) + np.angle(hodograph[0, 0])
    start = np.angle(hodograph[0, :1])
    return Branch(np.concatenate((start, lifted[1::2])), lifted[0::2])


def root_on_branch(value: Complex, angle: Real) -> Complex:
    """sqrt(value) on the sheet where arg(value) is nearest to the lifted `angle`."""
    root = np.sqrt(value)
    sheet = np.rint((angle - np.angle(value)) / (2.0 * np.pi))
    return np.asarray(np.where(sheet % 2.0 == 0.0, root, -root))


def starting_values(hodograph: Complex, branch: Branch) -> Complex:
    """z (M,): w of the guide at mid-span."""
    middle = (hodograph[:, 0] + 2.0 * hodograph[:, 1] + hodograph[:, 2]) / 4.0
    return root_on_branch(middle, branch.middle_angle)
