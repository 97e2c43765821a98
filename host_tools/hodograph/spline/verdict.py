# SPDX-License-Identifier: MIT
"""The acceptance test of a spline: a converged solution must have no loop and no cusp that its guide curve lacks.

docs/theory/numerics.md 3.5. Used by spline/solve.py for each solution that it finds, and by spatial/quality.py. No
I/O; pure functions, except that `compared` changes an argument.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .bernstein import Complex, Real, square_modulus
from .quality import Shape

EXTRA_TURNING_RAD = 1.25 * np.pi
"""A window of three spans has a loop that the guide curve lacks if its total turning exceeds the guide's by more."""
_TIGHT = 1e3
"""A span with more bending energy times length (no unit) is refused if it also exceeds _TIGHTER_THAN_GUIDE."""
_TIGHTER_THAN_GUIDE = 1e2
"""Ratio of the spline's bending energy to the guide's in a span."""
_CUSP = 1e6
"""A span with more bending energy times length is refused, whatever the guide has."""
_STRAIGHT = 1e-6
"""Bending energy times length of an arc of 1e-3 rad. A guide with less counts as straight. A guide that reverses on a
straight line has less too, because no sample is at the place where it reverses.
"""


@dataclass(frozen=True)
class Verdict:
    """Figures of a solution compared with its guide.

    extra_turning_rad   greatest excess of total turning over the guide's in a window of three spans; only windows with
                        at least as much bending energy as the guide count
    bending_ratio       bending energy of the whole spline over that of its guide; 1 for a straight guide (_STRAIGHT)
    loops               middle spans of windows with a loop that the guide lacks; the worst first
    cusps               spans that turn on the spot; the worst first
    """

    extra_turning_rad: float
    bending_ratio: float
    loops: tuple[int, ...]
    cusps: tuple[int, ...]

    @property
    def problem(self) -> str:
        """Empty for an acceptable solution, else what is wrong, naming the span."""
        if self.cusps:
            return f"span {self.cusps[0]} would turn on the spot (a cusp)"
        if self.loops:
            return f"span {self.loops[0]} would make a loop of its own"
        return ""


def judge(w: Complex, guide_shape: Shape, closed: bool) -> Verdict:
    """Compares a spline, given by its preimages w (M, 3), with its guide."""
    shape = Shape(w, 2)
    extra = _extra_turning(shape, guide_shape, closed)
    length = square_modulus(w).mean(axis=-1)
    return compared(shape.bending, guide_shape.bending, extra, length, closed)


def compared(own: Real, guide: Real, extra: Real, length: Real, closed: bool) -> Verdict:
    """The verdict from figures (M,): bending energies of spline (`own`) and guide, turning of each window beyond the
    guide's, and length of each span. Sets `extra` to 0 in windows that bend less than the guide.
    """
    total = float(guide.sum())
    bent = total * float(length.sum()) > _STRAIGHT
    ratio = float(own.sum()) / total if bent else 1.0
    extra[windows(own, closed) < windows(guide, closed)] = 0.0
    return Verdict(
        max(float(extra.max()), 0.0),
        ratio,
        _worst_first(extra, extra > EXTRA_TURNING_RAD),
        _worst_first(own, _turns_on_the_spot(own * length, guide * length)),
    )


def _worst_first(size: Real, chosen: NDArray[np.bool_]) -> tuple[int, ...]:
    """Chosen spans in the order of falling size."""
    found = np.flatnonzero(chosen)
    return tuple(int(k) for k in found[np.argsort(-size[found], kind="stable")])


def _extra_turning(shape: Shape, guide_shape: Shape, closed: bool) -> Real:
    """Total turning (M,) of each window beyond the guide's; all 0 if a quick bound shows that no window has a loop."""
    bound = windows(shape.most_turning, closed)
    if float(bound.max()) <= EXTRA_TURNING_RAD:
        return np.zeros(bound.size)
    return windows(shape.total_turning - guide_shape.total_turning, closed)


def windows(figure: Real, closed: bool) -> Real:
    """Sums (M,) of a figure over windows: each span and the spans next to it."""
    if figure.size < 3:
        return np.full(figure.size, figure.sum())
    before, after = np.roll(figure, 1), np.roll(figure, -1)
    if not closed:
        before[0] = after[-1] = 0.0
    return np.asarray(before + figure + after)


def _turns_on_the_spot(own: Real, guide: Real) -> NDArray[np.bool_]:
    """Whether each span has a cusp, from bending energy times length (no unit) of spline and guide."""
    return np.asarray(
        (own > _CUSP) | ((own > _TIGHT) & (own > _TIGHTER_THAN_GUIDE * guide)) | ~np.isfinite(own)
    )
