# SPDX-License-Identifier: MIT
"""A streamed job on the emulated M4F, as tools/stream_soak.py runs it for hours: here a minute of it. Run by pytest;
starts an emulator, and writes to temporary folders.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from stream_soak import MovingHash, main, write_job


@pytest.mark.long
def test_the_board_gives_the_setpoints_of_the_chunks(tmp_path: Path) -> None:
    out = tmp_path / "soak.json"
    assert main(["--seconds", "60", "--json", str(out)]) == 0
    found = json.loads(out.read_text())
    assert found["sha256"][0] == found["sha256"][1]
    assert found["ticks"][0] > 60_000
    assert found["underruns"] == 0


def test_the_hash_leaves_out_the_standstill_at_both_ends() -> None:
    """However the setpoints are divided; a rest on the way counts, and so does each setpoint."""
    moving = np.array([[0, 0], [1, 0], [2, 1], [2, 1], [2, 1], [3, 1]])
    still = np.zeros((5, 2), dtype=int)
    whole, parted, other = MovingHash(), MovingHash(), MovingHash()
    whole.feed(np.concatenate((still, moving, np.repeat(moving[-1:], 4, axis=0))))
    for part in (still, moving[:3], moving[3:4], moving[4:], moving[-1:], moving[:0]):
        parted.feed(part)
    other.feed(np.delete(moving, 3, axis=0))
    assert (whole.ticks, whole.sha256) == (parted.ticks, parted.sha256)
    assert whole.ticks == 5
    assert whole.sha256 != other.sha256


def test_chords_are_on_the_half_circles_of_the_job(tmp_path: Path) -> None:
    arcs, chords = tmp_path / "arcs.ngc", tmp_path / "chords.ngc"
    assert write_job(arcs, 10.0) == 8
    assert write_job(chords, 10.0, 0.72) > 500.0 / 0.72
    points = np.array(
        [
            [float(word[1:]) for word in line.split()[1:]]
            for line in chords.read_text().splitlines()
            if line.startswith("G1")
        ]
    )
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    assert steps.max() <= 0.72
    assert np.linalg.norm(points[:60] - [20.0, 0.0], axis=1) == pytest.approx(20.0, abs=1e-4)
    ends = [line.split()[1] for line in arcs.read_text().splitlines() if line.startswith("G3")]
    assert points[abs(points[:, 1]) < 1e-4, 0] == pytest.approx([float(x[1:]) for x in ends])
