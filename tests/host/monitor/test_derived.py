# SPDX-License-Identifier: MIT
"""The figures of the plots agree with those of `simulate`. Run by pytest; starts and writes nothing."""

from __future__ import annotations

import numpy as np
import pytest

from hodograph.errors import InputError
from hodograph.monitor.decoder import Decoder
from hodograph.monitor.derived import Derivation, ProgramPath, Rows, derivative_weights
from hodograph.monitor.messages import path_message, rows_message
from hodograph.pipeline import load_pipeline
from hodograph.simulate import Motion, simulate
from traffic import EXAMPLES, alpha

STILL = 300
COUNTS_PER_MM = 1_000_000


def rows_of(chunk: int, path: ProgramPath | None) -> Rows:
    _, frames = alpha()
    decoder, derivation = Decoder((2, 3)), Derivation((COUNTS_PER_MM,) * 2, 2, 1000)
    parts = [
        derivation.feed(decoder.feed(part), path)
        for part in np.split(frames, range(chunk, frames.size, chunk))
    ]
    names = Rows.__dataclass_fields__
    return Rows(**{n: np.concatenate([getattr(p, n) for p in parts]) for n in names})


def motion() -> Motion:
    pipeline = load_pipeline(EXAMPLES / "alpha.toml", None)
    drives = [axis.drive for axis in pipeline.machine.axes if axis.drive is not None]
    return simulate(pipeline.image, drives)


@pytest.mark.parametrize("chunk", [200, 333, 100_000])
def test_contour_and_following_errors_are_those_of_simulate(chunk: int) -> None:
    expected = motion()
    rows = rows_of(chunk, ProgramPath(alpha()[0], COUNTS_PER_MM))
    first = STILL - round(rows.t_s[0] * 1000)
    count = rows.count - first
    assert count > 1200
    contour = rows.contour_um[first:]
    assert not np.isnan(contour).any()
    assert contour == pytest.approx(expected.contour_error_um[:count], abs=1e-4)
    assert rows.following_um[first:] == pytest.approx(expected.following_error_um[:count], abs=1e-6)
    assert np.nanmax(rows.contour_um) == pytest.approx(expected.contour_error_um.max(), abs=1e-4)


def test_feed_acceleration_and_jerk_are_the_programs() -> None:
    expected = motion()
    rows = rows_of(500, None)
    first = STILL - round(rows.t_s[0] * 1000)
    feed = rows.feed_mm_s[first : first + 1000]
    assert feed == pytest.approx(expected.feed_mm_s[:1000], abs=0.3)
    middle = slice(first + 300, first + 700)  # constant feed
    assert rows.feed_mm_s[middle] == pytest.approx(100, abs=1e-3)
    assert np.abs(rows.acceleration_mm_s2[middle]).max() < 1
    assert np.abs(rows.jerk_mm_s3[middle]).max() < 100
    assert 1000 < rows.acceleration_mm_s2.max() < 2500
    assert np.isnan(rows.contour_um).all()


def test_off_the_path_there_is_no_contour_error() -> None:
    path = ProgramPath(alpha()[0], COUNTS_PER_MM)
    away = np.array([[5e6, -2e6], [5.1e6, -2e6]])
    assert np.isnan(path.contour_errors_um(away, away)[0]).all()
    start = np.array([[0.0, 0.0], [0.0, 0.0]])
    assert path.contour_errors_um(start, start)[0] == pytest.approx([0, 0], abs=1e-3)
    assert path.arc_length_mm == pytest.approx(0, abs=1e-6)


def test_the_drawing_is_the_curve_from_start_to_end() -> None:
    path = ProgramPath(alpha()[0], COUNTS_PER_MM)
    points = path.drawing()
    assert points[0] == pytest.approx([0, 0], abs=1e-9)
    assert points[-1] == pytest.approx([0, 18], abs=1e-6)
    assert path.name == "alpha"
    steps = np.hypot(*np.diff(points, axis=0).T)
    assert steps.sum() == pytest.approx(path.length_mm, rel=1e-4)


def test_what_is_no_program_is_refused() -> None:
    with pytest.raises(InputError):
        ProgramPath(b"nothing", COUNTS_PER_MM)


@pytest.mark.parametrize("derivative", [1, 2, 3])
def test_the_fit_is_exact_for_polynomials(derivative: int) -> None:
    weights = derivative_weights(10, 4, derivative)
    steps = np.arange(-10.0, 11.0)
    values = np.polynomial.Polynomial([1, 2, 3, 4, 5])(steps)
    expected = np.polynomial.Polynomial([1, 2, 3, 4, 5]).deriv(derivative)(0)
    assert weights @ values == pytest.approx(expected)


def test_missing_values_do_not_spread_for_ever() -> None:
    _, frames = alpha()
    frames = np.delete(frames, slice(2500, 2525))  # five SYNCs
    decoder, derivation = Decoder((2, 3)), Derivation((COUNTS_PER_MM,) * 2, 2, 1000)
    rows = derivation.feed(decoder.feed(frames), None)
    assert np.count_nonzero(np.isnan(rows.feed_mm_s)) < 40
    assert np.all(np.diff(rows.t_s) > 0)


def test_five_axes_are_drawn_in_space_and_over_arc_length() -> None:
    pipeline = load_pipeline(EXAMPLES / "five_axes.toml", allow_space=True)
    machine, program = pipeline.machine, pipeline.accepted
    path = ProgramPath(program.image, machine.counts_per_mm)
    assert path.axes == 3
    assert path.drawing().shape[1] == 3
    arcs, extra = path.extra_drawing()
    assert extra[-1] == pytest.approx([12.0, 360.0])
    assert np.all(np.diff(arcs) > 0)
    points, counts = program.setpoints("fixed", machine.path_counts)
    errors, places = path.contour_errors_um(counts.astype(float), counts.astype(float))
    assert errors.max() < 0.01
    assert places == pytest.approx(points["arc_length_q40_mm"] / 2**40, abs=1e-3)


def test_messages_of_five_axes_have_their_curves() -> None:
    pipeline = load_pipeline(EXAMPLES / "five_axes.toml", allow_space=True)
    path = ProgramPath(pipeline.image, 1_000_000)
    message = path_message(path)
    assert len(message["x"]) == len(message["z"])
    assert [len(column) for column in message["extra"]] == [len(message["arc"])] * 2
    count = 40
    still = np.zeros((count, 5))
    line = np.linspace(0.0, 1.0, count)
    rows = Rows(line, still, still + 1.0, line, line, line, line, still, 10.0 * line)
    found = rows_message(rows, 0.002, None, drawn=3, path_axes=5)
    assert len(found["cmd"]) == 3
    assert [len(side) for side in found["extra"]] == [2, 2]
    assert found["arc"][-1] <= 10.0
    assert "extra" not in rows_message(rows, 0.002, None, drawn=3, path_axes=3)
