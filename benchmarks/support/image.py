# SPDX-License-Identifier: MIT
"""Program images with extreme but legal segments and feeds. Used by benchmarks/kernels.py. No I/O."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass

import numpy as np

Q44 = 1 << 44
Q40 = 1 << 40
Q32 = 1 << 32


@dataclass(frozen=True)
class Segment:
    """A segment in image units: start, x, y in q40 mm; w as six q44 integers u0 v0 u1 v1 u2 v2."""

    start: int
    x: int
    y: int
    w: tuple[int, ...]

    def integral(self) -> tuple[int, int, int]:
        """15 times (x, y, s) from start to end, in q88, exact."""
        u, v = self.w[0::2], self.w[1::2]
        total = [0, 0, 0]
        for i, j, weight in ((0, 0, 3), (0, 1, 3), (0, 2, 1), (1, 1, 2), (1, 2, 3), (2, 2, 3)):
            uu, vv = u[i] * u[j], v[i] * v[j]
            total[0] += weight * (uu - vv)
            total[1] += weight * (u[i] * v[j] + v[i] * u[j])
            total[2] += weight * (uu + vv)
        return total[0], total[1], total[2]

    def next_start(self) -> tuple[int, int, int]:
        """(x, y, start) of the segment that follows, rounded to q40."""
        dx, dy, ds = (round_half_up(v, 15 << 48) for v in self.integral())
        return self.x + dx, self.y + dy, self.start + ds

    def sigma_q88(self) -> list[int]:
        """Bernstein coefficients of sigma times 3 in q88, exact."""
        u, v = self.w[0::2], self.w[1::2]

        def dot(i: int, j: int) -> int:
            return u[i] * u[j] + v[i] * v[j]

        return [
            3 * dot(0, 0),
            3 * dot(0, 1),
            dot(0, 2) + 2 * dot(1, 1),
            3 * dot(1, 2),
            3 * dot(2, 2),
        ]

    def legal(self) -> bool:
        """Rules of protocol.md 1.2 about one segment."""
        sigma = self.sigma_q88()
        return (
            min(sigma) > 0 and max(sigma) <= 2 * min(sigma) and self.integral()[2] <= 15 * 32 << 88
        )


@dataclass(frozen=True)
class Piece:
    """A feed piece in image units."""

    duration: int
    start: int
    c: tuple[int, ...]


def round_half_up(a: int, b: int) -> int:
    """floor(a / b + 1/2) of integers."""
    return (2 * a + b) // (2 * b)


def encode(
    segments: list[Segment], pieces: list[Piece], *, period_us: int = 1000, closed: bool = False
) -> bytes:
    """The image, protocol.md section 1."""
    body = b"".join(struct.pack("<9q", s.start, s.x, s.y, *s.w) for s in segments)
    for p in pieces:
        body += struct.pack("<Q8q4I", p.duration, p.start, *p.c, 1 << 24, 1 << 16, 1 << 8, 0)
    body += bytes(16 * len(pieces))  # no stops
    size = 128 + len(body)
    length = segments[-1].next_start()[2]
    duration = sum(p.duration for p in pieces)
    tail = struct.pack(
        "<3I2HQ3q4I32s16s",
        period_us,
        len(segments),
        len(pieces),
        int(closed),
        2,
        duration,
        length,
        0,
        0,
        0,
        0,
        0,
        0,
        b"test",
        b"",
    )
    tail += body
    return struct.pack("<4s2HII", b"HDGP", 2, 128, size, zlib.crc32(tail)) + tail


def exponent(duration: int) -> int:
    """e of protocol.md 1.3: 2^e seconds is the smallest power of two not below the duration."""
    return (duration - 1).bit_length() - 32


def random_segment(
    rng: np.random.Generator, start: int, x: int, y: int, length_mm: float, hard: bool = True
) -> Segment:
    """A legal segment of about this length; `hard` draws w close to the limit of the speed ratio."""
    while True:
        w = rng.normal(size=3) + 1j * rng.normal(size=3)
        if not hard:
            w = np.exp(0.3j * rng.normal()) * (
                1 + 0.1 * (rng.normal(size=3) + 1j * rng.normal(size=3))
            )
        b = np.array(
            [
                abs(w[0]) ** 2,
                (w[0] * w[1].conjugate()).real,
                ((w[0] * w[2].conjugate()).real + 2 * abs(w[1]) ** 2) / 3,
                (w[1] * w[2].conjugate()).real,
                abs(w[2]) ** 2,
            ]
        )
        ratio = b.max() / b.min() if b.min() > 0 else np.inf
        if ratio > 2 or (hard and ratio < 1.8):
            continue
        w *= np.sqrt(length_mm / b.mean())
        q = tuple(int(round(c * Q44)) for z in w for c in (z.real, z.imag))
        segment = Segment(start, x, y, q)
        if segment.legal():
            return segment
