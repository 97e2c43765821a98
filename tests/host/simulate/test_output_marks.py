# SPDX-License-Identifier: MIT
"""Marks of outputs in figures: their places on the curve, and the times at which they switched in a run. Run by pytest;
writes to temporary folders.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib import pyplot

from hodograph.pipeline import Pipeline, load_pipeline
from hodograph.report.output_marks import mark_outputs, mark_switching_times
from hodograph.simulate import simulate_on

ROOT = Path(__file__).resolve().parents[3]
MILL = (
    (ROOT / "examples" / "machines" / "mill.toml")
    .read_text()
    .replace("../drives", str(ROOT / "examples" / "drives"))
)
OUTPUTS = """
[outputs]
node = 16
[outputs.channel]
valve = { digital = 0 }
lamp = { digital = 3 }
power = { analogue = 1, scale = 327.67, unit = "%" }
"""
SWITCHED = """
[[output]]
name = "valve"
at_point = 1
on = true
[[output]]
name = "lamp"
at_point = 1
on = false
[[output]]
name = "power"
at_fraction = 1.0
per_mm_s = 0.5
"""


@pytest.fixture(scope="module")
def pipeline(tmp_path_factory: pytest.TempPathFactory) -> Pipeline:
    """Of a path in space."""
    folder = tmp_path_factory.mktemp("marks")
    (folder / "machine.toml").write_text(MILL + OUTPUTS)
    file = folder / "path.toml"
    file.write_text(
        "[path]\nclosed = false\nthrough = [[0, 0, 0], [20, 10, 5], [40, 0, 10]]\n"
        "[feed]\nprofile = 'optimal'\nnominal_mm_s = 50\n"
        f"{SWITCHED}[machine]\nfile = 'machine.toml'\n"
    )
    return load_pipeline(file, allow_space=True)


def test_places_are_marked_in_space(pipeline: Pipeline) -> None:
    figure = pyplot.figure()
    axes = figure.add_subplot(projection="3d")
    mark_outputs(axes, pipeline)
    (marks,) = axes.lines
    x, y, z = marks.get_data_3d()
    assert np.allclose(np.unique(np.stack((x, y, z), axis=1), axis=0), [[20, 10, 5], [40, 0, 10]])
    texts = [one.get_text().strip() for one in axes.texts]
    assert texts == ["valve on\nlamp off", "power 0.5 by mm/s"]
    pyplot.close(figure)


def test_places_in_the_plane_are_those_of_the_curve() -> None:
    flat = load_pipeline(ROOT / "examples" / "dispense.toml", allow_space=True)
    figure, axes = pyplot.subplots()
    mark_outputs(axes, flat)
    (marks,) = axes.lines
    places = [one.at_mm for one in flat.file.outputs if one.at_mm is not None]
    assert places
    x, y = marks.get_data()
    shown = np.asarray(x) + 1j * np.asarray(y)
    for place in flat.spline_result.spline.point(np.array(places)):
        assert np.abs(shown - place).min() < 1e-6
    pyplot.close(figure)


def test_times_are_those_of_the_run(pipeline: Pipeline) -> None:
    motion = simulate_on(pipeline.machine, pipeline.image, "fixed")
    acted = motion.acted_outputs
    assert [one.name for one in acted] == ["valve", "lamp", "power"]
    figure, axes = pyplot.subplots()
    mark_switching_times(axes, motion)
    assert [line.get_xdata()[0] for line in axes.lines] == sorted({one.time_s for one in acted})
    assert [one.get_text() for one in axes.texts] == ["valve on\nlamp off", "power 0.5 by mm/s"]
    row = motion.arc_length_mm[acted[0].tick]
    assert row >= acted[0].place_mm > motion.arc_length_mm[acted[0].tick - 1]
    pyplot.close(figure)
