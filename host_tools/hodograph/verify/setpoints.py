# SPDX-License-Identifier: MIT
"""Differences of the setpoints that each kernel makes, before they are rounded to counts: the motion that drives get.
Used by cli/verify_command. No I/O.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..fixed_point import MM_PER_Q40
from ..names import KERNELS
from ..native.program import NativeProgram

Real = NDArray[np.float64]
Int = NDArray[np.int64]

_CHUNK = 1 << 17
"""Ticks that are evaluated at once, to bound the memory."""
_ORDER = 3
"""Highest difference of setpoints: the third, for the jerk."""
PerAxis = tuple[float, ...]


@dataclass(frozen=True)
class Sampled:
    """One kernel's setpoints at the period: greatest differences over dt^2 and dt^3 of each path axis, and its own
    noise in the latter: the greatest distance from the double kernel's.
    """

    kernel: str
    acceleration_mm_s2: PerAxis
    jerk_mm_s3: PerAxis
    noise_mm_s3: float


@dataclass(frozen=True)
class BusNoise:
    """The most that rounding setpoints to counts of q mm can add: 2q / dt^2 and 4q / dt^3 (signs 1 -2 1 and 1 -3 3 -1,
    each rounding at most q / 2).
    """

    acceleration_mm_s2: float
    jerk_mm_s3: float


def bus_noise(counts_per_mm: int, period_us: int) -> BusNoise:
    """The errors for setpoints in `counts_per_mm`."""
    q, dt = 1.0 / counts_per_mm, 1e-6 * period_us
    return BusNoise(2.0 * q / dt**2, 4.0 * q / dt**3)


def sampled(program: NativeProgram) -> tuple[Sampled, ...]:
    """All kernels, over the whole program with rest before and after. Raises InputError: a program that is refused."""
    dt = 1e-6 * program.period_us
    second = {kernel: np.zeros(program.axis_count) for kernel in KERNELS}
    third = {kernel: np.zeros(program.axis_count) for kernel in KERNELS}
    noise = dict.fromkeys(KERNELS, 0.0)
    for points in _stretches(program):
        reference = np.diff(points["double"], n=_ORDER, axis=0)
        for kernel, places in points.items():
            differences = np.diff(places, n=2, axis=0)
            jerk = np.diff(differences, axis=0)
            second[kernel] = np.maximum(second[kernel], np.abs(differences).max(axis=0))
            third[kernel] = np.maximum(third[kernel], np.abs(jerk).max(axis=0))
            noise[kernel] = max(noise[kernel], float(np.abs(jerk - reference).max()))
    unit = MM_PER_Q40
    return tuple(
        Sampled(
            kernel,
            _each(second[kernel] * unit / dt**2),
            _each(third[kernel] * unit / dt**3),
            noise[kernel] * unit / dt**3,
        )
        for kernel in KERNELS
    )


def _stretches(program: NativeProgram) -> Iterator[dict[str, Int]]:
    """Setpoints (n, A) of each kernel in 2^-40 mm, in stretches that overlap, so that no difference is missing."""
    ticks = program.ticks
    for first in range(0, ticks, _CHUNK):
        begin, end = max(first - _ORDER, 0), min(first + _CHUNK, ticks)
        times = program.tick_times_q42_s(begin, end - begin)
        pad = (_ORDER if first == 0 else 0, _ORDER if end == ticks else 0)
        out = {}
        for kernel in KERNELS:
            points = program.points(kernel, times)
            places = points["position_q40"][:, : program.axis_count]
            out[kernel] = np.pad(places, (pad, (0, 0)), mode="edge")
        yield out


def _each(values: Real) -> PerAxis:
    return tuple(values.tolist())
