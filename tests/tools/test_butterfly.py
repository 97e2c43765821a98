# SPDX-License-Identifier: MIT
"""The butterfly of `make butterfly`: the data are whole, and our reader of drawings gets the same curve. Run by pytest;
writes to temporary folders.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import BSpline

from hodograph.toolpath.files import ReadOptions, read_toolpath
from hodograph.toolpath.moves import SplineMove

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "benchmarks"))

from published import butterfly  # noqa: E402


def test_the_data_are_whole() -> None:
    points, knots = butterfly.control_points_mm(), butterfly.knots()
    assert len(points) == 51
    assert len(knots) == 55
    assert (np.diff(knots) >= 0.0).all()
    assert (butterfly.weights() == butterfly.weights()[::-1]).all()
    mirrored = points[::-1] * [-1.0, 1.0] + [2.0 * 54.4925, 0.0]
    assert np.abs(mirrored - points).max() < 2.1  # printed unevenly at the tips of the wings


def test_the_reader_gets_the_printed_curve(tmp_path: Path) -> None:
    file = tmp_path / "butterfly.dxf"
    file.write_text(butterfly.drawing(), encoding="ascii")
    commands = list(read_toolpath(file, ReadOptions(feed_mm_s=10.0)))
    (move,) = [one for one in commands if isinstance(one, SplineMove)]
    read = np.array(move.points)[:, :2] + butterfly.control_points_mm()[0]
    assert read[:-2] == pytest.approx(butterfly.control_points_mm()[:-2], abs=1e-9)
    # The printed ends are 1 um apart; the reader of drawings joins them.
    assert read == pytest.approx(butterfly.control_points_mm(), abs=1.001e-3)
    assert np.array(move.weights) == pytest.approx(butterfly.weights())
    assert np.array(move.knots) == pytest.approx(butterfly.knots())
    weights = butterfly.weights()[:, None]
    curve = BSpline(np.array(move.knots), np.hstack((read * weights, weights)), move.degree)
    u = np.linspace(0.0, 1.0, 200_001)
    place = curve(u)[:, :2] / curve(u)[:, 2:]
    length = np.linalg.norm(np.diff(place, axis=0), axis=1).sum()
    assert length == pytest.approx(382.8596, abs=1e-3)


@pytest.mark.parametrize("words", [["--only", "Farouki"], ["--only"]])
def test_only_rows_that_are_there(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        butterfly.main(words)
    assert end.value.code == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert "argument --only: " in err.splitlines()[-1]


@pytest.mark.long
def test_a_printed_time_is_ours_or_longer(tmp_path: Path) -> None:
    """Of the row whose curve may have the printed size; docs/validation/butterfly.md has this figure."""
    file = tmp_path / "butterfly.dxf"
    file.write_text(butterfly.drawing(), encoding="ascii")
    (liu,) = [one for one in butterfly.PRINTED if one.name == "Liu"]
    row = butterfly.measured(liu, file)
    assert row["ours_s"] == pytest.approx(4.97, abs=0.05)
    assert row["acceleration_usage"] <= 1.0
    assert row["jerk_usage"] <= 1.0
