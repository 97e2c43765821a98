# SPDX-License-Identifier: MIT
"""Random programs for the tests of the verifier, each a pure function of a seed. Used by the tests of this folder. No
I/O.
"""

from __future__ import annotations

import numpy as np

from hodograph.feed import FeedRequest, Limits, plan_feed
from hodograph.program import Program, compile_program
from hodograph.spline import from_control_polygon
from quick_stops import QUICK_STOPS

PROFILES = ("quintic", "exponential", "minimax")


def random_program(seed: int) -> Program:
    """A wavy path of 5 to 14 control points, open or closed, at 20 to 200 mm/s. Its stops are found by few trials."""
    rng = np.random.default_rng([seed, 16])
    count, closed = int(rng.integers(5, 15)), bool(rng.integers(2))
    if closed:
        angle = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
        points = (40.0 + rng.uniform(-12, 12, count)) * np.exp(1j * angle)
    else:
        turn = np.cumsum(rng.uniform(-0.8, 0.8, count))
        points = np.cumsum(rng.uniform(4, 20, count) * np.exp(1j * turn))
    spline = from_control_polygon(points, closed).spline
    request = FeedRequest(PROFILES[seed % 3], rng.uniform(20.0, 200.0), rng.uniform(0.05, 0.3))
    plan = plan_feed(spline.length_mm, request, Limits())
    return compile_program(spline, plan, QUICK_STOPS)
