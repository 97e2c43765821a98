# SPDX-License-Identifier: MIT
"""Paths on a machine whose path has three axes: from the file to the trace. Run by pytest; writes to temporary
folders.
"""

from pathlib import Path

import numpy as np
import pytest

from hodograph.cli.main import main
from hodograph.errors import InputError
from hodograph.native import NativeProgram
from hodograph.pipeline import load_pipeline
from hodograph.simulate import simulate, simulate_stop

EXAMPLES = Path(__file__).parents[3] / "examples"
MILL = EXAMPLES / "machines" / "mill.toml"
FLAT = """
[path]
closed = false
through = [[0, 0], [9, 4], [17, 1], [26, 6]]
[feed]
profile = "minimax"
nominal_mm_s = 60
ramp_time_s = 0.1
[limits]
acceleration_mm_s2 = 1500
[limits.axis]
acceleration_mm_s2 = [900, 800]
"""


def test_the_helix_runs_and_its_trace_has_every_axis(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    trace = tmp_path / "helix.csv"
    main(["simulate", str(EXAMPLES / "helix.toml"), "--trace", str(trace), "--json"])
    capsys.readouterr()
    header, *rows = trace.read_text().splitlines()
    names = header.split(",")
    for quantity in ("cmd_mm", "set_counts", "act_mm", "volts"):
        assert {f"{axis}_{quantity}" for axis in "xyz"} <= set(names)
    values = np.array([row.split(",") for row in rows], dtype=np.float64)
    x, y, z = (values[:, names.index(f"{axis}_cmd_mm")] for axis in "xyz")
    assert np.hypot(x, y) == pytest.approx(20.0, abs=0.1)
    assert (z[0], z[-1]) == pytest.approx((0.0, 15.0))
    assert values[:, names.index("z_act_mm")] == pytest.approx(z, abs=0.01)
    assert values[:, names.index("contour_error_um")].max() < 1.0


@pytest.mark.parametrize("kind", ["hold", "stop", "fault"])
def test_stops_in_space_keep_limits_and_bounds(kind: str) -> None:
    pipeline = load_pipeline(EXAMPLES / "helix.toml", allow_space=True)
    machine = pipeline.machine
    drives = machine.models(machine.path_axes)
    program = NativeProgram(pipeline.image)
    for at_s in (0.0, 0.31, 0.57, 0.9):
        run = simulate_stop(program, drives, kind, at_s)
        assert run.rest_after_s <= run.bound_s
        for axis in "xyz":
            assert run.peak[f"{axis}_velocity_mm_s"] <= 200.0
            assert run.peak[f"{axis}_acceleration_mm_s2"] <= 2000.0
            assert run.peak[f"{axis}_jerk_mm_s3"] <= 50000.0


def test_a_path_in_the_plane_runs_at_z_0(tmp_path: Path) -> None:
    file = tmp_path / "flat.toml"
    file.write_text(FLAT)
    pipeline = load_pipeline(file, MILL)
    program = pipeline.program
    assert program.axis_count == 3
    assert not program.point_q40[2].any()
    drives = pipeline.machine.models(pipeline.machine.path_axes)
    motion = simulate(pipeline.image, drives)
    assert motion.names == ("x", "y", "z")
    assert not motion.cmd_mm[:, 2].any()
    assert motion.cmd_mm[motion.ticks - 1] == pytest.approx((26.0, 6.0, 0.0), abs=1e-6)
    with pytest.raises(InputError, match="needs the drives of 3 axes, not 2"):
        simulate(pipeline.image, drives[:2])


def test_a_path_in_space_needs_three_axes() -> None:
    pipeline = load_pipeline(
        EXAMPLES / "helix.toml", EXAMPLES / "machines" / "paper_alpha.toml", allow_space=True
    )
    with pytest.raises(InputError, match="only two axes of the machine follow a path"):
        _ = pipeline.plan


def test_axes_that_the_path_does_not_move_stand_at_0(tmp_path: Path) -> None:
    machine = EXAMPLES / "machines" / "mill_five_axes.toml"
    file = tmp_path / "flat.toml"
    file.write_text(FLAT)
    program = load_pipeline(file, machine).program
    assert program.axis_count == 5
    assert not program.point_q40[3:].any()
    assert not program.extra_q40.any()
    assert np.array_equal(program.point_q40[:3], load_pipeline(file, MILL).program.point_q40)


def test_five_axes_have_their_own_units_and_counts(tmp_path: Path) -> None:
    trace = tmp_path / "five.csv"
    assert main(["simulate", str(EXAMPLES / "five_axes.toml"), "--trace", str(trace)]) == 0
    head, *rows = trace.read_text().splitlines()
    names = head.split(",")
    assert {"z_cmd_mm", "a_cmd_deg", "c_set_counts", "c_act_deg", "c_error_deg"} <= set(names)
    last = dict(zip(names, map(float, rows[-1].split(",")), strict=True))
    assert [last[f"{axis}_set_counts"] for axis in "zac"] == [12_000_000, 1_200_000, 36_000_000]
    assert last["c_act_deg"] == pytest.approx(360.0, abs=1e-3)
    assert last["c_error_deg"] == pytest.approx(0.0, abs=1e-3)


def test_stops_of_five_axes_report_degrees() -> None:
    pipeline = load_pipeline(EXAMPLES / "five_axes.toml", allow_space=True)
    machine = pipeline.machine
    run = simulate_stop(
        pipeline.accepted,
        machine.models(machine.path_axes),
        "fault",
        1.0,
        counts_per_mm=machine.path_counts,
        names=machine.path_names,
        units=machine.path_units,
    )
    assert run.rest_after_s <= run.bound_s
    for axis in machine.path_axes:
        assert run.peak[f"{axis.name}_acceleration_{axis.unit}_s2"] <= axis.acceleration_mm_s2
        assert run.peak[f"{axis.name}_jerk_{axis.unit}_s3"] <= axis.jerk_mm_s3
    assert run.peak["c_error_deg"] < 1e-3


def test_a_path_with_too_many_axes_is_refused() -> None:
    pipeline = load_pipeline(EXAMPLES / "five_axes.toml", MILL, allow_space=True)
    with pytest.raises(InputError, match=r"points \[x, y, z, a, b\], but 3 axes of the machine"):
        _ = pipeline.plan
