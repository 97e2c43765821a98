# SPDX-License-Identifier: MIT
"""Decimation loses no peak and bounds what is sent. Run by pytest; starts and writes nothing."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hodograph.monitor.messages import extremes, group_starts


@given(st.integers(0, 5000), st.integers(1, 50), st.integers(1, 40))
def test_groups_cover_every_row_once_and_are_few(count: int, size: int, most: int) -> None:
    starts = group_starts(count, size, most)
    assert starts.size <= most
    assert (starts.size == 0) == (count == 0)
    if count:
        assert starts[0] == 0
        lengths = np.diff([*starts, count])
        assert lengths.min() >= 1
        assert lengths.sum() == count
        assert lengths[:-1].tolist() == [lengths[0]] * (lengths.size - 1)


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=500), st.integers(1, 20))
def test_the_greatest_and_the_least_value_survive(values: list[float], size: int) -> None:
    low, high = extremes(np.array(values), group_starts(len(values), size, 16))
    assert low.min() == min(values)
    assert high.max() == max(values)


def test_what_did_not_come_is_left_out() -> None:
    values = np.array([1.0, np.nan, 3.0, np.nan, np.nan, np.nan])
    low, high = extremes(values, np.array([0, 3]))
    assert (low[0], high[0]) == (1.0, 3.0)
    assert np.isnan(low[1])


@pytest.mark.parametrize("shape", [(0,), (0, 2)])
def test_nothing_gives_nothing(shape: tuple[int, ...]) -> None:
    low, high = extremes(np.empty(shape), group_starts(0, 10, 16))
    assert low.shape == high.shape == shape
