# SPDX-License-Identifier: MIT
"""Removes loops by passing a near-cusp on the other side; docs/theory/numerics.md 3.3. Used by solve.py.

Where the guide nearly stops, rounding decides the branch of the continuous square root: the tangent may turn by a or by
a - 2 pi. The two choices differ in the sign of all z after that place, and their influence decays within a few spans.
So each sharply turning span is solved again on a window around it, with the sign changed before it or after it. The
choice with the least bending energy is kept.

No I/O.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .bernstein import Complex, Real, square_modulus
from .newton import newton
from .quality import Shape
from .system import EndRule, System, coefficients_between

_SHARP_FACTOR = 1.3 * np.pi
"""Turning by one root of w, rad, above which a span is near that root."""
_SHARP_SPAN = 1.25 * np.pi
"""Turning of a span, rad, above which it is chosen without a comparison."""
_STRAYED = 0.5 * np.pi
"""Difference of the turning angles of a span near a root and of its guide, rad, above which it is chosen."""
_TIGHT = 100.0
"""Bending energy times length above which a span near a root is chosen."""
_REACH = 8
"""Spans on each side of the chosen one that are solved again with it."""
_GAIN = 0.8
"""A change is taken if it reduces the energy below this share."""
_PASSES = 3
"""Greatest number of passes over the suspect spans."""
_MOST_STEPS = 12
"""Greatest number of Newton steps for a window."""


@dataclass(frozen=True)
class Unlooped:
    """System (its end signs may have changed), solution, changes made, trial steps."""

    system: System
    z: Complex
    changes: int
    iterations: int


def suspects(w: Complex, guide_turning: Real) -> list[int]:
    """Spans for which the other side has to be tried, the sharpest turn first.

    These are spans that turn by more than 225 degrees. In addition, spans near a root of w if they turn by 90 degrees
    more or less than the guide, or if bending energy times length exceeds 100 (ten times that of an even half turn).
    """
    shape = Shape(w, 2)
    sharp, turned = shape.sharpest, np.abs(shape.turning)
    chosen = turned > _SHARP_SPAN
    near = np.flatnonzero(sharp > _SHARP_FACTOR)
    if near.size:
        strayed = np.abs(shape.turning[near] - guide_turning[near]) > _STRAYED
        length = square_modulus(w[near]).mean(axis=-1)
        chosen[near] |= strayed | (Shape(w[near], 2).bending * length > _TIGHT)
    found = np.flatnonzero(chosen)
    order = np.argsort(-np.maximum(sharp, turned)[found], kind="stable")
    return [int(k) for k in found[order]]


def without_loops(system: System, z: Complex, guide_turning: Real) -> Unlooped:
    """Try the other side at every suspect span of the solution `z`, in up to three passes.

    The result is only near a solution, since windows are joined unchanged: polish it with `newton`.
    """
    changes = iterations = 0
    seen: set[int] = set()
    for _ in range(_PASSES):
        fresh = [k for k in suspects(system.coefficients(z), guide_turning) if k not in seen]
        changed_now = 0
        for span in fresh:
            seen.add(span)
            system, z, done, spent = _other_side(system, z, span, (span, span + 1))
            changed_now += done
            iterations += spent
        changes += changed_now
        if not changed_now:
            break
    return Unlooped(system, z, changes, iterations)


def without_remaining_loops(system: System, z: Complex, spans: Sequence[int]) -> Unlooped:
    """Try the other side at every joint within three spans of each of `spans`, one after the other."""
    changes = iterations = 0
    for span in spans:
        for first in range(span - 3, span + 5):
            system, z, done, spent = _other_side(system, z, span, (first,))
            changes += done
            iterations += spent
    return Unlooped(system, z, changes, iterations)


def flipped(system: System, z: Complex, first: int) -> tuple[System, Complex]:
    """Signs changed from z[first] on; the same for the end rule or the cyclic sign."""
    z = z.copy()
    z[first:] *= -1.0
    if system.cyclic_sign:
        return replace(system, cyclic_sign=-system.cyclic_sign), z
    return replace(system, end=replace(system.end, constant=-system.end.constant)), z


def _other_side(
    system: System, z: Complex, span: int, joints: Sequence[int]
) -> tuple[System, Complex, int, int]:
    low, high = max(span - _REACH, 0), min(span + _REACH + 1, z.size)
    best, energy = None, _energy(system, z, low, high)
    spent = 0
    for first in joints:
        if not 0 < first < z.size:
            continue
        other, candidate = flipped(system, z, first)
        outcome = newton(_window(other, candidate, low, high), candidate[low:high], _MOST_STEPS)
        spent += outcome.iterations
        if not outcome.converged:
            continue
        candidate[low:high] = outcome.z
        found = _energy(other, candidate, low, high)
        if found < _GAIN * energy:
            best, energy = (other, candidate), found
    if best is None:
        return system, z, 0, spent
    return best[0], best[1], 1, spent


def _window(system: System, z: Complex, low: int, high: int) -> System:
    """The equations of spans low … high - 1 with the z beyond them held."""
    if high - low == z.size:
        return system
    around = _around(system, z, low, high)
    is_open = not system.cyclic_sign
    start = system.start if low == 0 and is_open else _held(around[0])
    end = system.end if high == z.size and is_open else _held(around[-1])
    return system.part(low, high, start, end)


def _around(system: System, z: Complex, low: int, high: int) -> Complex:
    """z of spans low … high - 1 and one more on either side."""
    before, after = system.outer(z)
    first = z[low - 1] if low > 0 else before
    last = z[high] if high < z.size else after
    return np.concatenate(([first], z[low:high], [last]))


def _held(value: complex) -> EndRule:
    return EndRule(0.0, 0.0, complex(value))


def _energy(system: System, z: Complex, low: int, high: int) -> float:
    knots = None if system.knots is None else system.knots.part(low, high)
    w = coefficients_between(_around(system, z, low, high), knots)
    return float(Shape(w, 2).bending.sum())
