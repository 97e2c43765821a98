# SPDX-License-Identifier: MIT
"""Derivatives of a curve by arc length, for each axis, in the plane or in space; docs/theory/feed.md 5.6. Used by most
modules of host_tools. No I/O.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..native.ph_chain import PhChain
from .arclength import Index
from .bernstein import Real

LEFT, RIGHT = -1, 1
"""Sides of a joint of segments: PH quintic splines are C2, the slope of the curvature jumps there."""

_AT_JOINT = 1e-9
"""Distance in the curve parameter within which a place counts as the joint."""
_CLOSE = 1e-11
"""Tolerance of the curve parameter of a place."""


@dataclass(frozen=True, eq=False)
class Frames:
    """r_s, r_ss and r_sss (A, …), the axis first, at points of any shape (…,), and the curvature (…,) there; mm.

    The curvature is signed in the plane, positive to the left, and a magnitude in space.
    """

    r1: Real
    r2: Real
    r3: Real
    curvature: Real


class Curve(Protocol):
    """A chain of segments with xi in [0, 1], which A axes follow: PHSpline, SpatialPHSpline."""

    @property
    def axes(self) -> int:
        """A: how many axes follow it."""

    @property
    def closed(self) -> bool:
        """Whether the end is the start."""

    @property
    def segment_count(self) -> int:
        """N."""

    @property
    def segment_starts_mm(self) -> Real:
        """Arc length (N + 1,) at the joints, 0 first, `length_mm` last."""

    @property
    def length_mm(self) -> float:
        """Arc length of the whole path."""

    def locate(self, s_mm: ArrayLike, tolerance: float = ...) -> tuple[Index, Real]:
        """Segment and xi at arc lengths."""

    def frames_at(self, segment: Index, xi: Real) -> Frames:
        """The frames of segments at xi, both of any one shape."""


def frames_of(chain: PhChain, segment: Index, xi: Real) -> Frames:
    """The frames of segments of a chain at xi, both of any one shape."""
    *vectors, curvature = chain.frames(np.ravel(segment), np.ravel(xi))
    r1, r2, r3 = (one.reshape(one.shape[0], *np.shape(xi)) for one in vectors)
    return Frames(r1, r2, r3, curvature.reshape(np.shape(xi)))


def frames(curve: Curve, s_mm: Real, side: NDArray[np.int8] | None = None) -> Frames:
    """At arc lengths `s_mm` (any shape); at joints those of the segment to the LEFT or RIGHT, by `side`."""
    segment, xi = curve.locate(np.clip(s_mm, 0.0, curve.length_mm), _CLOSE)
    if side is not None:
        back = (xi < _AT_JOINT) & (side == LEFT) & (segment > 0)
        on = (xi > 1.0 - _AT_JOINT) & (side == RIGHT) & (segment < curve.segment_count - 1)
        segment = segment - back + on
        xi = np.where(back, 1.0, np.where(on, 0.0, xi))
    return curve.frames_at(segment, xi)
