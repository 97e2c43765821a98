# SPDX-License-Identifier: MIT
"""Worst-case programs: as expensive as the controller accepts, with the commands to run them. Used by analysis/campaign
and tools/count_tick. No I/O.

At 200 % many ticks cross two ends of segments and two of pieces: a very short and a long one alternate, together just
longer than docs/reference/protocol.md 1.2 and 1.3 require. Segments have the greatest speed ratio. The override bounds
of the pieces make the look-ahead window of the override as long as possible.

Only + - * / and roots of Python's own numbers: the same bytes on every machine.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from hodograph.feed.override_levels import FACTOR_ONE_Q14, LEVELS, rate_codes, second_codes
from hodograph.feed.pieces import FeedPieces
from hodograph.program import Program, check, encode
from hodograph.program.stop_planning import with_bounds
from hodograph.program.stops import Stops

W = tuple[complex, complex, complex]

HOLD, RESUME = 1000, 1001  # tests/target/commands.h
_FEED_MM_S = 100.0
_PERIOD_S = 1e-3
_RAMP_Q32 = 1 << 27  # 2^-5 s
_PAIR_MM = 2 * _FEED_MM_S * _PERIOD_S * 1.002
_PAIR_S = 2 * _PERIOD_S * 1.001
_Q32, _Q40, _Q44 = 2.0**32, 2.0**40, 2.0**44
_SEED = 4

Bounds = tuple[float, float, float]  # factor, rate per s, second rate per s^2


@dataclass(frozen=True)
class Adversary:
    """A program and its commands."""

    name: str
    bounds: Callable[[random.Random, int], Bounds]
    pieces: int = 70
    short_s: float = 2e-5
    short_mm: float = 2e-3


def _wide(_rng: random.Random, _index: int) -> Bounds:
    return 2.0, 200.0, 2e5


def _scattered(rng: random.Random, _index: int) -> Bounds:
    factor = 1.0 + rng.random() * (rng.random() < 0.5)
    return factor, rng.choice((5.0, 20.0, 80.0, 300.0)), rng.choice((1e3, 1e4, 1e5, 1e6))


def _ladder(_rng: random.Random, index: int) -> Bounds:
    """Sixteen pieces, each with lower bounds than the one before, so that each longer look-ahead window has lower
    bounds.
    """
    step = index % 16
    return 2.0 - step / 32, 150.0 * math.ldexp(1.0, -step // 3), 3e5 * math.ldexp(1.0, -step // 2)


def _narrow(rng: random.Random, index: int) -> Bounds:
    """One piece with low bounds among many without: repeated attempts above it, and back."""
    return (1.0, 20.0, 2e4) if index % 60 == 0 else (2.0, 300.0 + rng.random(), 1e6)


ADVERSARIES = (
    Adversary("dense", _wide),
    Adversary("scattered", _scattered),
    Adversary("ladder", _ladder),
    Adversary("narrow", _narrow),
)


def image(adversary: Adversary) -> bytes:
    """The program's image; it is one that the controller accepts."""
    rng = random.Random(_SEED)
    pieces = _durations(adversary)
    length_mm = _FEED_MM_S * (_RAMP_Q32 + sum(pieces)) / _Q32
    path = _path(rng, adversary, length_mm)
    program = _program(adversary, path, _feed(rng, adversary, pieces, path.end[2]), sum(pieces))
    fault = check(program)
    if fault is not None:
        raise RuntimeError(f"{adversary.name}: {fault}")
    return encode(program)


def _durations(adversary: Adversary) -> list[int]:
    """Durations of the pieces of constant feed, 2^-32 s."""
    return [
        round((adversary.short_s if i % 2 == 0 else _PAIR_S - adversary.short_s) * _Q32)
        for i in range(adversary.pieces)
    ]


class _Path:
    """Segments that meet exactly, in image units."""

    def __init__(self) -> None:
        self.rows: list[tuple[int, ...]] = []
        self.end = (0, 0, 0)
        self.direction: complex = 1.0

    def add(self, w: W) -> None:
        """A segment along `w` (mm^(1/2)), turned so that it goes on where the path ends."""
        turn = self.direction * w[0].conjugate()
        turn /= _size(turn)
        u = [round((c * turn).real * _Q44) for c in w]
        v = [round((c * turn).imag * _Q44) for c in w]
        self.rows.append((self.end[2], self.end[0], self.end[1], *u, *v))
        total = [0, 0, 0]
        for i, j, weight in ((0, 0, 3), (0, 1, 3), (0, 2, 1), (1, 1, 2), (1, 2, 3), (2, 2, 3)):
            total[0] += weight * (u[i] * u[j] - v[i] * v[j])
            total[1] += weight * (u[i] * v[j] + v[i] * u[j])
            total[2] += weight * (u[i] * u[j] + v[i] * v[j])
        half = 15 << 47
        x, y, s = ((a + half) // (15 << 48) for a in total)
        self.end = (self.end[0] + x, self.end[1] + y, self.end[2] + s)
        self.direction = complex(u[2], v[2])


def _path(rng: random.Random, adversary: Adversary, length_mm: float) -> _Path:
    """Short and long segments in turn until about this length."""
    path = _Path()
    long_mm = _PAIR_MM - adversary.short_mm
    pairs = int(length_mm / _PAIR_MM)
    for k in range(pairs):
        path.add(_hard(rng, adversary.short_mm))
        path.add(_hard(rng, long_mm if k + 1 < pairs else length_mm - pairs * _PAIR_MM + long_mm))
    return path


def _size(a: complex) -> float:
    return math.sqrt(a.real * a.real + a.imag * a.imag)


def _hard(rng: random.Random, length_mm: float) -> W:
    """w of a segment close to the greatest speed ratio."""
    while True:
        a, b, c = (complex(rng.uniform(-1, 1), rng.uniform(-1, 1)) for _ in range(3))
        middle = (_dot(a, c) + 2 * _dot(b, b)) / 3
        sigma = (_dot(a, a), _dot(a, b), middle, _dot(b, c), _dot(c, c))
        if min(sigma) > 0 and 1.8 < max(sigma) / min(sigma) < 1.999:
            scale = math.sqrt(length_mm * 5 / sum(sigma))
            return a * scale, b * scale, c * scale


def _dot(a: complex, b: complex) -> float:
    return a.real * b.real + a.imag * b.imag


@dataclass(frozen=True)
class _Piece:
    duration: int
    start: int
    c: tuple[int, ...]
    bounds: Bounds


def _feed(
    rng: random.Random, adversary: Adversary, durations: Iterable[int], length_q40: int
) -> list[_Piece]:
    """A ramp, the constant pieces and a ramp that ends at the path's end."""
    distance = _FEED_MM_S * _RAMP_Q32 / _Q32 * _Q40
    up = (0, 0, 0, round(2.5 * distance), round(-3 * distance), round(distance), 0)
    ramp_bounds = (2.0, 300.0, 1e6)
    pieces = [_Piece(_RAMP_Q32, 0, up, ramp_bounds)]
    at = sum(up)
    for index, duration in enumerate(durations):
        exponent = (duration - 1).bit_length() - 32
        slope = round(_FEED_MM_S * 2.0**exponent * _Q40)
        pieces.append(_Piece(duration, at, (slope, *[0] * 6), adversary.bounds(rng, index)))
        at += (slope * duration) >> (32 + exponent)
    distance = 2.0 * (length_q40 - at)
    down = (round(distance), 0, 0, round(-2.5 * distance), round(3 * distance), round(-distance), 0)
    return [*pieces, _Piece(_RAMP_Q32, at, down, ramp_bounds)]


# Codes of every piece: hold with 1878 mm/s^2 and 46341 mm/s^3, fault stop with 4871 mm/s^2 and 185364 mm/s^3.
_STOP = ((140, 151, 140), (156, 162, 156))


def _program(adversary: Adversary, path: _Path, pieces: list[_Piece], middle: int) -> Program:
    rows = np.array(path.rows, dtype=np.int64)
    bounds = np.array([p.bounds for p in pieces])
    program = Program(
        name=adversary.name,
        period_us=1000,
        closed=False,
        duration_q32_s=middle + 2 * _RAMP_Q32,
        length_q40=path.end[2],
        offset_q40=(0, 0),
        feed_limit_um_s=0,
        acceleration_limit_um_s2=0,
        jerk_limit_mm_s3=0,
        start_q40=rows[:, 0],
        point_q40=rows[:, 1:3].T,
        a_q44=np.stack((rows[:, 3:6], rows[:, 6:9])),
        pieces=FeedPieces(
            np.array([p.duration for p in pieces]),
            np.array([p.start for p in pieces]),
            np.array([p.c for p in pieces]),
            (bounds[:, 0] * FACTOR_ONE_Q14).astype(np.uint32),
            np.repeat(rate_codes(bounds[:, 1])[:, None], LEVELS, axis=1),
            np.repeat(second_codes(bounds[:, 2])[:, None], LEVELS, axis=1),
        ),
        stops=Stops(
            np.tile(np.array(_STOP, dtype=np.uint8), (len(pieces), 1, 1)),
            np.zeros((len(pieces), 2), dtype=np.uint32),
            (0, 0),
            (0, 0),
        ),
    )
    return with_bounds(program)


def steady() -> list[tuple[int, int]]:
    """200 % from the start: two ends in every tick."""
    return [(0, 200)]


def restless(ticks: int = 3000) -> list[tuple[int, int]]:
    """The override changes nearly always, mostly near its maximum; holds and resumes in between."""
    rng = random.Random(_SEED)
    commands: list[tuple[int, int]] = [(0, 200)]
    tick = 30
    while tick < ticks:
        if rng.random() < 0.1:
            commands += [(tick, HOLD), (tick + rng.randrange(1, 30), RESUME)]
            tick += 30
        else:
            commands.append((tick, rng.choice((200, 198, 190, 150, 110, 60, 30))))
        tick += rng.choice((2, 3, 7, 20, 60))
    return [*commands, (ticks, RESUME), (ticks, 200)]


def jitter(ticks: int = 3000) -> list[tuple[int, int]]:
    """Near 200 %, another commanded override every second tick."""
    return [(k, 200 - k % 4 * 2) for k in range(0, ticks, 2)]


COMMANDS = {"steady": steady, "restless": restless, "jitter": jitter}
