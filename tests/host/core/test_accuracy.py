# SPDX-License-Identifier: MIT
"""The kernels against 50-digit arithmetic, within the bounds of docs/theory/numerics.md sections 9 to 12.

A small run of benchmarks/kernels.py: random segments at the limit of the speed ratio and golden programs. Run by
pytest; starts a C compiler, loads what it makes, and writes to temporary folders.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "benchmarks"))

import kernels  # noqa: E402

BOUND_MM = {"fixed": 2.0**-37, "float": 5e-6, "double": 3e-11}


@pytest.fixture(scope="module")
def core(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The core, compiled for this test alone."""
    return kernels.Core("gcc", tmp_path_factory.mktemp("core"))


@pytest.fixture(scope="module")
def accuracy(core: Any) -> dict[str, dict[str, float]]:
    """The greatest errors by case and kernel."""
    found: dict[str, dict[str, float]] = kernels.accuracy(core, 20)
    return found


def test_within_the_bounds(accuracy: dict[str, dict[str, float]]) -> None:
    for case, errors in accuracy.items():
        for kernel, error in errors.items():
            assert error <= BOUND_MM[kernel], (case, kernel)


def test_every_error_is_seen(accuracy: dict[str, dict[str, float]]) -> None:
    """Rounding to 2^-40 mm alone must show: an error of 0 would mean that nothing is compared."""
    errors = accuracy["alpha_minimax"]
    assert min(errors.values()) > 2.0**-44
    assert errors["float"] > 10 * errors["fixed"]


def test_third_difference_noise(core: Any) -> None:
    found = kernels.noise(core, "alpha_exponential")
    for kernel, most in (("fixed", 0.01), ("float", 1000.0), ("double", 0.01)):
        assert found[kernel]["third_difference_peak_mm_s3"] <= most
    assert found["fixed"]["feed_ripple_peak_mm_s"] <= 1e-8
