# SPDX-License-Identifier: MIT
"""Lengths in steps of 2^-40 mm: rounding of arrays, single lengths and fractions. Run by pytest; starts and writes
nothing.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from hodograph.fixed_point import MM_PER_Q40, Q40_PER_MM, nearest_q40, to_q40


def test_halves_are_rounded_to_even() -> None:
    halves = np.array([[0.5, 1.5], [-0.5, -2.5]]) * MM_PER_Q40
    assert to_q40(halves).tolist() == [[0, 2], [0, -2]]
    assert [nearest_q40(float(one)) for one in halves.ravel()] == [0, 2, 0, -2]


def test_arrays_and_single_lengths_agree() -> None:
    lengths = np.random.default_rng(1).uniform(-4096.0, 4096.0, 1000)
    assert to_q40(lengths).tolist() == [nearest_q40(float(one)) for one in lengths]


def test_a_fraction_is_exact_where_a_float_is_not() -> None:
    length = Fraction(2**70 + 1, 2**40)
    assert nearest_q40(length) == 2**70 + 1
    assert nearest_q40(float(length)) == 2**70
    assert Q40_PER_MM * MM_PER_Q40 == 1.0
