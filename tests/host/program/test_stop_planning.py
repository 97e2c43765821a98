# SPDX-License-Identifier: MIT
"""Stops are planned where a program is hard to stop: narrow bends, and paths of micrometres. Run by pytest; writes to
temporary folders.
"""

from dataclasses import replace
from math import inf
from pathlib import Path

import numpy as np
import pytest

import shared_programs
from hodograph.config import load_machine, load_path_file
from hodograph.native import NativeProgram
from hodograph.native.stop_search import StopSearch
from hodograph.native.stop_trial import StopTrials, run_trials
from hodograph.pipeline import Pipeline, load_pipeline, pipeline_of
from hodograph.program import Program, compiler, encode, stop_planning
from hodograph.program.stop_planning import fault_limits, hold_limits
from hodograph.program.stops import DECELERATION, FAULT
from hodograph.simulate import simulate, simulate_stop

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
MACHINE = EXAMPLES / "machines/paper_alpha.toml"
CONSTANT = 'profile = "minimax"\nnominal_mm_s = 90\nramp_time_s = 0.3\n'
ZIG_ZAG = """[[0.0, 0.0], [1.2, 2.7], [1.3, 0.0], [1.9, 2.7], [10.5, 0.0], [5.8, 2.7], [2.3, 0.0], [9.3, 2.7],
[5.2, 0.0], [17.7, 2.7], [23.0, 0.0], [28.3, 2.7], [10.3, 0.0], [20.7, 2.7], [13.9, 0.0], [25.7, 2.7]]"""


def pipeline(
    folder: Path, points: str, feed: str, limits: str = "", stop_time_ms: int = 250
) -> Pipeline:
    file = folder / "path.toml"
    file.write_text(
        f"[path]\nclosed = false\n{points}\n[feed]\n{feed}[limits]\nacceleration_mm_s2 = 2000\n"
        f'jerk_mm_s3 = 40000\n{limits}[machine]\nfile = "{MACHINE}"\n',
        encoding="utf-8",
    )
    return Pipeline(load_path_file(file), replace(load_machine(MACHINE), stop_time_ms=stop_time_ms))


def trials(made: Pipeline) -> StopTrials:
    program = NativeProgram(made.image)
    search = StopSearch(program)
    plan, terms = made.compilation.plan, made.stop_terms
    hold, fault = (
        limits.raised(search.used(limits))
        for limits in (hold_limits(plan, terms), fault_limits(plan, terms))
    )
    return run_trials(program, hold, fault, 2000, seed=3)


@pytest.mark.parametrize("apart_mm", [1e-6, 1e-3, 0.1])
def test_a_bend_without_brakes_does_not_keep_its_piece_from_braking(
    tmp_path: Path, apart_mm: float
) -> None:
    points = f"knots = 'uniform'\nthrough = [[0, 0], [10, 0], [{10 + apart_mm}, 0], [20, 5]]"
    axis = "[limits.axis]\njerk_mm_s3 = 20000\n"
    made = pipeline(tmp_path, points, CONSTANT, axis)
    stops, count = made.program.stops, made.program.piece_count
    assert stops.worst(0).time_s < 0.25
    assert stops.worst(1).time_s < 0.25
    assert count < 3 * len(made.plan.pieces)
    assert (stops.codes[:, 1, DECELERATION] != 0).sum() > count // 2
    found = trials(made)
    assert found.within(0.01), found


def test_bends_in_long_pieces_are_looked_at(tmp_path: Path) -> None:
    """Constant feed in pieces of seconds; the bends take milliseconds."""
    found = trials(pipeline(tmp_path, f"control_points = {ZIG_ZAG}", CONSTANT))
    assert found.within(0.01), found


def test_stops_on_a_path_of_micrometres_are_never_late(tmp_path: Path) -> None:
    points = "control_points = [[0, 0], [0.0008, 0.0013], [0.0007, 0.0028], [0.0004, 0.0043]]"
    made = pipeline(tmp_path, points, CONSTANT.replace("0.3", "0.2"), stop_time_ms=0)
    found = trials(made)
    assert found.kept, found
    assert sum(found.measured) > 500


def test_a_feed_zone_that_is_used_fully_does_not_keep_a_hold_from_braking(tmp_path: Path) -> None:
    """Ten seconds at the feed of the zone: a hold begins at once, not after its end."""
    points = "control_points = [[0, 0], [40, 5], [80, 40], [60, 90], [10, 80], [-20, 40]]"
    zone = "[[limits.cap]]\nfrom_mm = 20\nto_mm = 160\nfeed_mm_s = 12\n"
    made = pipeline(tmp_path, points, 'profile = "optimal"\n', zone)
    assert made.plan.duration_s > 10.0
    assert made.program.stops.worst(0).time_s < 0.3
    found = trials(made)
    assert found.within(0.01), found


def mean_fault_bound_s(program: Program) -> float:
    """Over the time of the program."""
    return float(
        np.average(program.stops.bound_us[:, FAULT] * 1e-6, weights=program.pieces.duration_q32_s)
    )


def test_long_pieces_are_halved_where_stops_become_shorter(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nine pieces of 0.3 s at constant feed; the setpoints are the same."""
    made = load_pipeline(EXAMPLES / "heart.toml")
    fine = made.program
    with monkeypatch.context() as patch:
        patch.setattr(stop_planning, "LONGEST_PART_S", inf)
        whole = load_pipeline(EXAMPLES / "heart.toml").program
    assert whole.piece_count < fine.piece_count < 2 * whole.piece_count
    assert mean_fault_bound_s(fine) < 0.97 * mean_fault_bound_s(whole)
    assert fine.stops.worst_us[FAULT] <= whole.stops.worst_us[FAULT]
    long = fine.pieces.duration_q32_s * 2.0**-32 > stop_planning.LONGEST_PART_S
    assert long.sum() < (whole.pieces.duration_q32_s * 2.0**-32 > 0.2).sum()
    drives = made.machine.models(made.machine.path_axes)
    hashes = {
        simulate(NativeProgram(encode(program)), drives).setpoints_sha256
        for program in (fine, whole)
    }
    assert len(hashes) == 1
    found = trials(made)
    assert found.kept, found


def mean_hold_s(program: Program, made: Pipeline) -> float:
    """Time to rest of holds at 16 instants, on the mean."""
    image, drives = NativeProgram(encode(program)), made.machine.models(made.machine.path_axes)
    at_s = np.linspace(0.0, program.duration_s, 18)[1:-1].tolist()
    return float(np.mean([simulate_stop(image, drives, "hold", at).rest_after_s for at in at_s]))


def test_where_a_hold_would_wait_for_long_short_parts_have_brakes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A program of profile optimal: in a bend a brake may begin at some instants only."""
    made = load_pipeline(EXAMPLES / "heart_optimal.toml")
    fine = made.program
    with monkeypatch.context() as patch:
        patch.setattr(stop_planning, "LONGEST_WAIT_S", inf)
        whole = load_pipeline(EXAMPLES / "heart_optimal.toml").program
    assert whole.piece_count < fine.piece_count < 1.2 * whole.piece_count
    assert mean_hold_s(fine, made) < 0.92 * mean_hold_s(whole, made)
    assert fine.stops.worst_us[FAULT] <= whole.stops.worst_us[FAULT]
    found = trials(made)
    assert found.kept, found


def test_long_pieces_that_gain_nothing_stay_whole(tmp_path: Path) -> None:
    """Almost straight: each part has the same numbers."""
    points = "control_points = [[0, 0], [30, 0.1], [60, 0], [90, 0.1]]"
    made = pipeline(tmp_path, points, CONSTANT.replace("90", "40"))
    assert made.program.piece_count == len(made.plan.pieces)
    assert (made.program.pieces.duration_q32_s * 2.0**-32).max() > 0.2


BEND_IN_SPACE = f"""
[path]
closed = false
through = [[20, 0, 0], [14, 14, 1], [0, 20, 2]]
[feed]
profile = "optimal"
[machine]
file = "{EXAMPLES / "machines/mill.toml"}"
"""


@pytest.mark.parametrize("text", [None, BEND_IN_SPACE], ids=["alpha", "space"])
def test_the_same_stops_in_every_call(
    text: str | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Other tests plan the stops of a motion once, and rely on that (shared_programs.py): also in space, and where
    only the name of the program differs.
    """
    file = EXAMPLES / "alpha.toml" if text is None else tmp_path / "bend.toml"
    if text is not None:
        file.write_text(text, encoding="utf-8")
    own = load_pipeline(file, allow_space=True)
    monkeypatch.setattr(compiler, "plan_stops", shared_programs._stops)
    first, second = (pipeline_of(own.file) for _ in range(2))
    assert first.image == own.image
    assert second.image == own.image
