# SPDX-License-Identifier: MIT
"""Writes the programs of tests/data/bits: the alpha, the heart, the star and 200 random ones.

    .venv/bin/python tests/data/make_bits.py

They are kept, not made by each test: the tools plan in floating point, whose last bit may be another on the next
machine, and the hashes of golden.txt (`make golden`) are compared bit by bit. Run by hand, only when the
format changes; replaces the files in the folder.
"""

from __future__ import annotations

import lzma
from pathlib import Path

import numpy as np

from hodograph.errors import HodographError
from hodograph.feed import ControllerLimits, FeedRequest, Limits, plan_feed
from hodograph.feed.request import PERIODS_US, PROFILES
from hodograph.pipeline import load_pipeline
from hodograph.program import Program, ProgramOptions, check, compile_program, encode
from hodograph.program.image import ProgramLimits
from hodograph.spline import PHSpline, from_control_polygon, line

HERE = Path(__file__).resolve().parent
EXAMPLES = HERE.parent.parent / "examples"
COUNT = 200
MOST_BYTES, LEAST_TICKS, MOST_TICKS = 1400, 20, 500
REACH = 1000 << 40
LIMITS = {
    us: ProgramLimits(us, 2_000_000, 50_000_000, 4_000_000, (-REACH,) * 2, (REACH,) * 2)
    for us in PERIODS_US
}
CONTROLLER = ControllerLimits(2000.0, 50000.0, 4e6, 0.02)


def polygon(rng: np.random.Generator, size_mm: float) -> PHSpline:
    """A spline of one of three kinds: gentle turns, points anywhere, a line."""
    kind, count = rng.integers(5), int(rng.integers(4, 8))
    if kind == 0:
        return line(0, size_mm * np.exp(2j * np.pi * rng.uniform()))
    closed = bool(rng.integers(2))
    if kind == 1:
        points = rng.uniform(0, 1, count) + 1j * rng.uniform(0, 1, count)
    else:
        heading = np.cumsum(rng.uniform(-1.2, 1.2, count))
        points = np.cumsum(rng.uniform(0.3, 1, count) * np.exp(1j * heading)) / count
    return from_control_polygon(size_mm * points, closed).spline


def random_program(seed: int, attempt: int) -> Program:
    """Of any size, feed, profile and period; raises HodographError when no such program is possible."""
    rng = np.random.default_rng([4, seed, attempt])
    spline = polygon(rng, float(np.exp(rng.uniform(np.log(0.02), np.log(120)))))
    profile = PROFILES[int(rng.integers(3))]
    period_us = PERIODS_US[int(rng.choice(4, p=(0.7, 0.1, 0.1, 0.1)))]
    request = FeedRequest(
        profile,
        float(spline.length_mm * np.exp(rng.uniform(np.log(1), np.log(30)))),
        float(np.exp(rng.uniform(np.log(0.01), np.log(0.2)))),
        float(rng.uniform(2, 12)),
        int(rng.integers(3, 10)),
    )
    plan = plan_feed(spline.length_mm, request, Limits(), CONTROLLER, period_us=period_us)
    offset = complex(*rng.uniform(-800, 800, 2))
    return compile_program(
        spline, plan, ProgramOptions(f"random {seed}", offset, LIMITS[period_us], period_us)
    )


def fits(program: Program) -> bool:
    """Small enough for the store of the smallest target, and neither over at once nor long."""
    ticks = program.duration_q32_s * 1_000_000 / 2**32 / program.period_us
    return len(encode(program)) <= MOST_BYTES and LEAST_TICKS <= ticks <= MOST_TICKS


def one(seed: int) -> Program:
    """The first of a seed's programs that is possible and fits."""
    for attempt in range(1000):
        try:
            program = random_program(seed, attempt)
        except HodographError:
            continue
        if fits(program) and check(program, LIMITS[program.period_us]) is None:
            return program
    raise SystemExit(f"seed {seed}: no program that fits")


def main() -> None:
    """Writes the file."""
    images = [load_pipeline(EXAMPLES / f"{name}.toml").image for name in ("alpha", "heart", "star")]
    images += [encode(one(seed)) for seed in range(COUNT)]
    file = HERE / "bits" / "programs.xz"
    file.parent.mkdir(exist_ok=True)
    file.write_bytes(lzma.compress(b"".join(images), preset=9 | lzma.PRESET_EXTREME))
    sizes = [len(image) for image in images]
    print(f"{len(images)} programs, {sum(sizes)} bytes, packed {file.stat().st_size}")


if __name__ == "__main__":
    main()
