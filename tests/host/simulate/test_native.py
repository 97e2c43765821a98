# SPDX-License-Identifier: MIT
"""The native module: what is said where it is missing, the layout of its rows, counts. Run by pytest; starts and writes
nothing.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hodograph.errors import HodographError
from hodograph.native import POINT, ROW, counts_from_q40_mm, library


@pytest.fixture
def fresh_library() -> Iterator[None]:
    library.cache_clear()
    yield
    library.cache_clear()


@pytest.mark.usefixtures("fresh_library")
def test_missing_module_says_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "hodograph.native._native", None)
    with pytest.raises(HodographError, match="make build") as caught:
        library()
    assert "\n" not in str(caught.value)


def test_records_have_the_size_of_the_c_structs() -> None:
    ffi, _ = library()
    assert ffi.sizeof("struct offline_row") == ROW.itemsize
    assert ffi.sizeof("struct interpolator_point") == POINT.itemsize
    for name, field in ROW.fields.items():  # type: ignore[union-attr]
        place = ("outputs", name) if name in ("digital", "analogue") else (name,)
        assert ffi.offsetof("struct offline_row", *place) == field[1]


@given(st.lists(st.integers(-(2**52), 2**52), min_size=1), st.sampled_from([1, 1000, 10**6, 10**7]))
def test_counts_round_half_up_and_saturate(q40: list[int], counts_per_mm: int) -> None:
    found = counts_from_q40_mm(np.array(q40, dtype=np.int64), counts_per_mm)
    exact = [(value * counts_per_mm + 2**39) >> 40 for value in q40]
    assert found.tolist() == [min(max(e, -(2**31)), 2**31 - 1) for e in exact]
