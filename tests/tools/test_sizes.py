# SPDX-License-Identifier: MIT
"""The committed sizes of the images are those of the commit; and the table says what changed. Run by pytest; reads the
images of `make firmware`, and starts compilers.
"""

from __future__ import annotations

from pathlib import Path

import pytest

import size

BUILD = Path(__file__).resolve().parents[2] / "build"
ROW = {"code": 100, "data": 4, "ram": 20, "stack": 300, "room": 512}


def committed() -> size.Table:
    """Of these compilers; else there is nothing to compare."""
    versions, table = size.committed()
    if versions != size.compilers():
        pytest.skip(f"the sizes are those of {versions}, and here is {size.compilers()}")
    return table


def test_the_committed_table_of_one_target_is_of_this_commit() -> None:
    """The others: the next test."""
    table = {"an386": committed()["an386"]}
    assert "\n".join(size.differences(table, size.measure_all(BUILD, "an386"))) == ""


@pytest.mark.long
def test_the_committed_table_is_of_this_commit() -> None:
    """`make size UPDATE=1` writes it."""
    assert "\n".join(size.differences(committed(), size.measure_all(BUILD))) == ""


def test_differences() -> None:
    old = {"m0": {"a": ROW, "b": ROW}}
    new = {"m0": {"a": ROW | {"stack": 308, "code": 90}}, "m3": {"a": ROW}}
    assert list(size.differences(old, new)) == [
        "m0/a: code 100 -> 90 (-10)",
        "m0/a: stack 300 -> 308 (+8)",
        "m0/b: gone",
        "m3/a: new",
    ]
    assert list(size.differences(old, old)) == []
