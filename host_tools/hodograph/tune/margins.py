# SPDX-License-Identifier: MIT
"""How far a loop is from instability."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .loop import Float, Loop


@dataclass(frozen=True)
class Margins:
    """Of the loop opened at the volts.

    The loop's gain may rise by `gain_up` or fall to `gain_down` of what it is, its phase may lag by `phase_deg` more, a
    dead time of `delay_s` more may come in. `modulus` is the least distance from -1 (1 / peak of the sensitivity).
    `crossover_hz` is the highest frequency where the gain is 1.
    """

    gain_up: float
    gain_down: float
    phase_deg: float
    delay_s: float
    modulus: float
    crossover_hz: float


def margins(loop: Loop, delay_s: float = 0.0) -> Margins:
    """The margins that are left when the loop has this dead time besides. Those of a stable loop only."""
    rad_s = loop.grid()
    response = loop.open(rad_s, delay_s)
    size, phase = np.log(np.abs(response)), np.unwrap(np.angle(response))
    phase += (
        2 * math.pi * round((-math.pi - phase[0]) / (2 * math.pi))
    )  # two integrators: from -180 degrees
    crossing = _crossings(size)
    angles = [_between(phase, *place) + math.pi for place in crossing]
    speeds = [math.exp(_between(np.log(rad_s), *place)) for place in crossing]
    turns = math.pi * np.arange(-9, 10, 2)
    gains = [_between(size, *place) for turn in turns for place in _crossings(phase - turn)]
    return Margins(
        gain_up=math.exp(min((-g for g in gains if g < 0), default=math.inf)),
        gain_down=math.exp(max((-g for g in gains if g >= 0), default=-math.inf)),
        phase_deg=math.degrees(min((abs(a) for a in angles), default=math.pi)),
        delay_s=min(
            (a % (2 * math.pi) / w for a, w in zip(angles, speeds, strict=True)), default=math.inf
        ),
        modulus=float(np.abs(1 + response).min()),
        crossover_hz=max(speeds, default=0.0) / (2 * math.pi),
    )


def _crossings(values: Float) -> list[tuple[int, float]]:
    """Where values change sign: before which gap, and at which part of it."""
    at = np.flatnonzero((values[:-1] < 0) != (values[1:] < 0))
    return [(int(i), float(values[i] / (values[i] - values[i + 1]))) for i in at]


def _between(values: Float, index: int, part: float) -> float:
    return float(values[index] + part * (values[index + 1] - values[index]))
