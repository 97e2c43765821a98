# SPDX-License-Identifier: MIT
"""Drawings as toolpaths: the common part of the readers of DXF and SVG. Used by toolpath/dxf, toolpath/svg and
toolpath/files. No I/O.

A reader fills a `Drawing`: contours in groups (layer and colour), and notes of what it left out. `commands` then joins
the contours, orders them, and gives the moves: rapid to each contour, and along it at the feed of its group.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ..errors import InputError, ToolpathError
from .contours import ARC, LINE, Affine, Contours, Point, Step, as_spline
from .moves import (
    ORIGIN,
    ArcMove,
    Command,
    Feed,
    FeedMode,
    Message,
    Plane,
    Position,
    ProgramEnd,
    SplineMove,
    StraightMove,
)
from .ordering import (
    Chain,
    Visit,
    arrange,
    depths,
    end_of,
    in_file_order,
    join,
    rapid_length,
    steps_of,
)

ORDERS = ("short", "inside-first", "file")
"""Orders of contours: for short rapid moves; inner contours before the ones around them, then for short rapid moves; as
in the file.
"""

_SAME_DIGITS = 6
"""Decimals of mm in which contours are compared."""

MOST_COPIES = 1_000_000
"""Most steps that copies (DXF blocks, SVG `use`) may add to a drawing."""


@dataclass(frozen=True)
class DrawingOptions:
    """How a drawing becomes a toolpath.

    feed_mm_s   feed of contours without an entry in `feeds`
    feeds       feed by the name of a layer, or by a colour: "#rrggbb", or its number in DXF. A layer comes first.
    unit_mm     length of a unit of the drawing; None: that of the file. A file without unit is refused.
    scale       factor on all lengths of the drawing
    layers      names of the layers to take, in the order in which they are machined; empty: all, in one
    ids         identities of the elements to take (SVG: id, DXF: handle); empty: all
    gap_mm      ends of contours of one group that are this near are joined
    order       one of ORDERS
    z_mm        height of the drawing's plane
    lift_mm     height of rapid moves above the highest point of the drawing; 0: at the height of the contours
    start       position at which the toolpath starts
    strict      whether text, images and other elements without curves are refused; False: they are left out with a
    message Raises InputError: a number or name out of its range.
    """

    feed_mm_s: float
    feeds: Mapping[str, float] = field(default_factory=dict)
    unit_mm: float | None = None
    scale: float = 1.0
    layers: Sequence[str] = ()
    ids: Sequence[str] = ()
    gap_mm: float = 0.01
    order: str = "short"
    z_mm: float = 0.0
    lift_mm: float = 0.0
    start: Position = ORIGIN
    strict: bool = False

    def __post_init__(self) -> None:
        """Check the ranges."""
        for name, feed in (("the feed", self.feed_mm_s), *self.feeds.items()):
            if not 0.0 < feed < 1e6:
                raise InputError(f"feed of {name}: {feed:g} mm/s is not a positive feed")
        if self.unit_mm is not None and not 1e-9 < self.unit_mm < 1e9:
            raise InputError(
                f"unit of the drawing: {self.unit_mm:g} mm must be above 1e-9 mm, below 1e9 mm"
            )
        if not 1e-9 < self.scale < 1e9:
            raise InputError(f"scale of the drawing: {self.scale:g} must be above 1e-9, below 1e9")
        if (
            not 0.0 <= self.gap_mm < 1e6
            or not 0.0 <= self.lift_mm < 1e6
            or not abs(self.z_mm) < 1e6
        ):
            raise InputError(
                "gap, height and lift of a drawing: a finite number of mm, gap and lift at least 0"
            )
        if self.order not in ORDERS:
            raise InputError(f'order "{self.order}" is not one of: {", ".join(ORDERS)}')


class Group(NamedTuple):
    """Layer and colour of a contour: `colour` is "#rrggbb", `number` that of the colour in DXF; empty if there is
    none.
    """

    layer: str
    colour: str = ""
    number: str = ""


class Drawing:
    """Contours and notes of one file; the reader sets `contours.affine`, and the group by `select`."""

    def __init__(self, file: str, options: DrawingOptions) -> None:
        self.file = file
        self.options = options
        self.contours = Contours()
        self.last_line = 0
        self._copied = 0
        self._groups: dict[Group, int] = {}
        self._layers: dict[str, None] = {}
        self._ids: set[str] = set()
        self._notes: dict[str, tuple[int, int]] = {}
        self._assumed_line = 0

    def error(self, line: int, text: str, column: int = 1) -> ToolpathError:
        """An error at a place of the file."""
        return ToolpathError(self.file, line, column, text)

    def placement(self, unit_mm: float) -> Affine:
        """The map from the drawing to mm. `options.unit_mm` has precedence over the unit of the file."""
        size = self.options.scale * (
            unit_mm if self.options.unit_mm is None else self.options.unit_mm
        )
        return Affine.translation(0.0, 0.0, self.options.z_mm).after(
            Affine.scaling(size, size, size)
        )

    def select(self, group: Group) -> None:
        """The group of the contours that are begun from now on."""
        self.contours.group = self._groups.setdefault(group, len(self._groups))

    def takes(self, layer: str, ids: Iterable[str]) -> bool:
        """Whether the options select an element of this layer with these identities (its own and its groups')."""
        self._layers.setdefault(layer)
        wanted = set(self.options.ids)
        found = wanted.intersection(ids)
        self._ids |= found
        return (not wanted or bool(found)) and (
            not self.options.layers or layer in self.options.layers
        )

    def leave_out(self, what: str, line: int, column: int = 1) -> None:
        """Note an element that is left out. Raises ToolpathError if the options are strict."""
        if self.options.strict:
            raise self.error(
                line, f"{what} cannot be followed: remove it or convert it to paths", column
            )
        count, first = self._notes.get(what, (0, line))
        self._notes[what] = (count + 1, first)

    def assume_unit(self, line: int) -> None:
        """Note that the page at this line has no size, unless `options.unit_mm` gives the unit."""
        self._assumed_line = line if self.options.unit_mm is None else 0

    def count_copies(self, steps: int, line: int, column: int = 1) -> None:
        """Count the steps that a copy adds. Raises ToolpathError: copies add too many."""
        self._copied += steps + 1
        if self._copied > MOST_COPIES:
            raise self.error(
                line, f"copies add more than {MOST_COPIES} lines and curves: insert fewer", column
            )

    # ---- commands

    def commands(self) -> Iterator[Command]:
        """Messages, moves and the end. Raises ToolpathError: no contour; InputError: the drawing has no such layer,
        identity or colour.
        """
        feeds = self._feeds()
        yield from self._remarks()
        self._check_names()
        if not len(self.contours):
            raise self._empty()
        yield from self._repeats()
        visits, message = self._sequence()
        yield Message(0, message)
        x, y, z = self.options.start[:3]
        yield from self._moves(visits, feeds, (x, y, z))
        yield ProgramEnd(max(1, self.last_line))

    def _remarks(self) -> Iterator[Message]:
        """Messages about elements that were left out, and about what the file does not define."""
        for what, (count, first) in self._notes.items():
            yield Message(first, f"left out: {what}, {count} times, first in line {first}")
        if self._assumed_line:
            text = "the page has no size: a unit counts 1/96 inch, or as --unit says"
            yield Message(self._assumed_line, text)

    def _repeats(self) -> Iterator[Message]:
        """Message about the contours that are drawn twice."""
        if repeats := repeated(self.contours):
            first = min(self.contours.line_of(index) for index in repeats)
            text = f"drawn again: {len(repeats)} contours, first in line {first}"
            yield Message(first, f"{text}: each is followed as often as it is drawn")

    def _empty(self) -> ToolpathError:
        return self.error(max(1, self.last_line), "the drawing has no line or curve to follow")

    def _check_names(self) -> None:
        wanted = [name for name in self.options.layers if name not in self._layers]
        if wanted:
            known = _some(self._layers)
            raise InputError(f'{self.file}: no layer "{wanted[0]}" in the drawing: it has {known}')
        missing = [name for name in self.options.ids if name not in self._ids]
        if missing:
            raise InputError(f'{self.file}: nothing in the drawing has the identity "{missing[0]}"')

    def _feeds(self) -> list[Feed]:
        """The feed of each group."""
        colours = {normal_colour(name): name for name in self.options.feeds}
        used: set[str] = set()
        feeds = []
        for group in self._groups:
            names = [group.layer, colours.get(group.colour, ""), colours.get(group.number, "")]
            found = [name for name in names if name in self.options.feeds]
            used |= set(found[:1])
            speed = self.options.feeds[found[0]] if found else self.options.feed_mm_s
            feeds.append(Feed(FeedMode.PER_MINUTE, feed_mm_s=speed))
        if unused := [name for name in self.options.feeds if name not in used]:
            known = _some({name for group in self._groups for name in group})
            raise InputError(
                f'{self.file}: a feed for "{unused[0]}", which is no layer or colour of a contour: there are {known}'
            )
        return feeds

    def _sequence(self) -> tuple[list[Visit], str]:
        """The contours in their order, and a message on how much that shortens the rapid moves."""
        contours, options = self.contours, self.options
        chains = [
            chain for chain in join(contours, options.gap_mm) if _moves_at_all(contours, chain)
        ]
        if not chains:
            raise self._empty()
        start = here = (options.start[0], options.start[1], options.start[2])
        as_given = rapid_length(contours, in_file_order(chains), start)
        visits: list[Visit] = []
        for stage in self._stages(chains):
            visits += (
                in_file_order(stage) if options.order == "file" else arrange(contours, stage, here)
            )
            here = end_of(contours, visits)
        length = rapid_length(contours, visits, start)
        gain = (
            f", {100 * (1 - length / as_given):.0f} % shorter than"
            if length < as_given
            else ", against"
        )
        joined = f"{len(contours)} contours joined to {len(chains)}"
        return (
            visits,
            f"{joined}; rapid moves of {length:.1f} mm{gain} {as_given:.1f} mm in the order of the file",
        )

    def _stages(self, chains: Sequence[Chain]) -> list[list[Chain]]:
        """Groups of chains in the order of machining: by the requested layers, and by how deep chains lie inside
        others.
        """
        layers = {name: k for k, name in enumerate(self.options.layers)}
        names = [group.layer for group in self._groups]
        layer_of = [names[self.contours.group_of(chain.pieces[0][0])] for chain in chains]
        deep = [0] * len(chains)
        if self.options.order == "inside-first":
            deep = [-depth for depth in depths(self.contours, chains)]
        stages: dict[tuple[int, int], list[Chain]] = {}
        for chain, layer, depth in zip(chains, layer_of, deep, strict=True):
            stages.setdefault((layers.get(layer, 0), depth), []).append(chain)
        return [stages[key] for key in sorted(stages)]

    def _moves(
        self, visits: Sequence[Visit], feeds: Sequence[Feed], here: Point
    ) -> Iterator[Command]:
        others = self.options.start[3:]
        up = self.contours.highest() + self.options.lift_mm
        for visit in visits:
            feed = feeds[self.contours.group_of(visit.chain.pieces[0][0])]
            for number, step in enumerate(steps_of(self.contours, visit)):
                if number == 0:
                    yield from self._approach(here, step, up, feed)
                yield _move(step, others, feed)
                here = step.end
        if self.options.lift_mm and here[2] != up:
            yield StraightMove(self.last_line, _position((here[0], here[1], up), others), None)

    def _approach(self, here: Point, step: Step, up: float, feed: Feed) -> Iterator[Command]:
        """From `here` to the start of a step: rapid, with a lift up, over and down at the feed."""
        others = self.options.start[3:]
        over = []
        if self.options.lift_mm:
            over = [(here[0], here[1], max(here[2], up)), (step.start[0], step.start[1], up)]
        for point in over or [step.start]:
            if point != here:
                yield StraightMove(step.line, _position(point, others), None)
                here = point
        if over:
            yield StraightMove(step.line, _position(step.start, others), feed)


def repeated(contours: Contours) -> list[int]:
    """Contours that an earlier one of the same group has drawn already, in the same or the other direction."""
    found = []
    for alike in _with_same_ends(contours):
        known: set[tuple[object, ...]] = set()
        for index in alike:
            shape = _shape(contours, index, backwards=False)
            if shape in known:
                found.append(index)
            known |= {shape, _shape(contours, index, backwards=True)}
    return found


def _with_same_ends(contours: Contours) -> Iterator[list[int]]:
    """Contours of a group that have as many steps and the same ends as others, in the order of the file."""
    ends = np.round(contours.ends(), _SAME_DIGITS).reshape(-1, 6) + 0.0
    start, end = ends[:, :3], ends[:, 3:]
    # Of both directions, the one in which the first coordinate that differs rises.
    differs = start != end
    first = np.argmax(differs, axis=1)[:, None]
    falls = np.take_along_axis(start, first, 1) > np.take_along_axis(end, first, 1)
    ends = np.where(falls, np.hstack((end, start)), ends)
    order = np.lexsort(ends.T)
    same = (ends[order[1:]] == ends[order[:-1]]).all(axis=1)
    for run in np.split(order, np.flatnonzero(~same) + 1):
        if run.size < 2:
            continue
        alike: dict[tuple[int, int], list[int]] = {}
        for index in sorted(run.tolist()):
            key = contours.group_of(index), contours.length_of(index)
            alike.setdefault(key, []).append(index)
        yield from (one for one in alike.values() if len(one) > 1)


def _shape(contours: Contours, index: int, *, backwards: bool) -> tuple[object, ...]:
    """The geometry of the steps of a contour, for comparison."""

    def rounded(points: Iterable[Point]) -> tuple[object, ...]:
        return tuple(round(value, _SAME_DIGITS) + 0.0 for point in points for value in point)

    shape: list[object] = []
    for step in contours.steps(index, backwards=backwards):
        spline = () if step.spline is None else rounded(step.spline.points.tolist())
        shape.append((step.kind, rounded((step.start, *step.controls, step.end)), spline))
    return tuple(shape)


def _moves_at_all(contours: Contours, chain: Chain) -> bool:
    """Whether a chain has a step. If its ends are moved together within the gap, none may remain."""
    return next(steps_of(contours, Visit(chain)), None) is not None


def _some(names: Iterable[str]) -> str:
    """Up to twenty names."""
    return ", ".join(sorted(filter(None, names))[:20]) or "none"


def _position(point: Point, others: tuple[float, ...]) -> Position:
    a, b, c = others
    return (*point, a, b, c)


def _move(step: Step, others: tuple[float, ...], feed: Feed) -> StraightMove | ArcMove | SplineMove:
    end = _position(step.end, others)
    if step.kind == LINE:
        return StraightMove(step.line, end, feed)
    if step.kind == ARC:
        x, y, turns = step.controls[0]
        return ArcMove(step.line, end, Plane.XY, (x, y), int(turns), feed)
    spline = as_spline(step)
    points = tuple(_position((x, y, z), others) for x, y, z in spline.points.tolist())
    weights, knots = tuple(spline.weights.tolist()), tuple(spline.knots.tolist())
    return SplineMove(step.line, points, weights, knots, spline.degree, feed)


_SHORT_COLOUR = re.compile(r"#([0-9a-f])([0-9a-f])([0-9a-f])")
_RGB = re.compile(r"rgb\(\s*(\d{1,3})\s*[, ]\s*(\d{1,3})\s*[, ]\s*(\d{1,3})\s*\)")


def normal_colour(text: str) -> str:
    """A colour as "#rrggbb" if it is written as #rgb, #rrggbb, rgb(r, g, b) or by its name; other text as it is."""
    name = text.strip()
    small = name.lower()
    if match := _SHORT_COLOUR.fullmatch(small):
        return "#" + "".join(2 * digit for digit in match.groups())
    if match := _RGB.fullmatch(small):
        return "#" + "".join(f"{min(int(part), 255):02x}" for part in match.groups())
    if re.fullmatch(r"#[0-9a-f]{6}", small):
        return small
    if small.isalpha():
        from matplotlib.colors import CSS4_COLORS  # the names that SVG has too

        return str(CSS4_COLORS[small]).lower() if small in CSS4_COLORS else name
    return name
