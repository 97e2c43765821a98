# SPDX-License-Identifier: MIT
"""Outputs on the live page: places on the path, and the times at which setpoints passed them, poll by poll. Run by
pytest; starts and writes nothing.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hodograph.monitor.derived import ProgramPath
from hodograph.monitor.messages import encode, path_message
from hodograph.monitor.output_marks import OutputMark, PassedMarks, drawn_marks, output_marks
from hodograph.native import NativeProgram
from hodograph.pipeline import Pipeline, load_pipeline
from hodograph.simulate import simulate_on

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="module")
def pipeline() -> Pipeline:
    return load_pipeline(ROOT / "examples" / "dispense.toml", allow_space=True)


def test_marks_are_on_the_path(pipeline: Pipeline) -> None:
    path = ProgramPath(pipeline.image, 1_000_000)
    marks = output_marks(pipeline.machine.outputs, path.events)
    assert [mark.place_mm for mark in marks] == sorted(
        {e[0] * 2.0**-40 for e in path.events.tolist()}
    )
    message = path_message(path, "", drawn_marks(marks, path))
    encode(message)
    shown = np.array([[mark["x"], mark["y"]] for mark in message["marks"]])
    wanted = pipeline.spline_result.spline.point(np.array([mark.place_mm for mark in marks]))
    assert np.abs(shown[:, 0] + 1j * shown[:, 1] - wanted).max() < 0.02
    assert "needle on" in message["marks"][0]["text"]
    assert "marks" not in path_message(path, "", drawn_marks(output_marks(None, path.events), path))


@pytest.mark.parametrize("look", [7, 100, 10**6])
def test_times_are_those_of_the_controller(pipeline: Pipeline, look: int) -> None:
    """Each output at the tick in which the controller switches it, however the rows come; but the start."""
    motion = simulate_on(pipeline.machine, NativeProgram(pipeline.image), "fixed")
    ticks = motion.ticks
    arc, t_s = motion.arc_length_mm[:ticks], motion.t_s[:ticks]
    passed = PassedMarks(output_marks(pipeline.machine.outputs, motion.events))
    found = []
    for first in range(0, ticks, look):
        found += passed.feed(t_s[first : first + look], arc[first : first + look])
    wanted = sorted({one.time_s for one in motion.acted_outputs if one.place_mm > 0.0})
    assert [t for t, _ in found if t > 0.02] == pytest.approx(wanted, abs=0.0011)


def test_what_is_not_passed_is_not_marked() -> None:
    passed = PassedMarks(
        (OutputMark(0.0, "a on"), OutputMark(5.0, "b on"), OutputMark(9.0, "b off"))
    )
    nan = np.nan
    assert passed.feed(np.arange(3.0), np.array([nan, 6.0, 7.0])) == [], (
        "it came to the path after b"
    )
    assert passed.feed(np.arange(3.0, 6.0), np.array([7.0, 4.0, 4.5])) == [], "backwards"
    assert passed.feed(np.arange(6.0, 9.0), np.array([nan, 0.0, 0.0])) == [], (
        "at the start, at rest"
    )
    found = passed.feed(np.arange(9.0, 13.0), np.array([0.1, 4.9, 5.0, 6.0]))
    assert found == [(9.0, "a on"), (11.0, "b on")]
    assert passed.anew().feed(np.arange(1.0), np.array([9.5])) == [], "another source"
    assert passed.feed(np.arange(13.0, 14.0), np.array([9.5])) == [(13.0, "b off")]
    assert PassedMarks().feed(np.arange(2.0), np.zeros(2)) == []
