# SPDX-License-Identifier: MIT
"""The headroom of a changing override in C against the same formulas in numpy, on random samples. Run by pytest;
no I/O.
"""

import numpy as np
import pytest

from hodograph.feed.kinematics import raised
from hodograph.native.override_headroom import OverrideSamples, Volts

AXES, CELLS, SAMPLES, PIECES = 3, 40, 13, 17


def _samples(seed: int, *, volts: bool, by_sample: bool) -> OverrideSamples:
    rng = np.random.default_rng(seed)
    shape = (AXES, CELLS, SAMPLES)
    signed_v, signed_a = (rng.normal(scale=scale, size=shape) for scale in (100.0, 2000.0))
    v, a = raised(signed_v) + 1e-12, raised(signed_a) + 1e-12
    j = raised(rng.normal(scale=5e4, size=shape)) + 1e-12
    limits = (
        rng.uniform(size=shape if by_sample else (AXES, 1, 1)) * scale for scale in (9e3, 3e5)
    )
    own = Volts(signed_v, signed_a, np.array([900.0, 700.0, 80.0]), np.array([0.01, 0.02, 0.05]))
    piece = np.sort(rng.integers(0, PIECES, CELLS))
    return OverrideSamples(PIECES, piece, v, a, j, *limits, own if volts else None)


def _least(samples: OverrideSamples, values: np.ndarray) -> np.ndarray:
    out = np.full(PIECES, np.inf)
    np.minimum.at(out, samples.piece, values.min(axis=(0, 2)))
    return out


@pytest.mark.parametrize("volts", [False, True])
@pytest.mark.parametrize("by_sample", [False, True])
def test_headroom_is_that_of_the_formulas(*, volts: bool, by_sample: bool) -> None:
    """Rates and accelerations of the override are bit for bit those of docs/theory/feed.md section 7."""
    for seed in range(20):
        one = _samples(seed, volts=volts, by_sample=by_sample)
        override = np.random.default_rng(seed + 100).uniform(0.5, 2.0, PIECES)
        f = override[one.piece, None]
        rest = (one.most_acceleration - f**2 * one.acceleration) / one.velocity
        if one.volts is not None:
            reach, time_s = (x[:, None, None] for x in (one.volts.reach, one.volts.time_constant))
            pull = time_s * one.volts.acceleration
            most = raised(f * one.volts.velocity + f**2 * pull)
            apart = (one.volts.velocity * pull < 0.0) & (
                np.abs(one.volts.velocity) < 2.0 * f * np.abs(pull)
            )
            between = one.velocity**2 / (4.0 * np.maximum(np.abs(pull), 1e-12))
            most = np.maximum(most, np.where(apart, between, 0.0))
            rest = np.minimum(rest, (reach - most) / (time_s * one.velocity))
        jerk = (one.most_jerk - f**3 * one.jerk) / (3.0 * f * one.acceleration)
        rates = one.rates(override)
        assert np.array_equal(rates[0], _least(one, rest))
        assert np.array_equal(rates[1], _least(one, jerk))
        rate = np.clip(rates[1], -1e3, 1e3)
        still = (one.most_jerk - f**3 * one.jerk) / one.velocity
        falls = 3.0 * f * one.acceleration / one.velocity
        expected = _least(one, still - rate[one.piece, None] * falls)
        assert np.array_equal(one.seconds(override, rate), expected)
