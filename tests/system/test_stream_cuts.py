# SPDX-License-Identifier: MIT
"""Streamed jobs that are cut at random instants, and continued: a few seeds of tools/stream_cuts.py. Run by pytest;
starts simulated machines and `hodograph` on local buses, and writes to temporary folders.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))

from cut_oracle import OutputJudge, away_um  # noqa: E402
from marks import long  # noqa: E402
from stream_cuts import KINDS, draw, run_case  # noqa: E402


@pytest.mark.parametrize(
    ("seed", "kind"), [(306, "kill"), long(131, "kill"), *(long(7, kind) for kind in KINDS)]
)
def test_a_job_that_is_cut_comes_to_its_end_on_its_path(seed: int, kind: str) -> None:
    before = dict(os.environ)
    found = run_case(draw(seed, (kind,)))
    assert not found.troubles, "\n".join([*found.troubles, *found.printed])
    assert os.environ == before  # other tests of this process start controllers, too


@pytest.mark.long
def test_many_kinds_in_one_job() -> None:
    for seed in range(1, 11):
        found = run_case(draw(seed))
        assert not found.troubles, "\n".join([str(found.case), *found.troubles, *found.printed])


def test_what_is_off_the_path_or_left_out_is_found() -> None:
    """Of a square with 400 points a side, in counts."""
    side = np.linspace(0.0, 1e6, 400)
    nothing, whole = np.zeros(400), np.full(400, 1e6)
    path = np.concatenate(
        [np.stack(pair, axis=1) for pair in ((side, nothing), (whole, side), (side[::-1], whole))]
    )
    slower = path[np.repeat(np.arange(len(path)), 3)]
    assert away_um(slower, path) < 1e-9
    aside = slower.copy()
    aside[600, 1] += 5000.0
    assert 4.9 < away_um(aside, path) < 5.1
    cut = np.delete(slower, range(1120, 1280), axis=0)  # over the corner
    assert away_um(path, cut) > 1.0


def test_outputs_that_are_not_those_of_the_job_are_found() -> None:
    """Off while the axes brake for a stop, and until they rest; else as in the job."""
    on, off, other = (1, 0, 0, 0), (0, 0, 0, 0), (2, 0, 0, 0)

    def accepted(outputs: list[tuple[int, ...]]) -> list[bool]:
        judge = OutputJudge(longest_ticks=3)
        return [judge.accepts(tick, own, {on}) for tick, own in enumerate(outputs)]

    assert accepted([on, on, off, off]) == [True, True, True, True]
    assert accepted([off]) == [False]
    assert accepted([on, other]) == [True, False]
    assert accepted([on, off, on]) == [True, True, False]
    assert accepted([on, off, off, off, off, off])[-1] is False
    judge = OutputJudge(longest_ticks=3)
    assert judge.accepts(0, on, {on})
    assert judge.accepts(1, off, {on})
    assert judge.rests_before(20)
    assert not judge.accepts(20, off, {on})
