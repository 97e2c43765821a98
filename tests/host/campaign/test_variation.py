# SPDX-License-Identifier: MIT
"""Draws: reproducible, distributed as requested, and independent. Run by pytest; starts and writes nothing."""

from __future__ import annotations

import numpy as np
import pytest

from hodograph.campaign.variation import Variation, unit

SAMPLES = 4000
NAMES = ("x", "y", "z")


def draws(variation: Variation, axis: str = "x", seed: int = 0) -> np.ndarray:
    return np.array([variation.number(axis, seed, k, 0) for k in range(SAMPLES)])


def test_draws_are_what_they_were() -> None:
    """These numbers are part of what a campaign file means: they may not change."""
    assert unit("0 0 gain_rad_s_v x") == 0.13188015987690627
    assert unit("") == 0.8931675160897389


def test_uniform_and_normal() -> None:
    uniform = draws(Variation("k_vf", "uniform", (2.0, 5.0), "each"))
    assert 2.0 < uniform.min() < 2.01
    assert 4.99 < uniform.max() < 5.0
    counts = np.histogram(uniform, 10, (2.0, 5.0))[0]
    assert np.abs(counts - SAMPLES / 10).max() < 5 * np.sqrt(SAMPLES / 10)
    normal = draws(Variation("k_vf", "factor_normal", (1.0, 0.1), "each"))
    assert normal.mean() == pytest.approx(1.0, abs=0.1 * 5 / np.sqrt(SAMPLES))
    assert normal.std() == pytest.approx(0.1, rel=5 / np.sqrt(2 * SAMPLES))


def test_axes_seeds_and_figures_are_independent() -> None:
    each = Variation("gain_rad_s_v", "uniform", (0.0, 1.0), "each")
    both = Variation("gain_rad_s_v", "uniform", (0.0, 1.0), "all")
    other = Variation("k_vf", "uniform", (0.0, 1.0), "each")
    x = draws(each)
    for unlike in (draws(each, axis="y"), draws(each, seed=1), draws(other), draws(both)):
        assert abs(np.corrcoef(x, unlike)[0, 1]) < 5 / np.sqrt(SAMPLES)
    assert np.array_equal(draws(both), draws(both, axis="y"))


def test_axes_that_vary() -> None:
    assert Variation("k_vf", "values", (1.0,), "x").axes(NAMES) == ("x",)
    assert Variation("k_vf", "values", (1.0,), "y").axes(NAMES) == ("y",)
    assert Variation("k_vf", "values", (1.0,), "each").axes(NAMES) == NAMES
    assert Variation("k_vf", "values", (1.0,), "all").axes(NAMES) == NAMES
