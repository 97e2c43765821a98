# SPDX-License-Identifier: MIT
"""Joins the contours of a drawing, and chooses their order, direction and start for short rapid moves between them.
Used by toolpath/drawing. No I/O.

`join` makes chains of contours whose ends meet. `arrange` orders the chains: it begins with the nearest one next. Then
it reverses a part of the sequence (2-opt) or moves one chain elsewhere (or-opt) while that shortens the rapid moves,
within a bound of work. A closed chain may begin at the start of each of its steps, or at 16 points of a circle.

The work is bounded by counts, not by time: the same drawing gives the same sequence on every computer.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from .contours import ARC, LINE, Contours, Point, Step, points_within

SAME_MM = 1e-9
"""Points that are no farther apart are the same."""

_MOST_ENTRIES = 64
"""Most points that a closed chain may begin at."""

_CIRCLE_ENTRIES = 16
"""Points at which a full circle may begin."""

_LEAST_RING = 4.0
"""A contour whose ends are within the gap is closed if its length is at least this many gaps. A shorter one is a dash,
not a ring.
"""

_TRIALS = 300_000
_LEAST_REACH = 50
"""In one pass, each visit is tried with those at most `_TRIALS` / visits places away in the sequence."""

_MOST_PASSES = 8
_PASSED = 10_000
"""Passes end after this number of tried visits."""

_LEAST_GAIN = 1e-9
"""A change of the order has to gain more than this, mm."""

_NONE = -1
"""An end that is not linked."""

Vectors = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Chain:
    """Contours one after the other: pairs of index and whether it is drawn backwards."""

    pieces: tuple[tuple[int, bool], ...]
    is_closed: bool


@dataclass(frozen=True, slots=True)
class Entry:
    """Where a closed chain may begin: `step` of piece `piece`, at `point`."""

    point: Point
    piece: int
    step: int


@dataclass(frozen=True, slots=True)
class Visit:
    """A chain as it is drawn: backwards or not, and a closed one from `entry` on."""

    chain: Chain
    is_backwards: bool = False
    entry: Entry | None = None


# ---- chains


def join(contours: Contours, gap_mm: float) -> list[Chain]:
    """Chains of the contours of a group whose ends are at most `gap_mm` apart, each in the place of its first contour.

    Where more than two ends meet, ends at the same point are joined first, in the order of the file.
    """
    reach = max(gap_mm, SAME_MM)
    ends = contours.ends()
    is_open = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) > SAME_MM
    links = np.full(2 * len(contours), _NONE)
    may_close = is_open.copy()
    for index in np.flatnonzero(is_open):
        near = np.linalg.norm(ends[index, 1] - ends[index, 0]) <= reach
        may_close[index] = near and _extent(contours, int(index)) > _LEAST_RING * reach
    groups = np.array([contours.group_of(index) for index in range(len(contours))])
    for group in np.unique(groups[is_open]):
        chosen = np.flatnonzero(is_open & (groups == group))
        numbers = np.stack([2 * chosen, 2 * chosen + 1], axis=1).ravel()
        _link(links, numbers, ends.reshape(-1, 3)[numbers], reach, may_close)
    return _chains(is_open, links)


def _extent(contours: Contours, index: int) -> float:
    """The length of a contour, its curves by a few chords."""
    length = 0.0
    for step in contours.steps(index):
        points = np.concatenate([[step.start], points_within(step, 3), [step.end]])
        length += float(_distance(points[1:], points[:-1]).sum())
    return length


def _link(
    links: NDArray[np.int64],
    numbers: NDArray[np.int64],
    points: Vectors,
    reach: float,
    may_close: NDArray[np.bool_],
) -> None:
    """Link ends at the same point, then the nearest ones within `reach`, until none is left.

    A contour is linked with itself only where `may_close` allows it.
    """
    order = np.lexsort((numbers, points[:, 2], points[:, 1], points[:, 0]))
    sorted_points = points[order]
    is_new = np.append(True, (sorted_points[1:] != sorted_points[:-1]).any(axis=1))
    bounds = np.append(np.flatnonzero(is_new), len(order))
    free = []
    for begin, end in pairwise(bounds.tolist()):
        same = [int(numbers[k]) for k in order[begin:end]]
        for first, second in zip(same[0::2], same[1::2], strict=False):
            _connect(links, first, second)
        free += [order[end - 1]] if len(same) % 2 else []
    left = np.array(sorted(free), dtype=np.int64)
    while len(left) > 1:
        tree = cKDTree(points[left])
        near = tree.query(points[left], k=min(8, len(left)), distance_upper_bound=reach)
        distances, found = np.asarray(near[0]), np.asarray(near[1])
        rows, columns = np.nonzero(np.isfinite(distances) & (found > np.arange(len(left))[:, None]))
        others = found[rows, columns]
        contour = numbers[left] // 2
        fits = (contour[rows] != contour[others]) | may_close[contour[rows]]
        rows, columns, others = rows[fits], columns[fits], others[fits]
        by_distance = np.lexsort((others, rows, distances[rows, columns]))
        used: set[int] = set()
        for first, second in zip(
            rows[by_distance].tolist(), others[by_distance].tolist(), strict=True
        ):
            if first not in used and second not in used:
                used |= {first, second}
                _connect(links, int(numbers[left[first]]), int(numbers[left[second]]))
        if not used:
            return
        left = np.delete(left, sorted(used))


def _connect(links: NDArray[np.int64], first: int, second: int) -> None:
    links[first], links[second] = second, first


def _chains(is_open: NDArray[np.bool_], links: NDArray[np.int64]) -> list[Chain]:
    """Follow the links. End 2 k is the start of contour k, end 2 k + 1 its end."""
    chains: list[tuple[int, Chain]] = []
    is_used = ~is_open
    chains += [(int(k), Chain(((int(k), False),), True)) for k in np.flatnonzero(is_used)]
    is_linked = (links != _NONE).reshape(-1, 2)
    loose = np.flatnonzero(is_open & ~is_linked.all(axis=1))
    for k in np.concatenate([loose, np.flatnonzero(is_open)]).tolist():
        if is_used[k]:
            continue
        at = 2 * k + (1 if is_linked[k, 0] and not is_linked[k, 1] else 0)
        pieces = []
        first = at
        while not is_used[at // 2]:
            is_used[at // 2] = True
            pieces.append((at // 2, at % 2 == 1))
            following = int(links[at ^ 1])
            if following == _NONE:
                break
            at = following
        is_closed = int(links[(2 * pieces[-1][0] + 1) ^ int(pieces[-1][1])]) == first
        if pieces[0][1] and sum(backwards for _, backwards in pieces) * 2 > len(pieces):
            pieces = [(index, not backwards) for index, backwards in reversed(pieces)]
        chains.append((min(index for index, _ in pieces), Chain(tuple(pieces), is_closed)))
    return [chain for _, chain in sorted(chains, key=lambda each: each[0])]


def steps_of(contours: Contours, visit: Visit) -> Iterator[Step]:
    """The steps of a visit; each begins exactly where the one before it ends.

    Where contours meet within a gap, the end of a line or spline next to the gap is moved; between two arcs a line is
    added. A line without length is left out.
    """
    for step in _met_steps(contours, visit):
        if step.kind != LINE or step.start != step.end:
            yield step


def _met_steps(contours: Contours, visit: Visit) -> Iterator[Step]:
    first = before = None
    for step in _raw_steps(contours, visit):
        if before is None:
            first = step
        else:
            before, step, bridge = _meet(before, step)
            yield before
            if bridge is not None:
                yield bridge
        before = step
    if first is None or before is None:
        return
    if visit.chain.is_closed and before.end != first.start:
        if before.kind != ARC or math.dist(before.end, first.start) <= SAME_MM:
            yield _ending_at(before, first.start)
            return
        yield before
        yield Step(LINE, before.line, before.end, (), first.start, None)
        return
    yield before


def _raw_steps(contours: Contours, visit: Visit) -> Iterator[Step]:
    pieces = visit.chain.pieces
    entry = visit.entry
    if entry is None:
        for index, backwards in reversed(pieces) if visit.is_backwards else pieces:
            yield from contours.steps(index, backwards=backwards != visit.is_backwards)
        return
    if contours.length_of(pieces[0][0]) == 1 == len(pieces):
        for step in contours.steps(pieces[0][0]):
            yield step._replace(start=entry.point, end=entry.point) if step.is_circle else step
        return
    turned = [*pieces[entry.piece :], *pieces[: entry.piece]]
    if len(turned) == 1:
        yield from contours.steps(turned[0][0], entry.step)
        return
    for index, backwards in turned:
        yield from contours.steps(index, backwards=backwards)


def _meet(before: Step, after: Step) -> tuple[Step, Step, Step | None]:
    """Two steps so that the second begins where the first ends, and a line between them where both are arcs."""
    if before.end == after.start:
        return before, after, None
    if after.kind != ARC:
        return before, _beginning_at(after, before.end), None
    if before.kind != ARC or math.dist(before.end, after.start) <= SAME_MM:
        return _ending_at(before, after.start), after, None
    return before, after, Step(LINE, after.line, before.end, (), after.start, None)


def _beginning_at(step: Step, point: Point) -> Step:
    return _ending_at(step.reversed(), point).reversed()


def _ending_at(step: Step, point: Point) -> Step:
    """The step with another end. A curve keeps its direction there; no point of it moves farther than its end."""
    if step.kind in (ARC, LINE):
        return step._replace(end=point)
    shift = np.subtract(point, step.end)
    if step.spline is not None:
        points = step.spline.points.copy()
        points[-2 if len(points) > 2 else -1 :] += shift
        points[-1] = point
        return step._replace(end=point, spline=replace(step.spline, points=points))
    x, y, z = (np.array(step.controls[-1]) + shift).tolist()
    return step._replace(controls=(*step.controls[:-1], (x, y, z)), end=point)


# ---- the sequence


def entries_of(contours: Contours, chain: Chain) -> list[Entry]:
    """Where a chain may begin: an open chain at its start only."""
    if not chain.is_closed:
        return []
    if len(chain.pieces) > 1:
        found = []
        for piece, (index, backwards) in enumerate(chain.pieces):
            start = contours.ends()[index, 1 if backwards else 0]
            found.append(Entry(_point(start), piece, 0))
        return found[:: -(-len(found) // _MOST_ENTRIES)]
    index = chain.pieces[0][0]
    if contours.length_of(index) == 1:
        step = next(contours.steps(index))
        return _circle_entries(step) if step.is_circle else []
    corners = contours.corners(index)
    stride = -(-len(corners) // _MOST_ENTRIES)
    return [Entry(_point(corners[k]), 0, k) for k in range(0, len(corners), stride)]


def _circle_entries(circle: Step) -> list[Entry]:
    x, y, _ = circle.controls[0]
    dx, dy = circle.start[0] - x, circle.start[1] - y
    found = [Entry(circle.start, 0, 0)]
    for k in range(1, _CIRCLE_ENTRIES):
        c, s = math.cos(k * math.tau / _CIRCLE_ENTRIES), math.sin(k * math.tau / _CIRCLE_ENTRIES)
        found.append(Entry((x + c * dx - s * dy, y + s * dx + c * dy, circle.start[2]), 0, 0))
    return found


def _point(numbers: Vectors) -> Point:
    x, y, z = numbers.tolist()
    return x, y, z


def in_file_order(chains: Sequence[Chain]) -> list[Visit]:
    """All chains as they are."""
    return [Visit(chain) for chain in chains]


def terminals(contours: Contours, visits: Sequence[Visit]) -> tuple[Vectors, Vectors]:
    """Where each visit begins and ends, each of shape (visits, 3)."""
    ends = contours.ends()
    first, last = [], []
    for visit in visits:
        begin, finish = visit.chain.pieces[0], visit.chain.pieces[-1]
        start, stop = ends[begin[0], int(begin[1])], ends[finish[0], 1 - int(finish[1])]
        if visit.entry is not None:
            start = stop = np.array(visit.entry.point)
        elif visit.chain.is_closed:
            stop = start
        first.append(stop if visit.is_backwards else start)
        last.append(start if visit.is_backwards else stop)
    return np.array(first).reshape(-1, 3), np.array(last).reshape(-1, 3)


def end_of(contours: Contours, visits: Sequence[Visit]) -> Point:
    """Where the last visit ends."""
    return _point(terminals(contours, visits[-1:])[1][0])


def rapid_length(contours: Contours, visits: Sequence[Visit], start: Point) -> float:
    """Length of the straight moves from `start` to the first visit and between visits, in mm."""
    first, last = terminals(contours, visits)
    before = np.concatenate([[start], last[:-1]]) if len(first) else first
    return float(np.linalg.norm(first - before, axis=1).sum())


def arrange(contours: Contours, chains: Sequence[Chain], start: Point) -> list[Visit]:
    """The chains in an order with short moves from `start` to the first one and between them; the order of the file if
    no shorter one is found.
    """
    entries = [entries_of(contours, chain) for chain in chains]
    visits = _nearest_first(contours, chains, entries, start)
    index_of = {id(chain): k for k, chain in enumerate(chains)}
    for _ in range(2):
        visits = _improved(contours, visits, start)
        visits = _best_entries(
            contours, visits, [entries[index_of[id(v.chain)]] for v in visits], start
        )
    as_given = in_file_order(chains)
    length = rapid_length(contours, visits, start)
    return visits if length < rapid_length(contours, as_given, start) else as_given


def _nearest_first(
    contours: Contours, chains: Sequence[Chain], entries: Sequence[list[Entry]], start: Point
) -> list[Visit]:
    """The sequence that goes from each chain to the nearest remaining one."""
    candidates: list[tuple[int, Visit]] = []
    for k, chain in enumerate(chains):
        if entries[k]:
            candidates += [(k, Visit(chain, entry=entry)) for entry in entries[k]]
        else:
            candidates.append((k, Visit(chain)))
            candidates += [] if chain.is_closed else [(k, Visit(chain, is_backwards=True))]
    first, last = terminals(contours, [visit for _, visit in candidates])
    places, place_of = np.unique(first, axis=0, return_inverse=True)
    at_place: list[list[int]] = [[] for _ in places]
    for candidate, place in enumerate(place_of.ravel().tolist()):
        at_place[place].append(candidate)
    for waiting in at_place:
        waiting.reverse()
    search = _Places(places)
    is_done = np.zeros(len(chains), dtype=bool)
    visits: list[Visit] = []
    here = np.array(start)
    while len(visits) < len(chains):
        place = search.nearest(here)
        while at_place[place] and is_done[candidates[at_place[place][-1]][0]]:
            at_place[place].pop()
        if not at_place[place]:
            search.remove(place)
            continue
        candidate = at_place[place].pop()
        k, visit = candidates[candidate]
        is_done[k] = True
        visits.append(visit)
        here = last[candidate]
    return visits


class _Places:
    """Finds the nearest of points, some of which are removed over time."""

    def __init__(self, points: Vectors) -> None:
        self._points = points
        self._is_left = np.ones(len(points), dtype=bool)
        self._left = len(points)
        self._build()

    def _build(self) -> None:
        self._numbers = np.flatnonzero(self._is_left)
        self._tree = cKDTree(self._points[self._numbers])

    def remove(self, number: int) -> None:
        self._is_left[number] = False
        self._left -= 1
        if 0 < self._left < len(self._numbers) // 2:
            self._build()

    def nearest(self, point: Vectors) -> int:
        """The number of the nearest remaining point; there has to be one."""
        count = 1
        while True:
            found = np.atleast_1d(self._tree.query(point, k=min(count, len(self._numbers)))[1])
            numbers = self._numbers[found]
            left = numbers[self._is_left[numbers]]
            if len(left):
                return int(left[0])
            count *= 4


def _improved(contours: Contours, visits: list[Visit], start: Point) -> list[Visit]:
    """Reverse parts of the sequence, and move single visits, as long as that makes the rapid moves shorter."""
    n = len(visits)
    if n < 2:
        return visits
    first, last = terminals(contours, visits)
    sequence = _Sequence(np.array(start), first, last)
    reach = max(_LEAST_REACH, _TRIALS // n)
    for _ in range(max(1, min(_MOST_PASSES, _PASSED // n))):
        gain = 0.0
        for k in range(n):
            gain += sequence.reverse_from(k, reach)
        for k in range(n):
            gain += sequence.move(k, reach)
        if gain <= _LEAST_GAIN:
            break
    return [
        replace(visits[k], is_backwards=visits[k].is_backwards != turned)
        if not visits[k].chain.is_closed
        else visits[k]
        for k, turned in zip(sequence.order.tolist(), sequence.is_turned.tolist(), strict=True)
    ]


class _Sequence:
    """Visits in a sequence that begins at a place; `first` and `last` are where each begins and ends."""

    def __init__(self, start: Vectors, first: Vectors, last: Vectors) -> None:
        self.order = np.arange(len(first))
        self.is_turned = np.zeros(len(first), dtype=bool)
        self._start = start
        self._first = first.copy()
        self._last = last.copy()

    def reverse_from(self, i: int, reach: int) -> float:
        """Reverse the part from `i` on that gains most; the gain in mm, 0 if there is none."""
        stop = min(len(self.order), i + reach)
        before = self._before(i)
        last, following = self._last[i:stop], self._first[i + 1 : stop + 1]
        gain = _distance(self._first[i], before) - _distance(last, before)
        count = len(following)  # nothing follows the last visit
        gain[:count] += _distance(last[:count], following) - _distance(self._first[i], following)
        best = int(np.argmax(gain))
        if gain[best] <= _LEAST_GAIN:
            return 0.0
        self._reverse(i, i + best + 1)
        return float(gain[best])

    def _before(self, i: int) -> Vectors:
        return self._last[i - 1] if i else self._start

    def _reverse(self, begin: int, end: int) -> None:
        part = slice(begin, end)
        self.order[part] = self.order[part][::-1].copy()
        self.is_turned[part] = ~self.is_turned[part][::-1]
        self._first[part], self._last[part] = (
            self._last[part][::-1].copy(),
            self._first[part][::-1].copy(),
        )

    def move(self, i: int, reach: int) -> float:
        """Move visit `i` to where that gains most, in either direction; the gain in mm, 0 if there is none."""
        n = len(self.order)
        begin, end = max(0, i - reach), min(n - 1, i + reach)
        first, last, before = self._first[i], self._last[i], self._before(i)
        saved = _distance(first, before)
        if i + 1 < n:
            saved += _distance(last, self._first[i + 1]) - _distance(before, self._first[i + 1])
        # Place k is after visit k; place -1 is at the start.
        places = np.arange(begin - 1, end + 1)
        places = places[(places < i - 1) | (places > i)]
        if not len(places):
            return 0.0
        left = np.where((places >= 0)[:, None], self._last[places], self._start)
        has_next = places + 1 < n
        right = self._first[np.minimum(places + 1, n - 1)]
        between = np.where(has_next, _distance(left, right), 0.0)
        straight = (
            _distance(left, first) + np.where(has_next, _distance(right, last), 0.0) - between
        )
        turned = _distance(left, last) + np.where(has_next, _distance(right, first), 0.0) - between
        gain = saved - np.minimum(straight, turned)
        best = int(np.argmax(gain))
        if gain[best] <= _LEAST_GAIN:
            return 0.0
        self._shift(i, int(places[best]), bool(turned[best] < straight[best]))
        return float(gain[best])

    def _shift(self, i: int, place: int, is_turned: bool) -> None:
        if is_turned:
            self._reverse(i, i + 1)
        begin, end = (i, place + 1) if place > i else (place + 1, i + 1)
        part, by = slice(begin, end), -1 if place > i else 1
        for numbers in (self.order, self.is_turned, self._first, self._last):
            numbers[part] = np.roll(numbers[part], by, axis=0)


def _distance(points: Vectors, others: Vectors) -> Vectors:
    difference = points - others
    found: Vectors = np.sqrt((difference * difference).sum(axis=-1))
    return found


def _best_entries(
    contours: Contours, visits: list[Visit], entries: Sequence[list[Entry]], start: Point
) -> list[Visit]:
    """Begin each closed chain where the moves to and from it are shortest together."""
    first, last = terminals(contours, visits)
    chosen = list(visits)
    here = np.array(start)
    for k, visit in enumerate(visits):
        if entries[k]:
            points = np.array([entry.point for entry in entries[k]])
            length = _distance(points, here)
            if k + 1 < len(visits):
                length = length + _distance(points, first[k + 1])
            best = int(np.argmin(length))
            chosen[k] = Visit(visit.chain, entry=entries[k][best])
            here = points[best]
        else:
            here = last[k]
    return chosen


# ---- chains inside others


def depths(contours: Contours, chains: Sequence[Chain]) -> list[int]:
    """The number of closed chains around each chain, seen along z."""
    outlines = [_outline(contours, chain) for chain in chains]
    low = np.array([outline.min(axis=0) for outline in outlines]).reshape(-1, 2)
    high = np.array([outline.max(axis=0) for outline in outlines]).reshape(-1, 2)
    found = np.zeros(len(chains), dtype=int)
    for k, chain in enumerate(chains):
        if not chain.is_closed:
            continue
        within = (low >= low[k]).all(axis=1) & (high <= high[k]).all(axis=1)
        within[k] = False
        for other in np.flatnonzero(within):
            found[other] += _contains(outlines[k], outlines[other][0])
    return found.tolist()


def _outline(contours: Contours, chain: Chain) -> Vectors:
    """Points of a chain in the plane x, y; curves by eight chords each."""
    points: list[Sequence[float]] = []
    for step in steps_of(contours, Visit(chain)):
        points.append(step.start[:2])
        if step.kind != LINE:
            points += points_within(step, 7)[:, :2].tolist()
    return np.array(points)


def _contains(outline: Vectors, point: Vectors) -> bool:
    """Whether a point is inside a polygon (even-odd)."""
    x, y = point
    first, second = outline, np.roll(outline, -1, axis=0)
    crosses = (first[:, 1] > y) != (second[:, 1] > y)
    first, second = first[crosses], second[crosses]
    at = first[:, 0] + (y - first[:, 1]) / (second[:, 1] - first[:, 1]) * (
        second[:, 0] - first[:, 0]
    )
    return bool((at > x).sum() % 2)
