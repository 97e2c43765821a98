# SPDX-License-Identifier: MIT
"""Plans the stops of a program: stop parameters and stop time bounds; docs/theory/feed.md section 7. In this module
"numbers" are stop parameters. Used by most modules of host_tools that plan a motion. No I/O.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby, pairwise
from math import inf

import numpy as np
from numpy.typing import NDArray

from ..errors import PlanError
from ..feed import AxisLimits, FeedPlan, Plants
from ..feed.limits import PerAxis
from ..feed.pieces import halved
from ..native.program import NativeProgram
from ..native.stop_bounds import stop_bounds
from ..native.stop_search import SearchHints, StopLimits, StopSearch
from .check_stops import END_TICKS, own_bounds
from .image import Program, encode
from .stops import DECELERATION, FAULT, HOLD, Stops, no_stops

WORTH_SHARE = 0.9
"""A halving, and numbers, have to reduce the bound to this share of its value without them."""
LEAST_PERIODS = 2
"""A part of a piece is not halved below this."""
MOST_MISSES = 2
"""Consecutive halvings without numbers, after which a part is not halved again."""
LONGEST_PART_S = 0.08
"""Longer parts are halved if the numbers of their halves are better by WORTH_GAIN."""
MOST_PARTS = 256
"""Most parts of that length; in a longer program parts last longer, which bounds the time of the search."""
WORTH_GAIN = 0.05
"""Share by which the numbers of halves have to reduce the mean bound of a part."""
LONGEST_WAIT_S = 0.04
"""Pieces in which a hold may wait longer than this for a path stop are halved down to FINE_PART_S."""
FINE_PART_S = 0.004
"""Least duration of a part of a halved piece."""
MOST_FINE_PARTS = 1024
"""Most parts of that length; in a longer program parts last longer, which bounds the time of the search and the
image.
"""
FINE_WORTH_SHARE = 0.97
"""Numbers of these parts have to reduce the mean time to rest to this share of the time with waiting."""


class LongStopError(PlanError):
    """A fault stop of `program` may take longer than the machine file allows.

    reason   of the longest: how long, where, and the limit, in words
    late_by  its time over the limit
    """

    remedy = "lower the feed there, or raise stop_time_ms or the machine's acceleration and jerk"

    def __init__(self, program: Program, stop_time_ms: int) -> None:
        worst = program.stops.worst(FAULT)
        place_mm = float(program.piece_starts_mm[worst.piece])
        self.program = program
        self.late_by = worst.time_s / (stop_time_ms * 1e-3)
        self.reason = (
            f"a fault stop at arc length {place_mm:.6g} mm (piece {worst.piece}) may take {worst.time_s:.3g} s, "
            f"longer than stop_time_ms = {stop_time_ms} of the machine file"
        )
        super().__init__(f"stops: {self.reason}: {self.remedy}")


@dataclass(frozen=True)
class StopTerms:
    """The limits of stops in addition to those of a plan.

    plants        of the axes with the volts of the path file; for holds. None: volts are not limited
    drives        the same with all volts of their drives; for fault stops. None: volts are not limited
    axis          limits of the machine's axes, for both
    stop_time_ms  greatest bound of a fault stop; 0: any
    quick         few numbers are tried: for long programs
    only_fault    with `quick`: no numbers for holds are searched
    """

    plants: Plants | None = None
    drives: Plants | None = None
    axis: AxisLimits = field(default_factory=AxisLimits)
    stop_time_ms: int = 0
    quick: bool = False
    only_fault: bool = False


def plan_stops(program: Program, plan: FeedPlan, terms: StopTerms) -> Program:
    """The program with its stop table. Feed pieces without numbers are halved while that helps: in a narrow bend at its
    limits no path stop may begin, but the remainder of the piece then gets numbers. Long pieces are halved too, so that
    such a bend does not make all stops of a piece longer. Raises LongStopError: a fault stop may take longer than
    `stop_time_ms`.
    """
    search = StopSearch(NativeProgram(encode(program)))
    limits = [
        replace(own.raised(search.used(own)), quick=terms.quick)
        for own in (hold_limits(plan, terms), fault_limits(plan, terms))
    ]
    tree = _Halves(program)
    if terms.quick:
        codes = _searched_quickly(tree, limits, terms)
    else:
        codes = _refined(tree, limits, _searched(tree, limits, _Found(program.piece_count)).codes)
    for kind in (HOLD, FAULT):
        codes[_better_without(_with_codes(tree.program, codes), kind, tree.groups), kind] = 0
    if not terms.quick:
        codes = _waiting_less(tree, limits, codes)
    return _checked(with_bounds(_with_codes(*tree.joined(codes))), terms)


def stop_codes(
    program: Program, plan: FeedPlan, terms: StopTerms, wanted: NDArray[np.bool_]
) -> NDArray[np.uint8]:
    """Codes (M, 2, 3) of the wanted (M,) pieces, 0 elsewhere. No piece is halved; the program may begin in motion."""
    search = StopSearch(NativeProgram(encode(program)))
    limits = [
        replace(own.raised(search.used(own)), quick=terms.quick)
        for own in (hold_limits(plan, terms), fault_limits(plan, terms))
    ]
    codes = np.zeros((program.piece_count, 2, 3), dtype=np.uint8)
    known = np.repeat(~wanted[:, None], 2, axis=1)
    if terms.quick:
        _search_round(program, limits, codes, known | _all_but(FAULT))
        known[:, FAULT] = True
    _search_round(program, limits, codes, known)
    return codes


def without_long_stops(program: Program) -> Program:
    """The program without the numbers of pieces whose path stops take longer than continuing to the next piece with
    numbers, or to the end.
    """
    codes = program.stops.codes.copy()
    for kind in (HOLD, FAULT):
        codes[
            _better_without(_with_codes(program, codes), kind, range(program.piece_count)), kind
        ] = 0
    return with_bounds(_with_codes(program, codes))


def _searched_quickly(
    tree: _Halves, limits: Sequence[StopLimits], terms: StopTerms
) -> NDArray[np.uint8]:
    """Codes (M, 2, 3) of a search of few trials. Fault stops come first: where they take too long, nothing else is
    searched. Raises LongStopError.
    """
    found = _searched(tree, limits, _Found(tree.program.piece_count), (FAULT,))
    _checked(_bounded(tree, found.codes), terms)
    if terms.only_fault:
        return found.codes
    found.alone = found.codes[:, FAULT].copy()
    codes = _searched(tree, limits, found, (HOLD,)).codes
    if _late(_bounded(tree, codes), terms):
        # No hold may brake in a piece without numbers for a fault stop during it.
        lost = (codes[:, FAULT] != found.alone).any(axis=1) & (found.alone[:, DECELERATION] != 0)
        codes[lost, HOLD], codes[lost, FAULT] = 0, found.alone[lost]
    return codes


def _bounded(tree: _Halves, codes: NDArray[np.uint8]) -> Program:
    """The program of a search with the bounds of its fault stops."""
    kept = codes.copy()
    kept[_better_without(_with_codes(tree.program, codes), FAULT, tree.groups), FAULT] = 0
    return with_bounds(_with_codes(tree.program, kept))


class _Found:
    """The results of a search so far.

    codes   (M, 2, 3)
    known   (M, 2) which of them are final
    misses  (M,) consecutive halvings without success
    alone   (M, 3) codes of fault stops that are not requested during a hold
    """

    def __init__(self, count: int) -> None:
        self.codes: NDArray[np.uint8] = np.zeros((count, 2, 3), dtype=np.uint8)
        self.known: NDArray[np.bool_] = np.zeros((count, 2), dtype=np.bool_)
        self.misses: NDArray[np.int64] = np.zeros(count, dtype=np.int64)
        self.alone: NDArray[np.uint8] = np.zeros((count, 3), dtype=np.uint8)


def _searched(
    tree: _Halves, limits: Sequence[StopLimits], out: _Found, kinds: Sequence[int] = (HOLD, FAULT)
) -> _Found:
    """Finds codes of some kinds. Pieces without numbers of such a kind are halved until all have them, or are too
    short, or MOST_MISSES consecutive halvings have found none. Pieces with numbers keep them, so that none is searched
    twice.
    """
    others = _all_but(*kinds)
    while True:
        _search_round(tree.program, limits, out.codes, out.known | others)
        found = out.codes[:, :, DECELERATION] != 0
        tree.count_misses(out.misses, (found & ~out.known).any(axis=1))
        lacking = ~(found | others).all(axis=1) & ~(out.known | others).all(axis=1)
        chosen = lacking & tree.long_enough() & (out.misses < MOST_MISSES)
        if not chosen.any():
            out.known |= ~others
            return out
        known = np.where(others, out.known, found | ~chosen[:, None])
        out.known = np.repeat(known, 1 + chosen, axis=0)
        out.codes = np.repeat(out.codes, 1 + chosen, axis=0)
        out.misses = np.repeat(out.misses, 1 + chosen)
        out.alone = np.repeat(out.alone, 1 + chosen, axis=0)
        tree.halve(chosen)


def _all_but(*kinds: int) -> NDArray[np.bool_]:
    """The other kinds of stops (2,)."""
    return np.array([kind not in kinds for kind in (HOLD, FAULT)])


def _refined(
    tree: _Halves, limits: Sequence[StopLimits], codes: NDArray[np.uint8]
) -> NDArray[np.uint8]:
    """Codes (M, 2, 3) of a program whose long parts with numbers are halved, if that makes stops shorter. Parts with
    the greatest numbers of the program are not tried. A half without numbers of its own keeps those of its part.
    """
    whole, parents = codes, np.arange(tree.program.piece_count)
    longest_s = max(LONGEST_PART_S, tree.program.duration_q32_s * 2.0**-32 / MOST_PARTS)
    while True:
        long = tree.program.pieces.duration_s > longest_s
        found = codes[:, :, DECELERATION] != 0
        below = (found & (codes < codes.max(axis=0)).any(axis=2)).any(axis=1)
        chosen = long & below & tree.long_enough()
        if not chosen.any():
            break
        before, parents = np.repeat(codes, 1 + chosen, axis=0), np.repeat(parents, 1 + chosen)
        new = np.repeat(chosen, 1 + chosen)
        known = ~(new[:, None] & (before[:, :, DECELERATION] != 0))
        tree.halve(chosen, apart=True)
        codes = before.copy()
        _search_round(tree.program, limits, codes, known)
        lost = (before[:, :, DECELERATION] != 0) & (codes[:, :, DECELERATION] == 0)
        codes[lost.any(axis=1)] = before[lost.any(axis=1)]
    without = ~_gains(tree.program, whole[parents], codes, parents)[parents]
    codes[without] = whole[parents][without]
    return codes


def _waiting_less(
    tree: _Halves, limits: Sequence[StopLimits], codes: NDArray[np.uint8]
) -> NDArray[np.uint8]:
    """Codes (M, 2, 3) of a program whose pieces are halved to short parts where a hold waits long: in a bend at its
    limits a path stop may begin at some instants only. Parts get numbers for holds if these are better than waiting,
    and if numbers for a fault stop during such a hold are found.
    """
    waits = _long_waits(tree.program, limits[HOLD], codes)
    longest_s = max(FINE_PART_S, tree.program.duration_q32_s * 2.0**-32 / MOST_FINE_PARTS)
    while True:
        seconds = tree.program.pieces.duration_s
        chosen = waits & (seconds > longest_s) & tree.long_enough()
        if not chosen.any():
            break
        codes, waits = np.repeat(codes, 1 + chosen, axis=0), np.repeat(waits, 1 + chosen)
        tree.halve(chosen)
    before = codes.copy()
    _search_round(tree.program, limits, codes, np.stack((~waits, np.ones_like(waits)), axis=1))
    lost = (codes[:, FAULT, DECELERATION] == 0) & (before[:, FAULT, DECELERATION] != 0)
    codes[lost] = before[lost]
    without = waits & ~_better_than_waiting(_with_codes(tree.program, codes), limits[HOLD])
    codes[without] = before[without]
    return codes


def _better_than_waiting(program: Program, limits: StopLimits) -> NDArray[np.bool_]:
    """Parts (M,) whose numbers for holds reduce the mean time to rest to FINE_WORTH_SHARE of that with waiting for the
    next part; or reduce it at all, if they are the numbers of the next part.
    """
    codes = program.stops.codes[:, HOLD]
    mean_s = StopSearch(NativeProgram(encode(program))).mean_s(limits, codes)
    duration_s = program.pieces.duration_s
    out: NDArray[np.bool_] = np.zeros(duration_s.size, dtype=np.bool_)
    next_s = 0.0
    for i in range(duration_s.size - 1, -1, -1):
        same = i + 1 < out.size and out[i + 1] and np.array_equal(codes[i], codes[i + 1])
        waiting_s = 0.5 * float(duration_s[i]) + next_s
        given = codes[i, DECELERATION] > 0
        out[i] = given and mean_s[i] <= (1.0 if same else FINE_WORTH_SHARE) * waiting_s
        next_s = mean_s[i] if out[i] else duration_s[i] + next_s
    return out


def _long_waits(
    program: Program, limits: StopLimits, codes: NDArray[np.uint8]
) -> NDArray[np.bool_]:
    """Pieces (M,) in which a hold may wait for more than LONGEST_WAIT_S, except those at the end of the program, where
    no path stop fits. A hold also waits in a piece whose numbers gain nothing: while the program itself brakes hard, no
    path stop with a lower jerk of release can begin.
    """
    seconds = program.pieces.duration_s
    mean_s = StopSearch(NativeProgram(encode(program))).mean_s(limits, codes[:, HOLD])
    ahead_s = 0.5 * seconds + np.append(mean_s[1:] + 0.5 * seconds[1:], 0.0)
    brakes = (codes[:, HOLD, DECELERATION] > 0) & (mean_s < ahead_s)
    out: NDArray[np.bool_] = np.zeros(seconds.size, dtype=np.bool_)
    for low, high in pairwise((-1, *np.flatnonzero(brakes).tolist())):
        out[low + 1 : high] = seconds[low + 1 : high].sum() > LONGEST_WAIT_S
    return out


def _gains(
    program: Program,
    before: NDArray[np.uint8],
    after: NDArray[np.uint8],
    parents: NDArray[np.int64],
) -> NDArray[np.bool_]:
    """Which groups of parts (`parents`, (M,): their numbers) have shorter stops `after` than `before` (M, 2, 3)."""
    seconds = program.pieces.duration_s
    out: NDArray[np.bool_] = np.zeros(int(parents[-1]) + 1, dtype=np.bool_)
    for kind in (HOLD, FAULT):
        old, new = (
            np.bincount(parents, seconds * own_bounds(_with_codes(program, codes), kind)[0])
            for codes in (before, after)
        )
        out |= new < (1.0 - WORTH_GAIN) * old
    return out


def _search_round(
    program: Program,
    limits: Sequence[StopLimits],
    codes: NDArray[np.uint8],
    known: NDArray[np.bool_],
) -> None:
    """Finds the codes (M, 2, 3) that are not `known` (M, 2). A fault stop may be requested during the path stop of a
    hold. So its codes, although known, are checked again with the codes found for the hold. A search with few trials
    tries the codes of the fault stop for the hold first, and keeps them if possible.
    """
    search, quick = StopSearch(NativeProgram(encode(program))), limits[FAULT].quick
    hold, fault = codes[:, HOLD], codes[:, FAULT]
    if not known[:, HOLD].all():
        start = fault if quick else None
        hold[:] = search.codes(limits[HOLD], hold, known[:, HOLD], SearchHints(start=start))
    given = known[:, FAULT] & (known[:, HOLD] | (hold[:, DECELERATION] == 0))
    if not given.all():
        kept = known[:, FAULT] & ~given & (fault[:, DECELERATION] != 0) if quick else None
        fault[:] = search.codes(limits[FAULT], fault, given, SearchHints(before=hold, kept=kept))


def _better_without(program: Program, kind: int, groups: Sequence[object]) -> NDArray[np.bool_]:
    """Parts (M,) that should have no numbers of a kind: their numbers give a bound that is a tenth longer than
    continuing into the next part. Also all parts of a group (`groups`, (M,)) in which different numbers reduce no bound
    by a tenth.
    """
    own_s, _, waits = (one.tolist() for one in own_bounds(program, kind))
    duration_s, codes = program.pieces.duration_s, program.stops.codes[:, kind]
    seconds = duration_s.tolist()
    out = [False] * len(seconds)
    next_s = END_TICKS * program.period_us * 1e-6
    for _, group in groupby(range(len(seconds) - 1, -1, -1), key=groups.__getitem__):
        parts = list(group)
        end_s, worst_s = next_s, 0.0
        for i in parts:
            waiting_s = seconds[i] + next_s
            numbers_s = max(own_s[i], waits[i] * seconds[i] + next_s if waits[i] > 0.0 else 0.0)
            out[i] = waiting_s < WORTH_SHARE * numbers_s
            next_s = waiting_s if out[i] else numbers_s
            worst_s = max(worst_s, next_s)
        if len(parts) == 1 or (codes[parts] == codes[parts[0]]).all():
            continue
        whole_s = float(duration_s[parts].sum()) + end_s
        if worst_s > WORTH_SHARE * whole_s:
            for i in parts:
                out[i] = True
            next_s = whole_s
    return np.array(out, dtype=np.bool_)


def _with_codes(program: Program, codes: NDArray[np.uint8]) -> Program:
    return replace(program, stops=replace(no_stops(program.piece_count), codes=codes))


class _Halves:
    """A program some of whose feed pieces are halved, and their halves again.

    A part is identified by its piece and its number as in a binary heap: 1 is the whole piece, 2 n and 2 n + 1 are the
    halves of n. A group is the parts of a piece, or of a half that was made `apart`; the part that it began as
    identifies it.
    """

    def __init__(self, program: Program) -> None:
        self._whole = self.program = program
        self._parts = [(piece, 1) for piece in range(program.piece_count)]
        self.groups = list(self._parts)
        self._new: NDArray[np.int64] = np.zeros(0, dtype=np.int64)

    def long_enough(self) -> NDArray[np.bool_]:
        """Which parts may be halved (M,): no two consecutive ones may last two periods or less
        (docs/reference/protocol.md 1.3).
        """
        least_q32 = (LEAST_PERIODS * self.program.period_us << 32) // 1_000_000
        return np.asarray(self.program.pieces.duration_q32_s >= 2 * least_q32)

    def halve(self, chosen: NDArray[np.bool_], apart: bool = False) -> None:
        """Halves the chosen parts (M,). `apart`: a part that is all of its group becomes two groups."""
        self.program = _with_pieces(self.program, chosen)
        self._new = np.flatnonzero(np.repeat(chosen, 1 + chosen))
        parts, groups = [], []
        for part, group, halves in zip(self._parts, self.groups, chosen.tolist(), strict=True):
            piece, number = part
            new = [(piece, 2 * number), (piece, 2 * number + 1)] if halves else [part]
            parts += new
            groups += new if apart and part == group else [group] * len(new)
        self._parts, self.groups = parts, groups

    def count_misses(self, misses: NDArray[np.int64], found: NDArray[np.bool_]) -> None:
        """Counts in `misses` (M,) the consecutive last halvings of each part that gave no half new numbers (`found`,
        (M,)).
        """
        either = found[self._new].reshape(-1, 2).any(axis=1).repeat(2)
        misses[self._new] = np.where(either, 0, misses[self._new] + 1)

    def joined(self, codes: NDArray[np.uint8]) -> tuple[Program, NDArray[np.uint8]]:
        """The program and its codes (M, 2, 3) without the halves that have the same numbers."""
        leaves = dict(zip(self._parts, codes, strict=True))
        inner: set[tuple[int, int]] = set()
        for piece, number in self._parts:
            inner |= {(piece, number >> up) for up in range(1, number.bit_length())}
        for piece, number in sorted(inner, key=lambda part: -part[1]):
            low, high = (piece, 2 * number), (piece, 2 * number + 1)
            if low in leaves and high in leaves and np.array_equal(leaves[low], leaves[high]):
                leaves[piece, number] = leaves.pop(low)
                leaves.pop(high)
        tree = _Halves(self._whole)
        while True:
            chosen = np.array([part not in leaves for part in tree._parts])
            if not chosen.any():
                return tree.program, np.stack([leaves[part] for part in tree._parts])
            tree.halve(chosen)


def _with_pieces(program: Program, chosen: NDArray[np.bool_]) -> Program:
    pieces = halved(program.pieces, chosen, program.length_q40)
    return replace(program, pieces=pieces, stops=no_stops(len(pieces)))


def with_bounds(program: Program) -> Program:
    """The program with the bounds that its numbers have."""
    image = NativeProgram(encode(program))
    (hold_us, hold_um), (fault_us, fault_um) = (stop_bounds(image, kind) for kind in (HOLD, FAULT))
    stops = Stops(
        program.stops.codes,
        np.stack((hold_us, fault_us), axis=1),
        (int(hold_us.max()), int(fault_us.max())),
        (int(hold_um.max()), int(fault_um.max())),
    )
    return replace(program, stops=stops)


def _late(program: Program, terms: StopTerms) -> bool:
    """Whether a fault stop may take longer than allowed."""
    return 0 < terms.stop_time_ms * 1e-3 < program.stops.worst(FAULT).time_s


def _checked(program: Program, terms: StopTerms) -> Program:
    if _late(program, terms):
        raise LongStopError(program, terms.stop_time_ms)
    return program


def hold_limits(plan: FeedPlan, terms: StopTerms) -> StopLimits:
    """The limits of feed hold and stop: those of the path file and of the machine."""
    own = plan.limits
    machine, axes = fault_limits(plan, StopTerms(axis=terms.axis)), len(own.names)
    return replace(
        machine,
        feed=_least(own.feed_mm_s, machine.feed),
        acceleration=_least(own.acceleration_mm_s2, machine.acceleration),
        jerk=_least(own.jerk_mm_s3, machine.jerk),
        centripetal=_least(own.centripetal_mm_s2, inf),
        axis_velocity=_both(own.axis.velocity_mm_s, machine.axis_velocity),
        axis_acceleration=_both(own.axis.acceleration_mm_s2, machine.axis_acceleration),
        axis_jerk=_both(own.axis.jerk_mm_s3, machine.axis_jerk),
        zones=tuple((cap.from_mm, cap.to_mm, cap.feed_mm_s) for cap in own.zones),
        reach=_reach(terms.plants, axes),
        time_constant=_time_constants(terms.plants, axes),
        reach_at_rate_1=False,
        rise_is_cut=True,
    )


def fault_limits(plan: FeedPlan, terms: StopTerms) -> StopLimits:
    """The limits of fault stops: those of the machine."""
    machine, axes = plan.controller, len(plan.limits.names)
    free = (inf,) * axes
    return StopLimits(
        feed=machine.feed_mm_s,
        acceleration=machine.acceleration_mm_s2,
        jerk=machine.jerk_mm_s3,
        axis_velocity=_both(terms.axis.velocity_mm_s, free),
        axis_acceleration=_both(terms.axis.acceleration_mm_s2, free),
        axis_jerk=_both(terms.axis.jerk_mm_s3, free),
        reach=_reach(terms.drives, axes),
        time_constant=_time_constants(terms.drives, axes),
        reach_at_rate_1=True,
    )


def _least(limit: float | None, other: float) -> float:
    return other if limit is None else min(limit, other)


def _both(limit: PerAxis | None, other: PerAxis) -> PerAxis:
    """The lower of two limits of each axis."""
    return other if limit is None else tuple(min(pair) for pair in zip(limit, other, strict=True))


def _reach(plants: Plants | None, axes: int) -> PerAxis:
    return (inf,) * axes if plants is None else tuple(plant.reach_mm_s for plant in plants)


def _time_constants(plants: Plants | None, axes: int) -> PerAxis:
    return (0.0,) * axes if plants is None else tuple(plant.time_constant_s for plant in plants)
