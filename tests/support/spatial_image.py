# SPDX-License-Identifier: MIT
"""Spatial segments in integers: their exact geometry, and program images of them without the planner. Used by tests of
programs in space and by tests/data/make_golden. No I/O.
"""

from __future__ import annotations

import itertools
import math
import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from hodograph.feed import ControllerLimits, FeedRequest, Limits, plan_feed
from hodograph.program import Program, compile_program, encode
from hodograph.program.image import HEADER_SIZE, SEGMENT_SIZE, with_crc
from hodograph.spline import line

Q40 = 1 << 40
Q44 = 1 << 44
COMPONENTS = 4
_DIVISORS = (1, 1, 3, 1, 1)


@dataclass
class Extra:
    """An extra axis of a segment: start and Bezier coefficients 1 … 5 from it, in 2^-40 mm or degrees."""

    start: int
    b: list[int]


@dataclass
class Segment:
    """A segment as in docs/reference/protocol.md 1.2: a[component][Bernstein coefficient] in 2^-44."""

    start: int
    point: list[int]
    a: list[list[int]]
    extras: list[Extra] = field(default_factory=list)

    def hodograph(self) -> list[list[Fraction]]:
        """Bernstein coefficients (4 of 5, mm) of x', y', z' and sigma, exact."""
        return [self._coefficients(form) for form in (_x, _y, _z, _sigma)]

    def _coefficients(self, form: Callable[[list[int], list[int]], int]) -> list[Fraction]:
        """Of one of them. Sums are of integers, which takes a small part of the time of fractions."""
        columns = [[row[k] for row in self.a] for k in range(3)]
        e = [0] * 5
        for i, j, weight, to in (
            (0, 0, 1, 0), (0, 1, 1, 1), (0, 2, 1, 2), (1, 1, 2, 2), (1, 2, 1, 3), (2, 2, 1, 4),
        ):  # fmt: skip
            e[to] += weight * form(columns[i], columns[j])
        return [Fraction(c, d * Q44 * Q44) for c, d in zip(e, _DIVISORS, strict=True)]

    def ways(self) -> list[Fraction]:
        """Distances in x, y, z and along the segment, mm."""
        return [sum(row, Fraction(0)) / 5 for row in self.hodograph()]

    def ratio(self) -> Fraction:
        """Of the greatest to the least Bernstein coefficient of sigma; 0 where one is not positive."""
        sigma = self._coefficients(_sigma)
        return max(sigma) / min(sigma) if min(sigma) > 0 else Fraction(0)

    def beziers(self) -> list[list[Fraction]]:
        """Bezier coefficients of all path axes, and after them of the arc length from the start, in mm."""
        out = []
        for row, start in zip(self.hodograph(), (*self.point, 0), strict=True):
            bezier = [Fraction(start, Q40)]
            for c in row:
                bezier.append(bezier[-1] + c / 5)
            out.append(bezier)
        extras = [[Fraction(e.start + b, Q40) for b in (0, *e.b)] for e in self.extras]
        return [*out[:3], *extras, out[3]]

    def at(self, xi: Any) -> list[Any]:
        """Positions of all path axes and the arc length from the start, in mm, at any number xi."""
        return [
            bernstein([xi * 0 + like(xi, value) for value in row], xi) for row in self.beziers()
        ]

    def at_powers(self, axis: int) -> list[float]:
        """A path axis, or after the last the arc length, in powers of xi, from the start; mm."""
        if 3 <= axis < 3 + len(self.extras):
            bezier = [Fraction(b, Q40) for b in (0, *self.extras[axis - 3].b)]
        else:
            bezier = [Fraction(0)]
            for c in self.hodograph()[min(axis, 3)]:
                bezier.append(bezier[-1] + c / 5)
        return [
            float(
                math.comb(5, k)
                * sum((-1) ** (k - i) * math.comb(k, i) * bezier[i] for i in range(k + 1))
            )
            for k in range(6)
        ]

    def encode(self) -> bytes:
        """The bytes of the image."""
        out = struct.pack("<4q", self.start, *self.point)
        out += b"".join(_i48(self.a[c][k]) for k in range(3) for c in range(COMPONENTS))
        for extra in self.extras:
            out += struct.pack("<q", extra.start) + b"".join(_i48(b) for b in extra.b)
        return out


def chain(preimages: list[list[list[int]]], point: list[int]) -> list[Segment]:
    """Segments that follow each other from `point` (2^-40 mm) on; their starts are the exact sums, rounded once."""
    segments = []
    place = [Fraction(p) for p in point] + [Fraction(0)]
    for a in preimages:
        one = Segment(round(place[3]), [round(p) for p in place[:3]], a)
        segments.append(one)
        place = [p + way * Q40 for p, way in zip(place, one.ways(), strict=True)]
    return segments


def wandering(count: int, length_mm: float, bend: float = 0.6) -> list[list[list[int]]]:
    """Preimages of segments of about this length on a smooth curve that turns in all directions.

    A is a quadratic B-spline, so r' is C1 and the direction goes on exactly at the joints.
    """
    size = math.sqrt(length_mm) * Q44
    z = [
        [
            round(size * v)
            for v in (
                math.cos(bend * i),
                0.4 * math.sin(0.7 * bend * i + 1),
                0.6 * math.sin(1.3 * bend * i),
                math.sin(bend * i),
            )
        ]
        for i in range(count + 2)
    ]
    means = [[(u + v) // 2 for u, v in zip(a, b, strict=True)] for a, b in itertools.pairwise(z)]
    return [
        [[means[i][c], z[i + 1][c], means[i + 1][c]] for c in range(COMPONENTS)]
        for i in range(count)
    ]


def add_extra(segments: list[Segment], amplitude: float, wave_mm: float, phase: float) -> None:
    """An extra axis amplitude sin(s / wave + phase), C2 by arc length, to all segments."""

    def ends(one: Segment) -> list[list[float]]:
        """Value and two derivatives by xi at both ends."""
        sigma = [float(c) for c in one.hodograph()[3]]
        way = float(one.ways()[3])
        out = []
        for s, speed, rise in (
            (0.0, sigma[0], 4 * (sigma[1] - sigma[0])),
            (way, sigma[4], 4 * (sigma[4] - sigma[3])),
        ):
            at = (one.start / Q40 + s) / wave_mm + phase
            sine, cosine = amplitude * math.sin(at), amplitude * math.cos(at)
            first, second = cosine / wave_mm, -sine / wave_mm**2
            out.append([sine, first * speed, second * speed**2 + first * rise])
        return out

    both = [ends(one) for one in segments]
    starts = [round(e[0][0] * Q40) for e in both] + [round(both[-1][1][0] * Q40)]
    for one, (a, b), start, end in zip(segments, both, starts, starts[1:], strict=False):
        last = (end - start) / Q40
        b1 = a[1] / 5
        b4 = last - b[1] / 5
        inner = (a[2] / 20 + 2 * b1, b[2] / 20 + 2 * b4 - last)
        middle = [round(v * Q40) for v in (b1, *inner, b4)]
        one.extras.append(Extra(start, [*middle, end - start]))


def length_mm(segments: list[Segment]) -> float:
    """Of the whole path."""
    return float(sum((one.ways()[3] for one in segments), Fraction(0)))


def feed_along(
    segments: list[Segment],
    feed_mm_s: float,
    ramp_s: float,
    controller: ControllerLimits,
    period_us: int = 1000,
) -> Program:
    """A feed of that length: a planar program along a straight line."""
    limits = Limits(None, 2000.0, 50000.0, "report")
    request = FeedRequest("minimax", feed_mm_s, ramp_s)
    spline = line(0, length_mm(segments))
    plan = plan_feed(spline.length_mm, request, limits, controller, period_us=period_us)
    return compile_program(spline, plan)


def image(segments: list[Segment], feed: Program, axis_count: int | None = None) -> bytes:
    """The image of these segments with the pieces, stops and header of a planar program of the same length."""
    axes = 3 + len(segments[0].extras) if axis_count is None else axis_count
    planar = encode(feed)
    head = bytearray(planar[:HEADER_SIZE])
    tail = planar[HEADER_SIZE + SEGMENT_SIZE * feed.segment_count :]
    body = bytes(8 * (axes - 2)) + b"".join(one.encode() for one in segments) + tail
    struct.pack_into("<H", head, 6, HEADER_SIZE + 8 * (axes - 2))
    struct.pack_into("<I", head, 8, HEADER_SIZE + len(body))
    struct.pack_into("<I", head, 20, len(segments))
    struct.pack_into("<H", head, 30, axes)
    return with_crc(bytes(head) + body)


def embedded(program: Program) -> list[Segment]:
    """The segments of a planar program at z = 0."""
    rows = zip(program.start_q40, *program.point_q40, *program.a_q44, strict=True)
    none = [0, 0, 0]
    return [
        Segment(int(s), [int(x), int(y), 0], [_ints(u), none, none, _ints(v)])
        for s, x, y, u, v in rows
    ]


def _ints(values: Any) -> list[int]:
    return [int(value) for value in values]


def _i48(value: int) -> bytes:
    return value.to_bytes(6, "little", signed=True)


def bernstein(c: list[Any], xi: Any) -> Any:
    """Bernstein coefficients at xi, by de Casteljau."""
    values = list(c)
    while len(values) > 1:
        values = [a + (b - a) * xi for a, b in itertools.pairwise(values)]
    return values[0]


def like(xi: Any, value: Fraction) -> Any:
    """The fraction in the arithmetic of xi."""
    if isinstance(xi, Fraction):
        return value
    return type(xi)(value.numerator) / value.denominator


def _x(a: list[int], b: list[int]) -> int:
    return a[0] * b[0] + a[1] * b[1] - a[2] * b[2] - a[3] * b[3]


def _y(a: list[int], b: list[int]) -> int:
    return a[0] * b[3] + a[3] * b[0] + a[1] * b[2] + a[2] * b[1]


def _z(a: list[int], b: list[int]) -> int:
    return a[1] * b[3] + a[3] * b[1] - a[0] * b[2] - a[2] * b[0]


def _sigma(a: list[int], b: list[int]) -> int:
    return sum(u * v for u, v in zip(a, b, strict=True))
