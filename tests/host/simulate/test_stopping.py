# SPDX-License-Identifier: MIT
"""Stops without a bus: at rest within the bound, inside the limits, on the path; random commands as well. Run by
pytest; writes to temporary folders.
"""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hodograph.cli.main import main
from hodograph.errors import HodographError
from hodograph.feed import FeedPlan
from hodograph.native import NativeProgram
from hodograph.native.stop_search import StopSearch
from hodograph.native.stop_trial import StopTrials, run_trials
from hodograph.pipeline import Pipeline, load_pipeline
from hodograph.program import encode
from hodograph.program.stop_planning import fault_limits, hold_limits
from hodograph.simulate import simulate, simulate_stop

ROOT = Path(__file__).parents[3]
ALPHA = ROOT / "examples/alpha_optimal.toml"
HEART = ROOT / "examples/heart_optimal.toml"
BETWEEN = 0.01
"""Share of a limit by which a motion may pass it between the instants that the search checks (0.5 % seen)."""


def trials(pipeline: Pipeline, count: int, seed: int) -> StopTrials:
    """Random commands on a program, beside the limits that its stops were planned with."""
    return trials_of(
        NativeProgram(pipeline.image), pipeline, pipeline.compilation.plan, count, seed
    )


def trials_of(
    program: NativeProgram, pipeline: Pipeline, plan: FeedPlan, count: int, seed: int
) -> StopTrials:
    """Random commands on a program of a plan."""
    search, terms = StopSearch(program), pipeline.stop_terms
    hold, fault = (
        limits.raised(search.used(limits))
        for limits in (hold_limits(plan, terms), fault_limits(plan, terms))
    )
    return run_trials(program, hold, fault, count, seed=seed)


@pytest.mark.parametrize("file", [ALPHA, HEART], ids=["alpha", "heart"])
@pytest.mark.parametrize("kind", ["hold", "stop", "fault"])
def test_a_stop_rests_within_its_bound_and_limits(file, kind) -> None:
    pipeline = load_pipeline(file)
    program = NativeProgram(pipeline.image)
    axis, path = (2000.0, 50000.0), (2000.0, 50000.0)
    for at_s in np.linspace(0.0, pipeline.program.duration_s, 14)[:-1].tolist():
        found = simulate_stop(
            program, pipeline.machine.models(pipeline.machine.path_axes), kind, at_s
        )
        assert found.rest_after_s <= found.bound_s
        assert found.distance_mm >= 0.0
        if kind == "fault":
            assert found.peak["acceleration_mm_s2"] <= 5000.0
            assert found.peak["jerk_mm_s3"] <= 200000.0
            assert found.rest_after_s < 0.13
            continue
        for name, limits in (("", path), ("x_", axis), ("y_", axis)):
            assert found.peak[f"{name}acceleration_mm_s2"] <= limits[0] * 1.0005
            assert found.peak[f"{name}jerk_mm_s3"] <= limits[1] * 1.001


def test_until_the_stop_the_run_is_the_undisturbed_one() -> None:
    pipeline = load_pipeline(ALPHA)
    drives = pipeline.machine.models(pipeline.machine.path_axes)
    whole = simulate(pipeline.image, drives)
    found = simulate_stop(NativeProgram(pipeline.image), drives, "fault", 0.3)
    assert np.array_equal(found.motion.rows["set_counts"][:300], whole.rows["set_counts"][:300])
    assert not np.array_equal(found.motion.rows["set_counts"][:310], whole.rows["set_counts"][:310])
    rest = found.motion.rows["set_counts"][found.motion.ticks - 1 :]
    assert np.all(rest == rest[0])


@pytest.mark.parametrize("option", ["--hold-at", "--stop-at", "--fault-at"])
@pytest.mark.parametrize("value", ["9", "0.7291", "-0.001", "nan", "inf", "soon", "0.1,0.2"])
def test_a_time_that_cannot_be_is_refused_in_a_line(capsys, tmp_path, option, value) -> None:
    """Before anything is run or written, also where others could be."""
    trace = tmp_path / "run.csv"
    words = ["simulate", str(ALPHA), "--hold-at", "0.1", f"{option}={value}", "--trace", str(trace)]
    assert main(words) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert option in err
    assert value in err
    assert not trace.exists()


def test_the_message_names_the_times_that_can_be(capsys) -> None:
    assert main(["simulate", str(ALPHA), "--fault-at", "0.1", "9"]) == 2
    assert "--fault-at 9: must be from 0 to 0.729 s" in capsys.readouterr().err


def test_at_the_first_and_the_last_setpoint(capsys) -> None:
    """The first is the start itself: nothing moves. At the last the program ends."""
    words = [word for kind in ("hold", "stop", "fault") for word in (f"--{kind}-at", "0", "0.729")]
    assert main(["simulate", str(ALPHA), *words, "--json"]) == 0
    stops = json.loads(capsys.readouterr().out)["stops"]
    assert [stop["at_s"] for stop in stops] == [0.0, 0.729] * 3
    for stop in stops:
        assert 0.0 < stop["rest_after_s"] <= 0.003
        assert stop["distance_mm"] < 0.001
        assert stop["bound_s"] >= stop["rest_after_s"]


def test_json_and_traces(capsys, tmp_path) -> None:
    trace = tmp_path / "run.csv"
    command = ["simulate", str(ALPHA), "--hold-at", "0.1", "0.2", "--stop-at", "0.3"]
    assert main([*command, "--fault-at", "0.4", "--json", "--trace", str(trace)]) == 0
    stops = json.loads(capsys.readouterr().out)["stops"]
    assert [(stop["kind"], stop["at_s"]) for stop in stops] == [
        ("hold", 0.1),
        ("hold", 0.2),
        ("stop", 0.3),
        ("fault", 0.4),
    ]
    keys = {"kind", "at_s", "rest_after_s", "distance_mm", "bound_s", "peak"}
    assert all(set(stop) == keys for stop in stops)
    assert sorted(file.name for file in tmp_path.iterdir()) == [
        "run.csv",
        "run.fault-0.4.csv",
        "run.hold-0.1.csv",
        "run.hold-0.2.csv",
        "run.stop-0.3.csv",
    ]
    rows = (tmp_path / "run.fault-0.4.csv").read_text(encoding="ascii").splitlines()
    assert len(rows) == 1 + 400 + round(stops[3]["rest_after_s"] * 1000)


def test_options_add_up_and_instants_that_are_close_have_files_of_their_own(
    capsys, tmp_path
) -> None:
    trace = tmp_path / "run.csv"
    words = ["--hold-at", "0.1", "--hold-at", "0.10000001", "0.2", "--json", "--trace", str(trace)]
    assert main(["simulate", str(ALPHA), *words]) == 0
    stops = json.loads(capsys.readouterr().out)["stops"]
    assert [stop["at_s"] for stop in stops] == [0.1, 0.10000001, 0.2]
    assert sorted(file.name for file in tmp_path.iterdir()) == [
        "run.csv",
        "run.hold-0.1.csv",
        "run.hold-0.10000001.csv",
        "run.hold-0.2.csv",
    ]


def test_a_second_command_does_not_inherit_the_instants_of_the_first(capsys) -> None:
    assert main(["simulate", str(ALPHA), "--hold-at", "0.1", "--json"]) == 0
    assert main(["simulate", str(ALPHA), "--json"]) == 0
    first, second = capsys.readouterr().out.splitlines()
    assert len(json.loads(first)["stops"]) == 1
    assert json.loads(second)["stops"] == []


def random_file(folder: Path, seed: int) -> Path:
    """A path file with a random path, profile and limits."""
    rng = np.random.default_rng([seed, 11])
    count, closed = int(rng.integers(5, 10)), bool(rng.integers(2))
    if closed:
        angle = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
        points = rng.uniform(8.0, 40.0, count) * np.exp(1j * angle)
    else:
        points = np.cumsum(
            rng.uniform(4.0, 30.0, count) * np.exp(1j * np.cumsum(rng.uniform(-1.3, 1.3, count)))
        )
    listed = [[round(float(p.real), 6), round(float(p.imag), 6)] for p in points]
    profile = ("optimal", "quintic", "exponential", "minimax")[int(rng.integers(4))]
    feed = f'profile = "{profile}"\n'
    if profile != "optimal":
        feed += f"nominal_mm_s = {rng.uniform(20, 200):.3f}\nramp_time_s = {rng.uniform(0.05, 0.3):.3f}\n"
    limits = f"acceleration_mm_s2 = {rng.uniform(800, 3000):.1f}\njerk_mm_s3 = {rng.uniform(2e4, 1e5):.1f}\n"
    axis = f"acceleration_mm_s2 = {rng.uniform(800, 3000):.1f}\njerk_mm_s3 = {rng.uniform(2e4, 1e5):.1f}\n"
    if rng.integers(2):
        limits += f"reserve = {rng.choice([0.002, 0.02, 0.1])}\n"
    machine = ROOT / "examples/machines/paper_alpha.toml"
    file = folder / f"random{seed}.toml"
    file.write_text(
        f"[path]\nclosed = {str(closed).lower()}\ncontrol_points = {listed}\n[feed]\n{feed}"
        f'[limits]\n{limits}[limits.axis]\n{axis}[machine]\nfile = "{machine}"\n',
        encoding="utf-8",
    )
    return file


def check_random(folder: Path, seed: int, count: int) -> int:
    """Random commands on a random program; how many trials there were."""
    try:
        pipeline = load_pipeline(random_file(folder, seed))
        _ = pipeline.image
    except HodographError:
        return 0
    found = trials(pipeline, count, seed)
    assert found.within(BETWEEN), f"random path {seed}: {found}"
    assert sum(found.measured) > count // 3
    return count


@pytest.mark.parametrize("file", [ALPHA, HEART, ROOT / "examples/star.toml"], ids=lambda f: f.stem)
def test_random_commands_on_the_examples(file) -> None:
    found = trials(load_pipeline(file), 4000, 7)
    assert found.kept, found


def test_random_commands_on_random_programs(tmp_path) -> None:
    assert sum(check_random(tmp_path, seed, 1000) for seed in range(4)) >= 2500


@pytest.mark.long
def test_100_000_random_commands(tmp_path) -> None:
    """None over its bound, none late, none over its limits by more than what lies between the places checked."""
    assert (
        sum(check_random(tmp_path, seed, 1500) for seed in (*range(4, 8), *range(100, 190)))
        >= 100_000
    )


def random_space_file(folder: Path, seed: int) -> Path:
    """A path file with a random path in space, profile and limits, for a machine with narrow limits of its axes."""
    rng = np.random.default_rng([seed, 13])
    count = int(rng.integers(5, 10))
    turn, step = np.cumsum(rng.uniform(-1.2, 1.2, count)), rng.uniform(4.0, 25.0, count)
    ways = (step * np.cos(turn), step * np.sin(turn), rng.uniform(-8.0, 8.0, count))
    listed = np.stack([np.cumsum(way) for way in ways], axis=1).round(6).tolist()
    profile = ("quintic", "exponential", "minimax")[int(rng.integers(1, 4)) - 1]
    feed = (
        f"nominal_mm_s = {rng.uniform(20, 150):.3f}\nramp_time_s = {rng.uniform(0.05, 0.3):.3f}\n"
    )
    limits = f"acceleration_mm_s2 = {rng.uniform(500, 1800):.1f}\njerk_mm_s3 = {rng.uniform(1e4, 4.5e4):.1f}\n"
    file = folder / f"space{seed}.toml"
    file.write_text(
        f'[path]\nclosed = false\ncontrol_points = {listed}\n[feed]\nprofile = "{profile}"\n{feed}'
        f'[limits]\n{limits}[machine]\nfile = "{ROOT / "examples/machines/mill.toml"}"\n',
        encoding="utf-8",
    )
    return file


def space_trials(folder: Path, seed: int, count: int) -> StopTrials:
    """Random commands on a random program in space."""
    return trials(load_pipeline(random_space_file(folder, seed), allow_space=True), count, seed)


def test_a_fault_stop_out_of_a_hold_keeps_the_limits_at_every_override(tmp_path) -> None:
    """Of a hold that began while the override rose. Stops that few trials find are judged by the same comparison."""
    pipeline = load_pipeline(random_space_file(tmp_path, 70006), allow_space=True)
    terms = replace(pipeline.stop_terms, quick=True)
    made = pipeline._with_stops(pipeline.plan, terms)
    program = NativeProgram(encode(made.program))
    found = trials_of(program, pipeline, made.plan, 1000, 70006)
    assert found.kept, found
    assert found.of_fault["jerk"] > 0.9  # there is hardly any room


@pytest.mark.long
def test_a_fault_stop_out_of_a_hold_with_all_trials(tmp_path) -> None:
    found = space_trials(tmp_path, 70006, 1000)
    assert found.kept, found


@pytest.mark.long
def test_random_commands_on_random_programs_in_space(tmp_path) -> None:
    for seed in range(40):
        found = space_trials(tmp_path, seed, 1000)
        assert found.within(BETWEEN), f"random path in space {seed}: {found}"
