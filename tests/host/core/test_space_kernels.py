# SPDX-License-Identifier: MIT
"""The kernels in space against 40-digit arithmetic, within the bounds of docs/theory/numerics.md sections 9 to 12. Run
by pytest; builds and runs segment_points.c (gcc), and writes to temporary folders.
"""

from __future__ import annotations

import math
import random
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import Any

import mpmath as mp
import pytest

from core_sources import FIRMWARE, point_sources
from spatial_image import Q40, Q44, Extra, Segment, bernstein, like

KERNELS = ("fixed", "float", "double")
BOUND_MM = {"fixed": 2.0**-36, "float": 5e-6, "double": 3e-11}
EXTRA_BOUND = {"fixed": 1e-6, "float": 1e-5, "double": 1e-9}
ARC_BOUND_MM = 2.0**-40
"""The arc length itself is a multiple of this; an extra axis may turn by a large angle within this length."""

Quaternion = tuple[float, float, float, float]


def times(a: Quaternion, b: Quaternion) -> Quaternion:
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )


def scaled(shape: list[Quaternion], length_mm: float, turn: Quaternion, start: int) -> Segment:
    """The shape, rotated by `turn` and scaled to `length_mm`; the coefficients of its preimage are rounded as in a
    program image.
    """
    size = math.sqrt(sum(c * c for c in turn))
    unit: Quaternion = (turn[0] / size, turn[1] / size, turn[2] / size, turn[3] / size)
    turned = [times(unit, q) for q in shape]
    draft = Segment(0, [0, 0, 0], [[round(q[c] * Q44) for q in turned] for c in range(4)])
    factor = math.sqrt(length_mm / float(draft.ways()[3]))
    a = [[math.floor(v * factor) for v in row] for row in draft.a]
    return Segment(start, [start % (1 << 51), -(start % (1 << 50)), start % (1 << 49)], a)


def wild(rng: random.Random) -> list[Quaternion]:
    """A shape whose speed reaches almost the ratio of 2."""
    first: Quaternion = (1.0, 0.0, 0.0, 0.0)
    while True:
        middle = [rng.uniform(-2.5, 2.5) if rng.random() < 0.5 else rng.uniform(0, 1.5)] + [
            rng.gauss(0, 0.8) for _ in range(3)
        ]
        last = [rng.gauss(0, 0.8) for _ in range(4)]
        shape = [first, (*middle,), (*last,)]
        a = [[round(q[c] * Q44) for q in shape] for c in range(4)]
        if 1.5 < Segment(0, [0] * 3, a).ratio() < 1.999:
            return shape  # type: ignore[return-value]


HELIX: list[Quaternion] = [(1.0, 0.3, 0.0, 0.0), (0.95, 0.3, 0.1, 0.25), (0.85, 0.25, 0.2, 0.45)]
STRAIGHT: list[Quaternion] = [(1.0, 0.0, 0.0, 0.0)] * 3
UNEVEN: list[Quaternion] = [(1.0, 0.0, 0.0, 0.0), (1.2, 0.0, 0.0, 0.0), (1.41, 0.0, 0.0, 0.0)]
TURNS: dict[str, Quaternion] = {
    "along x": (1.0, 0.0, 0.0, 0.0),
    "back along x": (0.0, 0.0, 1.0, 0.0),  # u = v = 0
    "back along x, turned": (0.0, 0.0, 0.6, 0.8),
    "along y": (1.0, 0.0, 0.0, 1.0),
    "up": (1.0, 0.0, -1.0, 0.0),
    "down": (1.0, 0.0, 1.0, 0.0),
    "askew": (0.3, -0.7, 0.2, 0.9),
}
LENGTHS_MM = (31.9, 31.0, 5.0, 0.1, 1e-3, 1e-6, 2.0**-30, 2.0**-33)


def cases() -> Iterator[Segment]:
    rng = random.Random(5)
    for length_mm in LENGTHS_MM:
        for turn in TURNS.values():
            for shape in (STRAIGHT, UNEVEN, HELIX):
                yield scaled(shape, length_mm, turn, rng.randrange(1 << 61))
        for _ in range(25):
            turn = (rng.gauss(0, 1), rng.gauss(0, 1), rng.gauss(0, 1), rng.gauss(0, 1))
            yield scaled(wild(rng), length_mm, turn, rng.randrange(1 << 61))


def with_extras(segment: Segment, rng: random.Random, most: int) -> Segment:
    """Three extra axes: any, far, and at rest."""
    extras = [
        Extra(rng.randrange(-(1 << 51), 1 << 51), [rng.randrange(-most, most) for _ in range(5)]),
        Extra((1 << 52) - 1, [most - 1, 1 - most] * 2 + [most - 1]),
        Extra(rng.randrange(1 << 50), [0] * 5),
    ]
    return Segment(segment.start, segment.point, segment.a, extras)


def asked(segment: Segment, arc_q40: int) -> str:
    extras = [v for extra in segment.extras for v in (extra.start, *extra.b)]
    a = [v for row in segment.a for v in row]
    return " ".join(
        str(v)
        for v in (3 + len(segment.extras), segment.start, *segment.point, *a, *extras, arc_q40)
    )


@dataclass(frozen=True)
class Exact:
    """A segment in numbers of 40 digits: Bezier coefficients of the axes and of the arc length, sigma's."""

    axes: list[list[Any]]
    arc: list[Any]
    sigma: list[Any]

    @classmethod
    def of(cls, segment: Segment) -> Exact:
        *axes, arc = [[like(mp.mpf(0), c) for c in row] for row in segment.beziers()]
        return cls(axes, arc, [like(mp.mpf(0), c) for c in segment.hodograph()[3]])

    def point(self, mm: Any) -> tuple[list[float], list[float], list[int]]:
        """At an arc length: rests of positions to whole 2^-40, slopes of the axes by arc length, the whole ones."""
        xi = mm / self.arc[-1]
        for _ in range(60):
            speed = bernstein(self.sigma, xi)
            step = (bernstein(self.arc, xi) - mm) / speed
            xi -= step
            if abs(step) < mp.mpf(10) ** -35:
                break
        positions = [bernstein(row, xi) * Q40 for row in self.axes]
        whole = [int(mp.nint(p)) for p in positions]
        rests = [float(p - w) for p, w in zip(positions, whole, strict=True)]
        slopes = [
            float(abs(bernstein([5 * (b - a) for a, b in pairwise(row)], xi) / speed))
            for row in self.axes
        ]
        return rests, slopes, whole


@pytest.fixture(scope="module")
def points(tmp_path_factory: pytest.TempPathFactory) -> Callable[[list[str]], list[list[int]]]:
    target = tmp_path_factory.mktemp("core") / "segment_points"
    command = ["gcc", "-std=c99", "-O1", "-ffp-contract=off", "-fsanitize=undefined"]
    command += ["-fno-sanitize-recover=undefined", f"-I{FIRMWARE}"]
    own = str(Path(__file__).with_name("segment_points.c"))
    subprocess.run([*command, own, *point_sources(), "-o", str(target)], check=True)

    def ask(lines: list[str]) -> list[list[int]]:
        text = "\n".join([*lines, "0"]) + "\n"
        out = subprocess.run([str(target)], input=text, capture_output=True, text=True, check=False)
        assert out.returncode == 0, out.stderr
        return [[int(v) for v in line.split()] for line in out.stdout.splitlines()]

    return ask


def rounding(segment: Segment, axis: int) -> float:
    """10 units of 31 bits of the powers from z^2 on, at most 31 times the greatest Bezier coefficient in all."""
    most = max(abs(b) for b in segment.extras[axis - 3].b) / Q40
    return 10 * 31 * most * 2.0**-31


def compared(
    points: Callable[[list[str]], list[list[int]]], segments: list[Segment]
) -> Iterator[tuple[Segment, str, int, float, float]]:
    """Segment, kernel, axis, error in mm, slope of the axis by arc length."""
    rng = random.Random(7)
    asked_for = [
        (segment, segment.start + int(part * int(segment.ways()[3] * Q40)))
        for segment in segments
        for part in (0.0, 1.0, rng.random(), rng.random())
    ]
    known = {id(segment): Exact.of(segment) for segment in segments}
    lines = [asked(*one) for one in asked_for]
    for (segment, arc_q40), found in zip(asked_for, points(lines), strict=True):
        mm = mp.mpf(arc_q40 - segment.start) / Q40
        rests, slopes, whole = known[id(segment)].point(mm)
        axes = len(whole)
        for number, kernel in enumerate(KERNELS):
            own = found[number * axes : (number + 1) * axes]
            for axis in range(axes):
                error = abs(own[axis] - whole[axis] - rests[axis]) / Q40
                yield segment, kernel, axis, error, slopes[axis]


@pytest.fixture(autouse=True)
def digits() -> Iterator[None]:
    with mp.workdps(40):
        yield


def test_within_the_bounds(points: Callable[[list[str]], list[list[int]]]) -> None:
    worst = dict.fromkeys(KERNELS, 0.0)
    for segment, kernel, axis, error, _ in compared(points, list(cases())):
        assert error <= BOUND_MM[kernel], (segment, kernel, axis)
        worst[kernel] = max(worst[kernel], error)
    assert worst["float"] > 10 * worst["fixed"] > 0  # an error of 0: nothing is compared


def test_extra_axes_are_within_the_bounds(points: Callable[[list[str]], list[list[int]]]) -> None:
    rng = random.Random(11)
    segments = [
        with_extras(one, rng, rng.choice([1 << 47, 1 << 40, 1 << 30])) for one in list(cases())[::3]
    ]
    seen = 0.0
    for segment, kernel, axis, error, slope in compared(points, segments):
        if axis >= 3:
            assert error <= EXTRA_BOUND[kernel] + slope * ARC_BOUND_MM + rounding(segment, axis), (
                segment,
                kernel,
                axis,
            )
            seen = max(seen, error)
    assert seen > 0


def test_z_constant_is_the_planar_segment(points: Callable[[list[str]], list[list[int]]]) -> None:
    """The same bits from the same w, by the fixed kernel."""
    rng = random.Random(3)
    lines = []
    for length_mm in LENGTHS_MM:
        for _ in range(20):
            flat: list[Quaternion] = [
                (1.0, 0.0, 0.0, 0.0),
                (rng.uniform(0.8, 1.2), 0.0, 0.0, rng.uniform(-0.4, 0.4)),
                (rng.uniform(0.8, 1.2), 0.0, 0.0, rng.uniform(-0.4, 0.4)),
            ]
            one = scaled(flat, length_mm, (rng.gauss(0, 1), 0.0, 0.0, rng.gauss(0, 1)), 0)
            if not 0 < one.ratio() < 2:
                continue
            arc = int(rng.random() * one.ways()[3] * Q40)
            lines.append((asked(one, arc), "2" + asked(one, arc)[1:]))
    space = points([a for a, _ in lines])
    plane = points([b for _, b in lines])
    assert len(lines) > 50
    for a, b, (line, _) in zip(space, plane, lines, strict=True):
        assert a[:2] == b[:2], line
        assert a[2] == int(line.split()[4])


def test_the_exact_geometry_is_that_of_the_quaternion() -> None:
    """r' = A i A* as in docs/reference/protocol.md 1.2, by the product of quaternions."""
    rng = random.Random(2)
    a: Quaternion = (rng.random(), rng.random(), rng.random(), rng.random())
    rounded = [[round(c * Q44)] * 3 for c in a]
    conjugate = (a[0], -a[1], -a[2], -a[3])
    product = times(times(a, (0.0, 1.0, 0.0, 0.0)), conjugate)
    found = Segment(0, [0, 0, 0], rounded).ways()
    for axis in range(3):
        assert float(found[axis]) == pytest.approx(product[1 + axis], abs=1e-12)
    assert isinstance(found[3], Fraction)
