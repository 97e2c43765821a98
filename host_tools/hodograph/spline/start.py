# SPDX-License-Identifier: MIT
"""Starting values: a continuous square root of the guiding curve's hodograph; docs/numerics.md 3."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .bernstein import Complex, Real, halves, rotation


@dataclass(frozen=True)
class Branch:
    """Tangent angle (rad) of the guide, followed continuously: at the nodes (M + 1,), mid-span (M,)."""

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
