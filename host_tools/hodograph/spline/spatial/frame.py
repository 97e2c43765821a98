# SPDX-License-Identifier: MIT
"""The frame of a guide curve: roots of its hodograph without twist between spans; docs/theory/spatial-splines.md 3.

It fixes the freedom that interpolation leaves, and gives the starting values of Newton's method.

Used by spatial/build. No I/O.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..bernstein import Real, basis
from .quaternion import phase_between, root, turned

_SAMPLES = 8
"""Number of places on a span at which the guide's tangent is followed; the middle one is at xi = 1/2."""

_LEAST_SPEED = 1e-3
"""Least speed of a starting value at mid-span, as a share of the chord, if the guide nearly stops there."""

_REST, _NUDGE = 1e-6, 1e-3


@dataclass(frozen=True, eq=False)
class Frame:
    """Roots (M, 4) at mid-span and (4,) of the end derivatives; the phase (rad) from the last on to the first."""

    middle: Real
    start: Real
    end: Real
    phase: float


def guide_frame(hodograph: Real, chords: Real) -> Frame:
    """From the guide's hodograph (M, 3, 3) and chords (M, 3), both by the parameter.

    Each root is turned in its fibre to be nearest to the one before. Its sign is that of the root that follows the
    guide's tangent from sample to sample, since the tangent may turn by more than half a turn between two mid-spans.
    """
    tangents = _samples(hodograph)
    followed = _followed(tangents)
    at = np.arange(hodograph.shape[0]) * _SAMPLES + _SAMPLES // 2
    own = root(_not_slow(tangents[at], chords))
    steps = _step(own[1:], own[:-1], np.diff(followed[at]))
    phase = np.concatenate(([0.0], np.cumsum(steps)))
    middle = turned(own, phase)
    begin, end = root(tangents[[0, -1]])
    after = phase[-1] + _step(end, own[-1], followed[-1] - followed[at[-1]])
    around = followed[-1] + phase_between(begin, end) + followed[at[0]] - followed[at[-1]]
    return Frame(
        middle,
        turned(begin, _step(begin, own[0], followed[0] - followed[at[0]])),
        turned(end, after),
        float(phase[-1] + _step(own[0], own[-1], around)),
    )


def without_rests(hodograph: Real, closed: bool) -> Real:
    """The hodograph (M, 3, 3) with zeros at the joints moved aside by a thousandth, to the left as seen from above.

    A guide that stops and reverses exactly at a joint has no tangent there. For quality and starting values only.
    """
    before = hodograph if closed else hodograph[:-1]
    after = np.roll(hodograph, -1, axis=0) if closed else hodograph[1:]
    size = np.linalg.norm(before[..., 1], axis=-1) + np.linalg.norm(after[..., 1], axis=-1)
    rests = np.flatnonzero(np.linalg.norm(after[..., 0], axis=-1) <= _REST * size)
    if rests.size == 0:
        return hodograph
    out = hodograph.copy()
    direction = before[rests, :, 1] - after[rests, :, 1]
    aside = np.stack((-direction[:, 1], direction[:, 0], np.zeros(rests.size)), axis=-1)
    aside[~aside.any(axis=1)] = (1.0, 0.0, 0.0)
    aside *= (_NUDGE * size[rests] / np.linalg.norm(aside, axis=1))[:, None]
    out[rests, :, 2] = out[(rests + 1) % hodograph.shape[0], :, 0] = aside
    return out


def _samples(hodograph: Real) -> Real:
    """Tangents (8 M + 1, 3) along the guide; where its speed is 0, the one before, or the first one that exists."""
    xi = np.arange(_SAMPLES) / _SAMPLES
    inner = np.moveaxis(hodograph @ basis(2, xi).T, 1, 2).reshape(-1, 3)
    tangents = np.concatenate((inner, hodograph[-1:, :, 2]))
    stands = ~tangents.any(axis=1)
    if not stands.any():
        return tangents
    last = np.maximum.accumulate(np.where(stands, -1, np.arange(stands.size)))
    first = int(np.argmin(stands))
    return tangents[np.where(last < 0, first, last)]


def _followed(tangents: Real) -> Real:
    """Phases (n,) that turn the root of each tangent to be nearest to the one before."""
    roots = root(tangents)
    return np.concatenate(([0.0], np.cumsum(phase_between(roots[1:], roots[:-1]))))


def _step(to: Real, origin: Real, meant: Real) -> Real:
    """Phase from `origin` to the nearest of the fibre of `to`, or to its negative, whichever is nearer to `meant`."""
    phase = phase_between(to, origin)
    return np.asarray(phase + np.pi * np.rint((meant - phase) / np.pi))


def _not_slow(middle: Real, chords: Real) -> Real:
    """`middle`, no slower than a share of its chord."""
    size = np.linalg.norm(middle, axis=-1, keepdims=True)
    least = _LEAST_SPEED * np.linalg.norm(chords, axis=-1, keepdims=True)
    return np.asarray(middle * np.maximum(1.0, least / size))
