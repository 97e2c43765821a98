# SPDX-License-Identifier: MIT
"""The public Python API: the same programs as the commands, arrays of the promised shapes, quick to import. Run by
pytest; starts processes, and writes to temporary folders.
"""

from __future__ import annotations

import doctest
import inspect
import json
import subprocess
import sys
import tomllib
from collections.abc import Callable
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hodograph as hg
from hodograph.pipeline import load_pipeline

ROOT = Path(__file__).resolve().parents[3]
POINTS = [[0, 0], [20, 0], [35, 10], [35, 30]]
LIMITS = hg.Limits(feed_mm_s=150, acceleration_mm_s2=2000, jerk_mm_s3=50_000)


@pytest.fixture(scope="module")
def machine() -> hg.Machine:
    return hg.Machine.example()


@pytest.mark.parametrize("module", ["machine", "path", "job", "program", "bus"])
def test_examples_of_docstrings(module: str) -> None:
    result = doctest.testmod(import_module(f"hodograph.api.{module}"))
    assert result.attempted > 0
    assert result.failed == 0


def test_every_public_name_is_there_with_a_docstring() -> None:
    for name in hg.__all__:
        found = getattr(hg, name)
        assert name == "__version__" or inspect.getdoc(found), name
    assert set(dir(hg)) == set(hg.__all__)
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = hg.nothing  # type: ignore[attr-defined]


def test_import_loads_nothing_heavy() -> None:
    code = (
        "import sys, hodograph; print(*(name for name in sys.modules "
        "if name in ('numpy', 'typing') or name.startswith('hodograph.')))"
    )
    done = subprocess.run(
        [sys.executable, "-S", "-c", code],
        env={"PYTHONPATH": str(ROOT / "host_tools")},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split() == ["hodograph.errors"]


def test_planning_does_not_load_the_bus() -> None:
    code = "import sys, hodograph; hodograph.Path; print('canopen' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"


# -- the same as the commands --------------------------------------------------------------------


@pytest.mark.parametrize("name", ["alpha", "heart_optimal", "star"])
def test_programs_of_files_are_those_of_compile(name: str) -> None:
    file = hg.example_file(name)
    assert hg.load_plan(file).program().image == load_pipeline(file).image


def test_a_plan_on_a_machine_is_that_of_the_program(tmp_path: Path, mill: hg.Machine) -> None:
    """A path that is planned again, since its fault stops would be late."""
    text = (ROOT / "examples" / "machines" / "mill.toml").read_text()
    text = text.replace('"../drives', f'"{ROOT}/examples/drives').replace(
        "stop_time_ms = 500", "stop_time_ms = 120"
    )
    file = tmp_path / "mill.toml"
    file.write_text(text)
    quick = hg.Machine.load(file)
    points = [[0, 0, 0], [20, 0, 0], [20, 8, 0]]
    polygon = hg.Path.through(points)
    limits = hg.Limits(feed_mm_s=100)
    usual, again = (polygon.plan(limits, machine=on) for on in (mill, quick))
    assert again.duration_s > 1.05 * usual.duration_s
    assert "stop_time_ms = 120" in again.notes[-1]
    assert not any("stop_time_ms" in line for line in usual.notes)
    end = again.sample(again.duration_s)
    assert end.position_mm == pytest.approx([20, 8, 0], abs=1e-6)
    assert again.usage().keys() == usual.usage().keys()
    assert again.program().duration_s == pytest.approx(again.duration_s, abs=1e-6)


def test_a_path_from_points_is_that_of_a_file(tmp_path: Path, machine: hg.Machine) -> None:
    """Every key of the file has its parameter."""
    text = f"""
        [path]
        closed = false
        through = {POINTS}
        start_tangent = [1, 0.2]
        ends = "natural"
        knots = "centripetal"
        [feed]
        profile = "optimal"
        nominal_mm_s = 140
        [limits]
        feed_mm_s = 150
        acceleration_mm_s2 = 2000
        jerk_mm_s3 = 50000
        centripetal_mm_s2 = 800
        volts = 6
        reserve = 0.05
        [limits.axis]
        velocity_mm_s = 120
        acceleration_mm_s2 = [1500, 1800]
        jerk_mm_s3 = [45000, 40000]
        [[limits.cap]]
        from_mm = 10
        to_mm = 20
        feed_mm_s = 60
    """
    file = tmp_path / "same.toml"
    file.write_text(text, encoding="utf-8")
    path = hg.Path.through(
        POINTS, start_tangent=[1, 0.2], ends="natural", knots="centripetal", name="same"
    )
    limits = hg.Limits(
        feed_mm_s=150,
        acceleration_mm_s2=2000,
        jerk_mm_s3=50_000,
        centripetal_mm_s2=800,
        volts=6,
        reserve=0.05,
        axis_velocity_mm_s=120,
        axis_acceleration_mm_s2=(1500, 1800),
        axis_jerk_mm_s3=(45_000, 40_000),
        zones=(hg.FeedZone(10, 20, 60),),
    )
    plan = path.plan(limits, machine=machine, nominal_mm_s=140)
    assert plan.program().image == hg.load_plan(file, machine).program().image
    bare = path.plan(LIMITS, machine=machine).program().image
    assert plan.program().image != bare


@pytest.mark.parametrize("profile", ["quintic", "exponential", "minimax"])
def test_profiles_with_ramps(profile: str, tmp_path: Path, machine: hg.Machine) -> None:
    file = tmp_path / "ramps.toml"
    file.write_text(
        f'[path]\nclosed = true\ncontrol_points = {POINTS}\n[feed]\nprofile = "{profile}"\n'
        "nominal_mm_s = 60\nramp_time_s = 0.15\nn_c = 4\ndegree = 6\n"
    )
    path = hg.Path.polygon(POINTS, closed=True, name="ramps")
    plan = path.plan(
        machine=machine, profile=profile, nominal_mm_s=60, ramp_time_s=0.15, n_c=4, degree=6
    )  # type: ignore[arg-type]
    assert plan.program().image == hg.load_plan(file, machine).program().image


def test_a_path_of_a_file_forgets_its_machine(machine: hg.Machine) -> None:
    plan = hg.load_path(hg.example_file("alpha")).plan(LIMITS)
    assert plan.machine is None
    with pytest.raises(hg.InputError, match="needs a machine"):
        plan.program()


def test_images_survive_a_file(tmp_path: Path, machine: hg.Machine) -> None:
    program = hg.Path.through(POINTS).plan(LIMITS, machine=machine).program()
    program.save(tmp_path / "a.hdgp")
    again = hg.load_program(tmp_path / "a.hdgp", machine)
    assert again.image == program.image
    assert (again.ticks, again.period_us) == (program.ticks, 1000)
    assert again.duration_s <= (again.ticks - 1) * 1e-3 < again.duration_s + 1e-3


# -- arrays ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("points", "axes"), [(POINTS, 2), ([[0, 0, 0], [10, 5, 3], [20, 0, 9], [30, 8, 1]], 3)]
)
def test_shapes_along_a_path(points: list[list[float]], axes: int) -> None:
    path = hg.Path.through(points)
    assert path.axes == axes
    assert path.node_points_mm.shape == (4, axes)
    assert np.allclose(path.point_mm(path.node_arc_lengths_mm), points, atol=1e-9)
    s = np.linspace(0, path.length_mm, 12).reshape(3, 4)
    assert path.point_mm(s).shape == path.tangent(s).shape == (3, 4, axes)
    assert path.curvature_per_mm(s).shape == (3, 4)
    assert path.point_mm(1.0).shape == (axes,)
    assert np.allclose(np.linalg.norm(path.tangent(s), axis=-1), 1.0)


def test_motion_is_the_derivative_of_the_one_before(machine: hg.Machine) -> None:
    plan = hg.Path.through(POINTS).plan(LIMITS, machine=machine)
    h = 1e-6
    t = np.linspace(0.01, plan.duration_s - 0.01, 97)
    motion, left, right = plan.sample(t), plan.sample(t - h), plan.sample(t + h)
    chains = (
        ("arc_length_mm", "feed_mm_s", "feed_acceleration_mm_s2", "feed_jerk_mm_s3"),
        ("position_mm", "velocity_mm_s", "acceleration_mm_s2", "jerk_mm_s3"),
    )
    for chain in chains:
        for lower, upper in pairwise(chain):
            slope = (getattr(right, lower) - getattr(left, lower)) / (2 * h)
            exact = getattr(motion, upper)
            apart = np.abs(slope - exact) > 1e-3 * np.abs(exact).max()
            assert np.count_nonzero(apart) <= 4, upper  # where a piece ends, jerk has a step
    assert motion.position_mm.shape == (97, 2)
    assert plan.sample(0.0).position_mm.shape == (2,)
    assert np.allclose(plan.sample([0.0, plan.duration_s]).feed_mm_s, 0.0, atol=1e-9)


def test_limits_are_kept(machine: hg.Machine) -> None:
    limits = hg.Limits(axis_velocity_mm_s=(80, 60), axis_acceleration_mm_s2=1000)
    plan = hg.Path.through(POINTS).plan(limits, machine=machine)
    motion = plan.sample(np.linspace(0, plan.duration_s, 3001))
    assert (np.abs(motion.velocity_mm_s).max(axis=0) <= (80.08, 60.06)).all()
    assert (np.abs(motion.acceleration_mm_s2).max(axis=0) <= 1001).all()
    usage = plan.usage()
    assert usage["axis.velocity_mm_s.y"].limit == 60
    assert max(one.ratio for one in usage.values()) > 0.99


def test_a_run_has_one_row_a_setpoint(machine: hg.Machine) -> None:
    program = hg.Path.through(POINTS).plan(LIMITS, machine=machine).program()
    run, n = program.simulate(), program.ticks
    for name in ("t_s", "arc_length_mm", "feed_mm_s", "contour_error_um"):
        assert getattr(run, name).shape == (n,)
    for name in ("commanded_mm", "setpoints_counts", "actual_mm", "following_error_um"):
        assert getattr(run, name).shape == (n, 2)
    assert (run.setpoints_counts == program.setpoints_counts()).all()
    assert np.allclose(run.commanded_mm[-1], POINTS[-1], atol=1e-6)
    assert run.contour_error_um.max() <= run.greatest_contour_error_um
    assert run.bus is run.deadline_misses is None


# -- errors ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("call", "error", "text"),
    [
        (lambda: hg.Path.through([]), hg.InputError, "shape"),
        (lambda: hg.Path.through("text"), hg.InputError, "numbers"),
        (lambda: hg.Path.through([[0, 0], [float("nan"), 1]]), hg.InputError, "not finite"),
        (lambda: hg.Path.through(POINTS, start_tangent=[0, 0]), hg.InputError, "direction"),
        (lambda: hg.Path.through(POINTS, start_tangent=[0, 0, 1]), hg.InputError, "2 numbers"),
        (lambda: hg.Path.through(POINTS).point_mm(1e4), hg.InputError, "outside the path"),
        (lambda: hg.Path.through(POINTS).plan(), hg.InputError, "no limit"),
        (
            lambda: hg.Path.through(POINTS).plan(LIMITS, profile="none"),  # type: ignore[arg-type]
            hg.InputError,
            "not one of",
        ),
        (
            lambda: hg.Path.through(POINTS).plan(LIMITS, profile="quintic"),
            hg.InputError,
            "needs nominal_mm_s",
        ),
        (lambda: hg.Path.through(POINTS).plan(hg.Limits(volts=4)), hg.InputError, "machine"),
        (
            lambda: hg.Path.through(POINTS).plan(hg.Limits(axis_velocity_mm_s=(1, 2, 3))),
            hg.InputError,
            "2, one for each path axis",
        ),
        (lambda: hg.Path.through(POINTS).plan(LIMITS).sample(-1.0), hg.InputError, "from 0 to"),
        (
            lambda: hg.Path.through(POINTS).plan(LIMITS).sample(float("nan")),
            hg.InputError,
            "from 0 to",
        ),
        (lambda: hg.example_file("nothing"), hg.InputError, "use one of: alpha"),
        (lambda: hg.Machine.example("nothing"), hg.InputError, "use one of: .*paper_alpha"),
        (lambda: hg.load_program("nothing", hg.Machine.example()), hg.InputError, "no such file"),
        (lambda: hg.Program(b"HDGP", hg.Machine.example()), hg.InputError, "program image"),
    ],
)
def test_errors_say_what_and_where(
    call: Callable[[], object], error: type[Exception], text: str
) -> None:
    with pytest.raises(error, match=text) as caught:
        call()
    assert "\n" not in str(caught.value)


def test_a_program_of_another_machine_is_refused(machine: hg.Machine, tmp_path: Path) -> None:
    examples = hg.example_file("alpha").resolve().parent
    text = (examples / "machines/paper_alpha.toml").read_text(encoding="utf-8")
    small = tmp_path / "small.toml"
    small.write_text(text.replace("200, 200]", "200, 34]").replace("..", str(examples)))
    image = hg.Path.through(POINTS).plan(LIMITS, machine=machine).program().image
    with pytest.raises(hg.InputError, match=r"travel .* for this machine"):
        hg.Program(image, hg.Machine.load(small))


# -- machines of mappings ----------------------------------------------------------------------------


def contents(name: str) -> dict[str, Any]:
    file = hg.example_file("alpha").parent / "machines" / f"{name}.toml"
    return tomllib.loads(file.read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", ["paper_alpha", "mill", "real_drives"])
def test_a_machine_of_a_mapping_is_that_of_the_file(name: str) -> None:
    folder = hg.example_file("alpha").parent / "machines"
    made = hg.Machine.of(contents(name), name=f"{name}.toml", folder=folder)
    assert made._file == hg.Machine.example(name)._file


def test_a_machine_of_a_mapping_may_hold_numpy_and_its_drives() -> None:
    folder = hg.example_file("alpha").parent / "machines"
    given = contents("paper_alpha")
    for axis in given["axis"]:
        file = folder / axis["drive"]
        axis["drive"] = tomllib.loads(file.read_text(encoding="utf-8"))
        axis["travel_mm"] = np.array(axis["travel_mm"])
        axis["node"] = np.int64(axis["node"])
    made, loaded = hg.Machine.of(given), hg.Machine.example("paper_alpha")
    assert made._file.axes == loaded._file.axes
    plan = hg.Path.through(POINTS).plan(LIMITS, machine=made)
    there = hg.Path.through(POINTS).plan(LIMITS, machine=loaded)
    assert plan.program().simulate().encoders_sha256 == there.program().simulate().encoders_sha256


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda given: given.update(buss={}), r'unknown key; did you mean "?bus"?'),
        (lambda given: given["axis"][1].update(node=None), "None is neither text, number"),
        (lambda given: given.update({3: {}}), "key 3 must be a text"),
        (lambda given: given["axis"][0].update(drive={"plant": {}}), r"drive of axis x: .*missing"),
        (lambda given: given["axis"][0].update(drive="nowhere.toml"), "nowhere.toml"),
        (lambda given: given["bus"].update(period_us=True), "period_us"),
        (lambda given: given.pop("axis"), r"one section \[\[axis\]\] or more"),
    ],
)
def test_a_wrong_mapping_is_refused_by_name(
    change: Callable[[dict[Any, Any]], object], text: str
) -> None:
    given: dict[Any, Any] = contents("paper_alpha")
    folder = hg.example_file("alpha").parent / "machines"
    change(given)
    with pytest.raises(hg.InputError, match=text) as caught:
        hg.Machine.of(given, name="mine", folder=folder)
    assert "mine" in str(caught.value)


def test_what_is_no_mapping_is_no_machine() -> None:
    with pytest.raises(hg.InputError, match="must be a mapping"):
        hg.Machine.of(["axis"])  # type: ignore[arg-type]


# -- toolpaths ---------------------------------------------------------------------------------------

PART = "G21 G64 P0.01\nG1 X20 F6000\nX35 Y10\nG4 P0.25\nX35 Y30\nM30\n"


@pytest.fixture(scope="module")
def mill() -> hg.Machine:
    return hg.Machine.example("mill")


def job_of(text: str, folder: Path, mill: hg.Machine, **options: Any) -> hg.Job:
    file = folder / "part.ngc"
    file.write_text(text, encoding="utf-8")
    return hg.load_job(file, mill, **options)


def test_a_job_is_that_of_the_command(tmp_path: Path, mill: hg.Machine) -> None:
    job = job_of(PART, tmp_path, mill)
    command = [*(sys.executable, "-m", "hodograph", "simulate", str(tmp_path / "part.ngc"))]
    machine = str(hg.example_file("alpha").parent / "machines/mill.toml")
    done = subprocess.run(
        [*command, "--machine", machine, "--json"], capture_output=True, text=True, check=True
    )
    said = json.loads(done.stdout)
    run = job.simulate()
    assert [one.setpoints_sha256 for one in run.runs] == [
        one["setpoints_sha256"] for one in said["section"]
    ]
    assert run.duration_s == pytest.approx(said["duration_s"], abs=0.001 * len(job.sections))
    assert (job.length_mm, job.deviation_um) == (said["length_mm"], said["deviation_bound_um"])
    assert (job.dwell_s, run.deadline_misses) == (0.25, None)
    assert job.duration_s == pytest.approx(run.duration_s, abs=0.002 * len(job.sections))


def test_a_section_is_a_path_that_can_be_planned_anew(tmp_path: Path, mill: hg.Machine) -> None:
    section = job_of(PART, tmp_path, mill).sections[0]
    assert (section.first_line, section.last_line) == (2, 3)
    assert section.deviation_um <= 10.0
    path = section.path
    assert path.point_mm(path.length_mm) == pytest.approx([35, 10, 0], abs=1e-5)
    slow = path.plan(hg.Limits(feed_mm_s=10), machine=mill)
    assert slow.duration_s > 2.0 * section.plan.duration_s
    assert slow.path is path
    image = section.plan.program().image
    assert section.program().image == image
    with pytest.raises(hg.InputError, match="needs machine="):
        path.plan(LIMITS)


def test_options_of_the_reader_are_passed_on(tmp_path: Path, mill: hg.Machine) -> None:
    slow = job_of(PART, tmp_path, mill, feed_mm_s=5.0, tolerance_mm=0.0)
    assert slow.duration_s > 11.0
    assert len(slow.sections) == 3
    with pytest.raises(hg.InputError, match=r"part\.ngc"):
        job_of(PART, tmp_path, mill, layers=["a"])
    with pytest.raises(hg.InputError, match="moves nothing"):
        job_of("M30\n", tmp_path, mill)


def test_a_job_runs_on_a_bus_with_its_operator(tmp_path: Path, mill: hg.Machine) -> None:
    job = job_of(PART.replace("M30", "M0\nX0\nM30"), tmp_path, mill)
    asked: list[str] = []
    with hg.local_bus() as bus, hg.connect(mill, bus) as controller:
        with pytest.raises(hg.InputError, match=r"part\.ngc:6: M0 waits for the operator"):
            controller.run_job(job)
        run = controller.run_job(job, operator=asked.append)
        assert run.bus == bus
    assert asked == [f"{tmp_path / 'part.ngc'}:6: M0"]
    offline = job.simulate()
    assert [one.encoders_sha256 for one in run.runs] == [
        one.encoders_sha256 for one in offline.runs
    ]
    assert repr(run) == f"JobRun(3 sections, on {bus})"


# -- on a bus --------------------------------------------------------------------------------------


def test_a_controller_is_operated_step_by_step(machine: hg.Machine) -> None:
    program = hg.Path.through(POINTS).plan(LIMITS, machine=machine).program()
    with hg.local_bus() as bus, hg.connect(machine, bus) as controller:
        assert controller.simulated
        assert controller.configure()
        assert not controller.configure()
        controller.enable()
        assert controller.goto_start(program) == 0.0
        controller.override(50)
        controller.start()
        controller.sleep(0.3)
        assert controller.hold()
        at_mm = controller.status()["motion"]["arc_length_mm"]
        assert 0 < at_mm < 59
        controller.resume()
        controller.wait()
        assert controller.status()["override"]["wanted_percent"] == 50
        assert controller.goto_start(program) > 30
        controller.start()
        controller.sleep(0.1)
        controller.stop()
        controller.disable()
        assert controller.status()["state"] == "off"
        assert not controller.reset()


def test_connect_names_a_bus_that_is_not_there(machine: hg.Machine) -> None:
    with (
        pytest.raises(hg.BusError, match="no hub serves it"),
        hg.connect(machine, "local:/nowhere"),
    ):
        pass
