# SPDX-License-Identifier: MIT
"""The validator: the rules of docs/reference/protocol.md 1.1 to 1.4, as the controller checks them
(firmware/core/program_check.h), vectorised over segments and feed pieces.

Independent of the C code on purpose: both check each program. Rules that are exact in the format (joints, ranges, sums)
are checked in exact integers.

Used by the modules that make, read or send programs. No I/O.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import reduce
from operator import add

import numpy as np
from numpy.typing import NDArray

from ..events import (
    ANALOGUE,
    ANALOGUES,
    DIGITAL,
    EVENTS_A_TICK,
    PROPORTIONAL,
    VALUE_HIGH,
    VALUE_LOW,
)
from ..feed.override_levels import FACTOR_ONE_Q14
from ..feed.pieces import (
    DEGREE,
    FeedPieces,
    derivative_bounds,
    derivative_extremes,
    distance_excess,
    exponents,
)
from ..fixed_point import Q40_PER_MM
from ..names import AXES
from ..spline.bernstein import square
from ..spline.spatial.curve import hodograph_of
from ..spline.spatial.quaternion import polar
from .check_stops import stop_fault
from .codes import ProgramError
from .geometry import ARC_SCALE, PREIMAGE_LIMIT, segment_arcs
from .image import (
    PLANE_AXES,
    Program,
    ProgramLimits,
    ReservedFields,
    decode,
    open_fault,
    reserved_fields,
)
from .wide import Wide, product, scaled, wide

Int = NDArray[np.int64]
Real = NDArray[np.float64]


LEAST_FEED_MM_S = 2.0**-10
"""A slower feed counts as this one: pairs that are too short for it are too short at any feed."""

REACH_Q40 = 1 << 27
"""Greatest distance by which a piece may reach beyond its ends: 2^-14 mm (PIECE_SLACK_MM), plus a gap at a joint."""

_LEAST_FEED_Q24 = 1 << 14
"""Feeds below this are rounding, as in core/feed_bounds.h: 2^-10 mm/s."""


def brief_pairs(joints_q40: Int, pieces: FeedPieces, period_us: int) -> tuple[Int, Real, Real]:
    """Pairs of consecutive segments not longer than the distance of one tick at 200 %.

    joints_q40  (N + 1,) arc lengths of the joints
    Returns the first segment (K,) of each such pair, the pair's distance in mm and the highest feed in mm/s that
    would be slow enough. Pairs with the first or last segment of the path are exempt.
    """
    if joints_q40.size < 5:
        empty: Real = np.zeros(0)
        return np.zeros(0, dtype=np.int64), empty, empty
    low, high = joints_q40[1:-3], joints_q40[3:-1]
    allowed_q24 = _covering_feed_q24(high - low, period_us)
    allowed: Real = np.ldexp(allowed_q24.astype(np.float64), -24)
    fast = ~(highest_feed(low, high, pieces) <= allowed)
    brief = np.flatnonzero(fast | (allowed_q24 < _LEAST_FEED_Q24))
    distance: Real = np.ldexp((high - low)[brief].astype(np.float64), -40)
    return np.asarray(brief + 1, dtype=np.int64), distance, allowed[brief]


def _covering_feed_q24(distance_q40: Int, period_us: int) -> Int:
    """The greatest feed in 2^-24 mm/s that passes less than the distance in two periods; rounded as in the
    controller.
    """
    return np.asarray((distance_q40 >> 16) * (4_000_000 // period_us) // 8 - 1)


def highest_feed(low_q40: Int, high_q40: Int, pieces: FeedPieces) -> Real:
    """Bound of the feed (K,) over stretches low … high of arc length, from the pieces that reach into them."""
    peak = derivative_extremes(pieces.duration_q32_s, pieces.c_q40)[1][0]
    first = np.clip(
        np.searchsorted(pieces.start_q40, low_q40 - REACH_Q40, side="left") - 1, 0, None
    )
    last = np.searchsorted(pieces.start_q40, high_q40 + REACH_Q40, side="right")
    ranges = np.column_stack((first, np.maximum(last, first + 1))).ravel()
    padded = np.append(peak, 0.0)
    return np.asarray(np.maximum.reduceat(padded, ranges)[::2])


Bool = NDArray[np.bool_]
Rule = tuple[Bool, int, ProgramError]

POINT_LIMIT_Q40 = 4096 << 40
"""Coordinates are below 4096 mm."""
ARC_LIMIT_Q40 = 1 << 62
"""Arc lengths are below 2^22 mm."""
JOIN_ARC = wide(ARC_SCALE << (88 - 34))
"""Greatest gap of arc length between two segments: 2^-34 mm."""
CLOSE_ARC = wide(ARC_SCALE << (88 - 24))
"""Greatest difference of a closed path's length from the sum of its segments: 2^-24 mm."""
LONGEST_ARC = wide(32 * ARC_SCALE << 88)
"""Longest segment: 32 mm."""
DIRECTION_RAD = 2.0**-20
"""Greatest change of direction between two segments."""
SLOPE = 2.0**-20
"""Greatest relative change of an extra axis' slope between two segments."""
CLOSE_Q40 = 1 << 16
"""Greatest distance of the last point of a closed path from its first one."""
TRAVEL_SLACK_Q40 = 2.0**16
"""A path may run along a travel limit: 2^-24 mm of rounding are allowed."""
BOX_ROUNDING_Q40 = 8.0
"""Bound of the difference between the boxes here and in the controller: each of five steps is rounded here by at most
1/2, and the controller's sum by less than 1.
"""

_FAR_Q40 = 2.0**50
"""No segment is as long. Greater differences are not evaluated further, so that no number overflows."""

# Three times the Bernstein coefficients of the square of a quadratic.
_SIGMA3 = (
    np.array([[3, 0, 0], [0, 0, 0], [0, 0, 0]]),
    np.array([[0, 3, 0], [0, 0, 0], [0, 0, 0]]),
    np.array([[0, 0, 1], [0, 2, 0], [0, 0, 0]]),
    np.array([[0, 0, 0], [0, 0, 3], [0, 0, 0]]),
    np.array([[0, 0, 0], [0, 0, 0], [0, 0, 3]]),
)


def coefficients_in_range(program: Program) -> bool:
    """Whether the preimages are in the range of the format. For others no curve can be computed."""
    return not np.any(_beyond(program.a_q44, _preimage_limit_q44(program)))


def _preimage_limit_q44(program: Program) -> int:
    return PREIMAGE_LIMIT[len(program.a_q44)] << 44


def segment_faults(
    program: Program, distances: tuple[Wide, ...], limits: ProgramLimits | None
) -> list[Rule]:
    """Violations of the rules of segments and joints, in the order of the controller."""
    code = ProgramError
    limit = _preimage_limit_q44(program)
    drawn = program.point_q40[: len(distances) - 1]
    outside = _bool((program.start_q40 < 0) | (program.start_q40 >= ARC_LIMIT_Q40))
    sigma = _sigma3(program.a_q44)
    apart = [_apart(point, distance) for point, distance in zip(drawn, distances, strict=False)]
    backwards = program.start_q40[1:] <= program.start_q40[:-1]
    out: list[Rule] = [
        (_bool(_beyond(program.a_q44, limit).any(axis=(0, 2))), 0, code.W_RANGE),
        (_bool(_beyond(program.point_q40, POINT_LIMIT_Q40).any(axis=0)), 0, code.POINT_RANGE),
        (outside, 0, code.ARC_RANGE),
        (_any(one <= wide(0) for one in sigma), 0, code.SIGMA),
        (_any(~(a <= b.doubled()) for a in sigma for b in sigma), 0, code.SIGMA_RATIO),
        (_bool(~(distances[-1] <= LONGEST_ARC)), 0, code.SEGMENT_LONG),
    ]
    if limits is not None:
        out.append((_leaves(program, limits), 0, code.TRAVEL))
    return [
        *out,
        (_bool(program.start_q40[:1] != 0), 0, code.SEGMENT_FIRST),
        (_any([*apart, _extras_apart(program)]), 1, code.JOIN_POINT),
        (_bool(_apart(program.start_q40, distances[-1]) | backwards), 1, code.JOIN_ARC),
        (_bool(_turned(program.a_q44) | _other_slopes(program)), 1, code.JOIN_DIRECTION),
    ]


def end_faults(program: Program, distances: tuple[Wide, ...]) -> list[Rule]:
    """Violations of the rules of the end of the path."""
    last = program.segment_count - 1
    missing = program.length_q40 - int(program.start_q40[last])
    off = missing <= 0 or bool(_apart(np.array([0, missing]), distances[-1][last:])[0])
    away = program.point_q40[:, 0] - program.point_q40[:, last]
    open_end = [
        _apart(np.array([0, distance]), own[last:], CLOSE_ARC)[0]
        for distance, own in zip(away, distances[:-1], strict=False)
    ]
    extra_end = program.extra_q40[:, last, 4] if program.extra_q40.size else away[:0]
    open_end += list(np.abs(extra_end - away[len(away) - len(extra_end) :]) > CLOSE_Q40)
    return [
        (np.array([off]), last, ProgramError.SEGMENT_END),
        (np.array([program.closed and any(open_end)]), last, ProgramError.NOT_CLOSED),
    ]


def too_short(program: Program) -> Bool:
    """Later segments of consecutive pairs that a tick at 200 % could cross."""
    joints = np.append(program.start_q40, program.length_q40)
    mask = np.zeros(program.segment_count, dtype=np.bool_)
    mask[brief_pairs(joints, program.pieces, program.period_us)[0] + 1] = True
    return mask


def _beyond(values: Int, limit: int) -> Bool:
    return np.asarray((values >= limit) | (values <= -limit))


def _bool(values: object) -> Bool:
    return np.asarray(values, dtype=np.bool_)


def _any(masks: Iterable[Bool]) -> Bool:
    return _bool(np.logical_or.reduce(list(masks)))


def _sigma3(a_q44: Int) -> list[Wide]:
    """Three times the Bernstein coefficients of sigma, five of (N,), q88, exactly."""
    return [reduce(add, (product(one, one, weights) for one in a_q44)) for weights in _SIGMA3]


def _apart(starts_q40: Int, distances: Wide, most: Wide = JOIN_ARC) -> Bool:
    """Whether each distance ends further than `most` from the start of the next one."""
    far = np.abs(np.diff(starts_q40.astype(np.float64))) > _FAR_Q40
    step = np.where(far, 0, starts_q40[1:] - starts_q40[:-1])
    gap = distances[: len(step)] - scaled(step, ARC_SCALE, 48)
    return _bool(far | ~gap.within(most))


def _turned(a_q44: Int) -> Bool:
    """Directions at the joints differ by more than 2^-20 rad."""
    end, start = (one.astype(np.float64) for one in (a_q44[:, :-1, 2], a_q44[:, 1:, 0]))
    if len(a_q44) == 2:  # twice the angle between the w
        before, after = end[0] + 1j * end[1], start[0] + 1j * start[1]
        return np.asarray(np.abs(np.angle((np.conj(before) * after) ** 2)) > DIRECTION_RAD)
    before, after = (polar(one.T, one.T) for one in (end * 2.0**-44, start * 2.0**-44))
    across = np.linalg.norm(np.cross(before, after), axis=1)
    return np.asarray(np.arctan2(across, np.sum(before * after, axis=1)) > DIRECTION_RAD)


def _extras_apart(program: Program) -> Bool:
    """Positions of extra axes differ at the joints."""
    if not program.extra_q40.size:
        return np.zeros(program.segment_count - 1, dtype=np.bool_)
    start = program.point_q40[-len(program.extra_q40) :]
    gap = program.extra_q40[:, :-1, 4] - np.diff(start, axis=1)
    return _bool((np.abs(gap) > JOIN_Q40).any(axis=0))


def _other_slopes(program: Program) -> Bool:
    """Slopes of extra axes by arc length differ at the joints."""
    if not program.extra_q40.size:
        return np.zeros(program.segment_count - 1, dtype=np.bool_)
    a = np.ldexp(program.a_q44.astype(np.float64), -44)
    per_end, per_start = (
        5.0 / np.sum(a[:, part, k] ** 2, axis=0) for part, k in ((np.s_[:-1], 2), (np.s_[1:], 0))
    )
    b = np.ldexp(program.extra_q40.astype(np.float64), -40)
    last = (b[:, :-1, 4] - b[:, :-1, 3]) * per_end
    most = SLOPE * (1.0 + np.abs(last)) + 2.0**-38 * (per_end + per_start)
    return _bool((np.abs(b[:, 1:, 0] * per_start - last) > most).any(axis=0))


def boxes_q40(program: Program) -> tuple[Real, Real]:
    """Lowest and highest corner (N, A) of the boxes of the segments' six Bezier points."""
    start = program.point_q40.T.astype(np.float64)
    if program.axis_count == PLANE_AXES:
        u, q = program.a_q44
        w = np.asarray((u + 1j * q) * 2.0**-44, dtype=np.complex128)
        direction = square(w).view(np.float64).reshape(-1, 5, 2)
    else:
        direction = np.moveaxis(
            hodograph_of(np.ldexp(np.moveaxis(program.a_q44, 0, 1).astype(np.float64), -44)), 1, 2
        )
    steps = np.cumsum(np.rint(direction * (Q40_PER_MM / 5.0)), axis=1)
    steps = np.concatenate((steps, np.moveaxis(program.extra_q40, 0, 2)), axis=2)
    points = np.concatenate((start[:, None, :], start[:, None, :] + steps), axis=1)
    return points.min(axis=1), points.max(axis=1)


def leaves_range(program: Program, limits: ProgramLimits) -> bool:
    """Whether a point is beyond the format, or a segment may leave the travel by the boxes of the controller, which are
    within BOX_ROUNDING_Q40 of those here.
    """
    outside = _leaves(program, limits, TRAVEL_SLACK_Q40 - BOX_ROUNDING_Q40)
    return bool(_beyond(program.point_q40, POINT_LIMIT_Q40).any() or outside.any())


def _leaves(program: Program, limits: ProgramLimits, slack_q40: float = TRAVEL_SLACK_Q40) -> Bool:
    """Whether the box (N,) is not within the travel."""
    lowest, highest = boxes_q40(program)
    low = np.array(limits.min_q40_mm, dtype=np.float64) - slack_q40
    high = np.array(limits.max_q40_mm, dtype=np.float64) + slack_q40
    return np.asarray(((lowest < low) | (highest > high)).any(axis=1))


COEFFICIENT_Q40 = 1 << 54
"""Greatest coefficient of a piece."""
PIECE_Q40 = 32 << 40
"""Longest piece: 32 mm."""
JOIN_Q40 = 1 << 6
"""Greatest gap of arc length or of a coordinate between two pieces or segments: 2^-34 mm."""
LONGEST_Q32 = 1 << 54
"""Longest duration of a piece: 2^22 s."""
JOIN_FEED_Q24 = 2.0**8
JOIN_ACCELERATION_Q16 = 2.0**10
"""2^-16 mm/s and 2^-6 mm/s^2, in the units to which the controller rounds down what it compares."""
BACKWARDS_MM_S = -(2.0**-10)
"""A feed below this is motion backwards; above it, rounding."""
PIECE_SLACK_MM = 2.0**-14
"""Greatest distance that a piece may move before its start or beyond its end."""


def piece_faults(program: Program, limits: ProgramLimits | None) -> list[Rule]:
    """Violations of the rules of pieces and their joints, in the order of the controller."""
    code = ProgramError
    pieces = program.pieces
    duration, start, c = pieces.duration_q32_s, pieces.start_q40, pieces.c_q40
    large: Bool = np.asarray(((c > COEFFICIENT_Q40) | (c < -COEFFICIENT_Q40)).any(axis=1))
    outside: Bool = np.asarray((start < 0) | (start >= ARC_LIMIT_Q40))
    ranges: list[Rule] = [
        (np.asarray((duration <= 0) | (duration > LONGEST_Q32)), 0, code.PIECE_DURATION),
        (large, 0, code.COEFFICIENT),
        (outside, 0, code.ARC_RANGE),
    ]
    whole = _before_first(ranges, len(pieces))
    if whole == 0:
        return ranges
    return ranges + _shape_faults(program, limits, whole)


def _before_first(rules: list[Rule], count: int) -> int:
    """Number of pieces from the first that are in range; later ones cannot be evaluated."""
    return min([int(mask.argmax()) for mask, _, _ in rules if mask.any()], default=count)


def _shape_faults(program: Program, limits: ProgramLimits | None, count: int) -> list[Rule]:
    code = ProgramError
    pieces = program.pieces
    duration, start, c = (
        a[:count] for a in (pieces.duration_q32_s, pieces.start_q40, pieces.c_q40)
    )
    distance = _distances_q44(duration, c)
    advance = np.diff(start.astype(object))
    gaps = distance[:-1].astype(object) - 16 * advance
    (feed_start, feed_end), (acceleration_start, acceleration_end) = _end_values(duration, c)
    bounds = _bound_faults(duration, c, limits)
    factor = pieces.override_factor_q14
    codes = np.hstack((pieces.override_rate_codes, pieces.override_second_codes))
    override = (factor < FACTOR_ONE_Q14) | (factor > 2 * FACTOR_ONE_Q14)
    begins = (_starts_elsewhere(program), _moving(feed_start[0], acceleration_start[0]))
    return [
        (np.asarray(np.abs(distance) > PIECE_Q40 << 4), 0, code.PIECE_LONG),
        *bounds,
        (np.asarray(override | (codes == 0).any(axis=1)), 0, code.OVERRIDE),
        (np.array([begins[0]]), 0, code.PIECE_FIRST),
        (np.array([begins[1] and not program.moving]), 0, code.START_MOVING),
        (np.asarray(advance < 0, dtype=np.bool_), 1, code.BACKWARDS),
        (np.asarray(np.abs(gaps) > JOIN_Q40 << 4, dtype=np.bool_), 1, code.JOIN_LENGTH),
        (np.abs(feed_end[:-1] - feed_start[1:]) > JOIN_FEED_Q24, 1, code.JOIN_FEED),
        (
            np.abs(acceleration_end[:-1] - acceleration_start[1:]) > JOIN_ACCELERATION_Q16,
            1,
            code.JOIN_ACCELERATION,
        ),
        (_brief(pieces.duration_q32_s, program.period_us), 2, code.PIECE_SHORT),
    ]


def _starts_elsewhere(program: Program) -> bool:
    """Whether the first piece does not begin at arc length 0; in a chunk in motion: not inside the first segment."""
    start = int(program.pieces.start_q40[0])
    if not program.moving:
        return start != 0
    return start >= int([*program.start_q40[1:2], program.length_q40][0])


def _bound_faults(duration: Int, c: Int, limits: ProgramLimits | None) -> list[Rule]:
    """Feed, acceleration and jerk beyond what is allowed; close cases are evaluated more finely."""
    rules = _bound_masks(duration, c, limits, 4)
    suspects = np.flatnonzero(np.logical_or.reduce([mask for mask, _, _ in rules]))
    for first in range(0, suspects.size, 256):
        some = suspects[first : first + 256]
        close = _bound_masks(duration[some], c[some], limits, 9)
        for (mask, _, _), (exact, _, _) in zip(rules, close, strict=True):
            mask[some] = exact
    return rules


def _bound_masks(duration: Int, c: Int, limits: ProgramLimits | None, halvings: int) -> list[Rule]:
    lows, highs = derivative_extremes(duration, c, halvings)
    excess = distance_excess(duration, c, halvings)
    backwards = (lows[0] < BACKWARDS_MM_S) | (excess > PIECE_SLACK_MM)
    out: list[Rule] = [(np.asarray(backwards), 0, ProgramError.BACKWARDS)]
    if limits is None:
        return out
    peaks = highs[0], np.maximum(-lows[1], highs[1]), np.maximum(-lows[2], highs[2])
    asked = (limits.feed_um_s * 1e-3, limits.acceleration_um_s2 * 1e-3, limits.jerk_mm_s3)
    codes = (ProgramError.FEED, ProgramError.ACCELERATION, ProgramError.JERK)
    for peak, limit, code in zip(peaks, asked, codes, strict=True):
        out.append((np.asarray((peak > limit) & (limit > 0.0)), 0, code))
    return out


def last_piece_faults(program: Program) -> list[Rule]:
    """Violations of the rules of the end of the feed."""
    pieces = program.pieces
    last = len(pieces) - 1
    duration, c = pieces.duration_q32_s[last:], pieces.c_q40[last:]
    distance = int(_distances_q44(duration, c)[0])
    missed = (
        abs(distance + ((int(pieces.start_q40[last]) - program.length_q40) << 4)) > JOIN_Q40 << 4
    )
    feed, acceleration = _end_values(duration, c)
    return [
        (np.array([_moving(feed[1][0], acceleration[1][0])]), last, ProgramError.END_MOVING),
        (np.array([missed]), last, ProgramError.PIECE_END),
    ]


def _end_values(duration: Int, c: Int) -> tuple[tuple[Real, Real], tuple[Real, Real]]:
    """Feed in 2^-24 mm/s and acceleration in 2^-16 mm/s^2, each (at the start, at the end) of the pieces."""
    feed, acceleration, _ = derivative_bounds(duration, c)
    v, a = np.floor(feed * 2.0**24), np.floor(acceleration * 2.0**16)
    return (v[:, 0], v[:, -1]), (a[:, 0], a[:, -1])


def _moving(feed_q24: float, acceleration_q16: float) -> bool:
    return abs(feed_q24) > JOIN_FEED_Q24 or abs(acceleration_q16) > JOIN_ACCELERATION_Q16


def _distances_q44(duration: Int, c: Int) -> Int:
    """Length of each piece in 2^-44 mm, rounded down from the exact sum of its terms."""
    shift = exponents(duration) + 32
    distances = [
        _distance_q44(int(d), int(e), row) for d, e, row in zip(duration, shift, c, strict=True)
    ]
    return np.array(distances, dtype=np.int64)


def _distance_q44(d: int, e: int, c: Int) -> int:
    if not c[1:].any():
        return (int(c[0]) * d << 4) >> e
    total = 0
    for k in range(DEGREE, 0, -1):
        # Horner over the common denominator 2^(e (DEGREE - k + 1)).
        total = (total + (int(c[k - 1]) << (e * (DEGREE - k)))) * d
    return (total << 4) >> (e * DEGREE)


def _brief(duration: Int, period_us: int) -> Bool:
    """Consecutive pieces (without first and last piece) that last no longer than two periods together."""
    pairs = duration[1:-2] + duration[2:-1]
    return np.asarray(pairs.astype(object) * 1_000_000 <= 2 * period_us << 32, dtype=np.bool_)


PERIODS_US = (1000, 2000, 4000, 8000)
LONGEST_Q32_S = 2**54
LONGEST_Q40_MM = 2**62


@dataclass(frozen=True)
class Fault:
    """The first rule broken, and the segment, piece or event (0 for the header)."""

    code: ProgramError
    index: int

    @property
    def place(self) -> str:
        """The place in words."""
        if self.code > -20 or self.code == ProgramError.STOP_WORST:
            return "header"
        if self.code <= ProgramError.EVENT_KIND:
            return f"event {self.index}"
        return f"{'segment' if self.code > -40 else 'piece'} {self.index}"


def check(
    program: Program, limits: ProgramLimits | None = None, *, chunk: bool = False
) -> Fault | None:
    """The first rule that `program` breaks, None when it may run. In a chunk it may begin in motion.

    The order is that of the controller: header, segments one by one, their end, pieces one by one, their end and sum,
    pairs of short segments, stops, and last the events.
    """
    return _check(program, limits, _CLEAN, chunk)


def check_image(
    image: bytes, limits: ProgramLimits | None = None, *, chunk: bool = False
) -> Fault | None:
    """As `check`, from the bytes, including faults that `decode` refuses and fields that `Program` does not have."""
    broken = open_fault(image)
    if broken is not None:
        return Fault(broken, 0)
    return _check(decode(image), limits, reserved_fields(image), chunk)


_CLEAN = ReservedFields(flags=True, name=True, stops=None)


def _check(
    program: Program, limits: ProgramLimits | None, reserved: ReservedFields, chunk: bool
) -> Fault | None:
    header = _header_fault(program, limits, reserved, chunk)
    if header is not None:
        return Fault(header, 0)
    distances = segment_arcs(program.a_q44)
    return (
        _first(segment_faults(program, distances, limits))
        or _first(end_faults(program, distances))
        or _first(piece_faults(program, limits))
        or _first(last_piece_faults(program))
        or _duration_fault(program)
        or _first([(too_short(program), 0, ProgramError.SEGMENT_SHORT)])
        or _stop_fault(program, limits, reserved)
        or _first(_event_faults(program))
        or _first([(_dense(program), EVENTS_A_TICK, ProgramError.EVENT_DENSE)])
    )


def _stop_fault(
    program: Program, limits: ProgramLimits | None, reserved: ReservedFields
) -> Fault | None:
    found = stop_fault(program, limits, reserved.stops)
    return None if found is None else Fault(*found)


def _event_faults(program: Program) -> list[Rule]:
    """Violations of the rules of single events, and of their order."""
    events = program.events
    kind, value = events["kind"], events["value"]
    digital = kind == DIGITAL
    channels = np.where(digital, 1, ANALOGUES)
    unknown = (kind < DIGITAL) | (kind > PROPORTIONAL) | (events["channel"] >= channels)
    beside = value.astype(np.int64) & 0xFFFFFFFF & ~events["mask"].astype(np.int64)
    large = (kind == ANALOGUE) & ((value < VALUE_LOW) | (value > VALUE_HIGH))
    wrong = np.where(digital, (events["mask"] == 0) | (beside != 0), (events["mask"] != 0) | large)
    before = np.concatenate((np.zeros(min(1, events.size), dtype=np.int64), events["place"][:-1]))
    outside = (events["place"] < before) | (events["place"] > program.length_q40)
    return [
        (_bool(unknown), 0, ProgramError.EVENT_KIND),
        (_bool(wrong), 0, ProgramError.EVENT_VALUE),
        (_bool(outside), 0, ProgramError.EVENT_PLACE),
    ]


def _dense(program: Program) -> Bool:
    """Events, from number EVENTS_A_TICK on, that a tick at 200 % could pass together with EVENTS_A_TICK before them."""
    places = program.events["place"]
    if places.size <= EVENTS_A_TICK:
        return np.zeros(0, dtype=np.bool_)
    low, high = places[:-EVENTS_A_TICK], places[EVENTS_A_TICK:]
    allowed_q24 = _covering_feed_q24(high - low, program.period_us)
    allowed = np.ldexp(allowed_q24.astype(np.float64), -24)
    fast = ~(highest_feed(low, high, program.pieces) <= allowed)
    return _bool(fast | (allowed_q24 < _LEAST_FEED_Q24))


def _first(rules: list[Rule]) -> Fault | None:
    """The lowest index, then the first rule in order, of the masks."""
    hits = [
        (int(mask.argmax()) + offset, rank, code)
        for rank, (mask, offset, code) in enumerate(rules)
        if mask.any()
    ]
    if not hits:
        return None
    index, _, code = min(hits)
    return Fault(code, index)


def _header_fault(
    program: Program, limits: ProgramLimits | None, reserved: ReservedFields, chunk: bool
) -> ProgramError | None:
    if program.period_us not in PERIODS_US:
        return ProgramError.PERIOD
    if limits is not None and limits.period_us not in (0, program.period_us):
        return ProgramError.PERIOD_USED
    if not reserved.flags or ((program.moving or program.compact) and not chunk):
        return ProgramError.FLAGS
    served = 0 if limits is None else limits.axis_count
    if program.first_axis + program.axis_count > len(AXES) or (
        served and (program.first_axis or served != program.axis_count)
    ):
        return ProgramError.AXES
    if not 0 < program.length_q40 < LONGEST_Q40_MM:
        return ProgramError.LENGTH
    if not reserved.name:
        return ProgramError.NAME
    return None


def _duration_fault(program: Program) -> Fault | None:
    total = sum(int(d) for d in program.pieces.duration_q32_s)
    if total == program.duration_q32_s and total < LONGEST_Q32_S:
        return None
    return Fault(ProgramError.DURATION, 0)
