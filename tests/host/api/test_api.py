# SPDX-License-Identifier: MIT
"""The public Python API: the same programs as the commands, arrays of the promised shapes, quick to import."""

from __future__ import annotations

import doctest
import inspect
import subprocess
import sys
from collections.abc import Callable
from importlib import import_module
from itertools import pairwise
from pathlib import Path

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


@pytest.mark.parametrize("module", ["machine", "path", "program", "bus"])
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
        (lambda: hg.load_program("nothing", hg.Machine.example()), hg.InputError, "No such file"),
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
        pytest.raises(hg.BusError, match="nobody serves it"),
        hg.connect(machine, "local:/nowhere"),
    ):
        pass
