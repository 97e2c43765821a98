# SPDX-License-Identifier: MIT
"""Profile `optimal` on the examples, from the path file to a program that the controller takes. Run by pytest; starts
and writes nothing.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hodograph.pipeline import load_pipeline
from hodograph.program import check

EXAMPLES = Path(__file__).parents[3] / "examples"


@pytest.mark.parametrize(("name", "share"), [("alpha", 0.7), ("heart", 0.5)])
def test_examples_are_faster_than_the_paper_and_keep_every_limit(name: str, share: float) -> None:
    paper, fast = (load_pipeline(EXAMPLES / f"{name}{kind}.toml") for kind in ("", "_optimal"))
    plan = fast.plan
    assert plan.curve.ramp is None
    assert plan.duration_s < share * paper.plan.duration_s
    assert max(peak.value / peak.limit.given for peak in fast.peaks.values()) < 1.001
    assert check(fast.program) is None


def test_the_plan_and_its_pieces_agree() -> None:
    pipeline = load_pipeline(EXAMPLES / "alpha_optimal.toml")
    plan, pieces = pipeline.plan, pipeline.program.pieces
    start = np.concatenate(([0], np.cumsum(pieces.duration_q32_s))) * 2.0**-32
    assert np.abs(plan.arc_length(start[:-1]) - pieces.start_q40 * 2.0**-40).max() < 1e-11
    assert plan.arc_length(start[-1]) == pytest.approx(plan.length_mm, abs=1e-10)
    t = np.linspace(0.0, plan.duration_s, 20001)
    feed = plan.feed(t)
    assert feed.min() >= 0.0
    steps = np.diff(plan.acceleration(t)) / t[1]
    assert np.abs(steps).max() < 1.01 * plan.peak_jerk_mm_s3
