# SPDX-License-Identifier: MIT
"""Proves that each point of a curve is within a bound of the programmed path, and each point of the path within it of
the curve. Used by fit/fitting and fit/turning. No I/O.

docs/theory/toolpath-fitting.md section 6. Chords with an error bound replace the curve. The distance of a point from a
chord is convex, so a whole chord is no farther from another chord than the farther one of its ends. Chords whose bound
exceeds the tolerance are halved.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...spline.spatial import SpatialPHSpline
from .reference import Reference, distance_to_chord

Real = NDArray[np.float64]
Index = NDArray[np.intp]

_CHORD_SHARE = 0.005
"""Distance of the curve from its chords, as a share of the tolerance."""
_MOST_PIECES = 4096
"""Greatest number of chords of a segment."""
_HALVINGS = 16
"""How often chords that are too far from the other path are halved before their distance counts."""
_BESIDE = (2, 6, 6, 24)
"""Chords on either side of the nearest one found that are compared, at first and after each of the first halvings;
later 6. In noise, places of two chains correspond only roughly.
"""

_MOST_PAIRS = 100_000
"""Pairs of chords that are compared at once."""

_SURE = 4
"""Halvings after which the compared chords certainly include the nearest one."""

ROUNDING_MM = 5e-6
"""Allowance of 5 nm for the rounding of a program (2^-34 mm), of its kernel (1 nm) and of this proof."""


@dataclass(frozen=True, eq=False)
class Chords:
    """Chords between points (n, 3) with errors of at most `error_mm` (n,), at places (n + 1,) in the measure of the
    other chain.
    """

    start: Real
    end: Real
    error_mm: Real
    place_mm: Real


@dataclass(frozen=True, eq=False)
class Certificate:
    """Bounds of the distance, mm.

    curve      (segments,) from each segment of the curve to the programmed path
    reference  (chords,) from each chord of the programmed path to the curve
    """

    curve: Real
    reference: Real

    @property
    def worst_mm(self) -> float:
        """Bound for both paths."""
        return float(max(self.curve.max(), self.reference.max())) + ROUNDING_MM


def certify(
    curve: SpatialPHSpline, place_mm: Real, reference: Reference, tolerance_mm: float
) -> Certificate:
    """Bounds of the distance between curve and reference, fine enough to compare it with `tolerance_mm`.

    place_mm  (segments + 1,) rising places of the reference that belong to the joints of the curve
    """
    inside = np.diff(np.searchsorted(reference.place_mm, place_mm))
    fine, segment = _curve_chords(curve, place_mm, inside, _CHORD_SHARE * tolerance_mm)
    programmed, chord = _reference_chords(reference, fine.place_mm)
    to_reference = _directed(fine, programmed, tolerance_mm)
    to_curve = _directed(programmed, fine, tolerance_mm)
    by_segment, by_chord = np.zeros(curve.segment_count), np.zeros(reference.count)
    np.maximum.at(by_segment, segment, to_reference)
    np.maximum.at(by_chord, chord, to_curve)
    return Certificate(by_segment, by_chord)


def _curve_chords(
    curve: SpatialPHSpline, place_mm: Real, least: Index, error_mm: float
) -> tuple[Chords, Index]:
    """Chords of the curve, `least` (segments,) of each segment or more, and the segment of each.

    A chord over a share h of xi is off by at most h^2 / 8 times the greatest |r''|.
    """
    bend = 4.0 * np.diff(curve.hodograph_coefficients, axis=2)
    most = np.sqrt(np.sum(bend * bend, axis=1)).max(axis=1)
    pieces = np.clip(np.ceil(np.sqrt(most / (8.0 * error_mm))), 1, _MOST_PIECES).astype(np.intp)
    pieces = np.maximum(pieces, least)
    segment = np.repeat(np.arange(pieces.size), pieces)
    inner = np.arange(segment.size) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    share = 1.0 / pieces[segment]
    begin, end = inner * share, (inner + 1) * share
    width = np.diff(place_mm)[segment]
    passed = curve.arc_length(segment, begin) / curve.segment_lengths_mm[segment]
    place = np.append(place_mm[segment] + width * passed, place_mm[-1])
    return (
        Chords(
            curve.position(segment, begin),
            curve.position(segment, np.minimum(end, 1.0)),
            (most / 8.0)[segment] * share**2,
            place,
        ),
        segment,
    )


def _reference_chords(reference: Reference, places: Real) -> tuple[Chords, Index]:
    """The chords of the reference cut at `places`, and for each the chord that it is a part of."""
    own = reference.place_mm
    cut = np.unique(np.concatenate((own, places[(places > 0.0) & (places < own[-1])])))
    chord = np.clip(np.searchsorted(own, cut[:-1], side="right") - 1, 0, reference.count - 1)
    along = np.diff(reference.point, axis=0)[chord]
    length = reference.length_mm[chord]
    ends = []
    for at in (cut[:-1], cut[1:]):
        share = np.clip((at - own[chord]) / length, 0.0, 1.0)
        point = reference.point[chord] + share[:, None] * along
        ends.append(np.where((at >= own[chord + 1])[:, None], reference.point[chord + 1], point))
    return Chords(ends[0], ends[1], reference.sag_mm[chord], cut), chord


def _directed(of: Chords, to: Chords, tolerance_mm: float) -> Real:
    """Bound (n,) of the distance from every point of each chord of `of` to `to`; halved where above the tolerance."""
    found = np.zeros(of.start.shape[0])
    owner = np.arange(found.size)
    start, end = of.start, of.end
    middle_mm = 0.5 * (of.place_mm[:-1] + of.place_mm[1:])
    at = np.searchsorted(to.place_mm, middle_mm, side="right") - 1
    for halving in range(_HALVINGS + 1):
        beside = _BESIDE[halving] if halving < len(_BESIDE) else _BESIDE[1]
        bound, least, at = _nearest(start, end, at, to, beside)
        bound, least = bound + of.error_mm[owner], least + of.error_mm[owner]
        # If an end itself is too far from all chords around it, halving proves nothing more.
        far = (bound > tolerance_mm) & ((least <= tolerance_mm) | (halving < _SURE))
        if halving == _HALVINGS or not far.any():
            np.maximum.at(found, owner, bound)
            break
        np.maximum.at(found, owner[~far], bound[~far])
        start, end, at, owner = start[far], end[far], at[far], owner[far]
        middle = 0.5 * (start + end)
        start, end = np.concatenate((start, middle)), np.concatenate((middle, end))
        at, owner = np.concatenate((at, at)), np.concatenate((owner, owner))
    return found


def _nearest(
    start: Real, end: Real, at: Index, to: Chords, beside: int
) -> tuple[Real, Real, Index]:
    """Distance (n,) of chords to the nearest of the chords `at` (n,) and `beside` chords on either side, plus the error
    of that one; the distance of the farther end alone; and the index of the nearest chord.
    """
    parts = np.array_split(np.arange(at.size), max(1, at.size * (2 * beside + 1) // _MOST_PAIRS))
    found = [_nearest_of(start[own], end[own], at[own], to, beside) for own in parts]
    bound, least, nearest = (np.concatenate(column) for column in zip(*found, strict=True))
    return bound, least, nearest


def _nearest_of(
    start: Real, end: Real, at: Index, to: Chords, beside: int
) -> tuple[Real, Real, Index]:
    """As `_nearest`, for few chords, with all chords around them at once."""
    other = np.clip(at[:, None] + np.arange(-beside, beside + 1), 0, to.start.shape[0] - 1)
    a, b, error = to.start[other], to.end[other], to.error_mm[other]
    from_start = distance_to_chord(start[:, None], a, b) + error
    from_end = distance_to_chord(end[:, None], a, b) + error
    farther = np.maximum(from_start, from_end)
    best = np.argmin(farther, axis=1)
    row = np.arange(at.size)
    least = np.maximum(from_start.min(axis=1), from_end.min(axis=1))
    return farther[row, best], least, other[row, best]
