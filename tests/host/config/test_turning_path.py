# SPDX-License-Identifier: MIT
"""Path files on which rotary axes move alone: the program moves these axes only, and mistakes get one line. Run by
pytest; starts a controller and drives on a local bus, and writes to temporary folders.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import hodograph as hg
from hodograph.config import load_machine, load_path_file, load_paths
from hodograph.errors import InputError, PlanError
from hodograph.native import NativeProgram
from hodograph.pipeline import Pipeline, load_pipeline, pipeline_of, start_counts
from hodograph.simulate import simulate_on

ROOT = Path(__file__).resolve().parents[3]
FILE = ROOT / "examples" / "index.toml"
FIVE = ROOT / "examples" / "machines" / "mill_five_axes.toml"


def path_file(
    folder: Path, points: str, *, feed: str = "nominal_deg_s = 90", limits: str = ""
) -> Path:
    file = folder / "turn.toml"
    file.write_text(
        f"[path]\nclosed = false\nthrough = {points}\n[feed]\nprofile = 'optimal'\n{feed}\n"
        f"[limits]\n{limits}\n[machine]\nfile = '{FIVE}'\n"
    )
    return file


def test_the_program_moves_the_turning_axes_alone() -> None:
    pipeline = load_pipeline(FILE, allow_space=True)
    native = NativeProgram(pipeline.image)
    assert (native.first_axis, native.axis_count, pipeline.unit) == (3, 2, "deg")
    motion = simulate_on(pipeline.machine, native, "fixed")
    assert motion.names == ("a", "c")
    assert np.allclose(motion.cmd_mm[0], [0.0, 0.0], atol=1e-9)
    assert np.allclose(motion.cmd_mm[motion.ticks - 1], [20.0, 270.0], atol=1e-9)
    assert 89.0 < motion.feed_mm_s.max() <= 90.0
    assert np.abs(np.diff(motion.cmd_mm[:, 0])).max() / 0.002 <= 50.0
    assert motion.max_contour_error_um < 1.0
    assert start_counts(pipeline, "fixed") == [10_000_000, 20_000_000, 5_000_000, 0, 0]


def test_work_offset_and_a_machine_with_one_extra_axis(tmp_path: Path) -> None:
    five = load_machine(FIVE)
    four = replace(five, axes=five.axes[:4], path_count=4, offset_mm=(1.0, 2.0, 3.0, 4.0))
    file = path_file(tmp_path, "[[10, 20, 5, 0], [10, 20, 5, 90]]")
    pipeline = pipeline_of(load_path_file(file), four)
    native = NativeProgram(pipeline.image)
    assert (native.first_axis, native.axis_count) == (2, 2)
    motion = simulate_on(pipeline.machine, native, "fixed")
    assert not np.ptp(motion.set_counts[:, 0]), "z stands"
    assert motion.set_counts[[0, motion.ticks - 1], 1].tolist() == [400_000, 9_400_000]
    assert start_counts(pipeline, "fixed") == [11_000_000, 22_000_000, 8_000_000, 400_000]


def test_an_axis_of_the_machine_that_the_points_do_not_have_stands_at_0(tmp_path: Path) -> None:
    file = path_file(tmp_path, "[[1, 2, 3, 0], [1, 2, 3, 90]]")
    pipeline = load_pipeline(file, allow_space=True)
    motion = simulate_on(pipeline.machine, NativeProgram(pipeline.image), "fixed")
    assert motion.names == ("a", "c")
    assert motion.set_counts[[0, motion.ticks - 1]].tolist() == [[0, 0], [9_000_000, 0]]


TURN = "[[1, 2, 3, 0, 0], [1, 2, 3, 30, 40], [1, 2, 3, 60, 20]]"
MOVE = "[[0, 0, 0, 0, 0], [10, 0, 0, 30, 40]]"
WRONG = (
    (TURN, "nominal_mm_s = 90", "", r"nominal_mm_s does not apply .* alone: give nominal_deg_s"),
    (
        MOVE,
        "nominal_deg_s = 90",
        "",
        r"nominal_deg_s does not apply .* x, y or z: give nominal_mm_s",
    ),
    (TURN, "", "jerk_mm_s3 = 9", r"jerk_mm_s3 does not apply .* alone: give jerk_deg_s3"),
    (MOVE, "", "feed_deg_s = 9", r"feed_deg_s does not apply .* give feed_mm_s"),
    (TURN, "", "centripetal_mm_s2 = 9", r"centripetal_mm_s2 does not apply .* remove it"),
    (
        TURN,
        "",
        "cap = [{from_mm = 1, to_mm = 2, feed_mm_s = 3}]",
        r"cap does not apply .* remove it",
    ),
)


@pytest.mark.parametrize(("points", "feed", "limits", "words"), WRONG)
def test_keys_in_the_other_unit_are_refused(
    tmp_path: Path, points: str, feed: str, limits: str, words: str
) -> None:
    with pytest.raises(InputError, match=words):
        load_path_file(path_file(tmp_path, points, feed=feed, limits=limits))


def test_other_mistakes_have_one_line(tmp_path: Path) -> None:
    file = path_file(tmp_path, TURN)
    with pytest.raises(
        InputError, match=r"\[x, y, z, a, b\], but 3 axes of the machine follow a path"
    ):
        pipeline_of(load_path_file(file), load_machine(FIVE.with_name("mill.toml")))
    back = path_file(tmp_path, "[[1, 2, 3, 0, 0], [1, 2, 3, 30, 0], [1, 2, 3, 10, 0]]")
    with pytest.raises(
        PlanError, match="the only rotary axis reverses at point 1: end the path there"
    ):
        _ = load_pipeline(back, allow_space=True).image
    beyond = path_file(tmp_path, "[[1, 2, 3, 0, 0], [1, 2, 3, 130, 0]]")
    with pytest.raises(PlanError, match="travel"):
        _ = load_pipeline(beyond, allow_space=True).image


def listed(folder: Path, own: str = "", *, feed: str = "nominal_mm_s = 20") -> Path:
    """A list of a move and a turn, which has these tables of its own."""
    file = folder / "list.toml"
    file.write_text(
        f"[feed]\nprofile = 'optimal'\n{feed}\n[[path]]\nclosed = false\nthrough = {MOVE}\n"
        f"[[path]]\nclosed = false\nthrough = {TURN}\n{own}\n[machine]\nfile = '{FIVE}'\n"
    )
    return file


def test_a_path_of_a_list_has_feed_and_limits_of_its_own(tmp_path: Path) -> None:
    own = "[path.feed]\nprofile = 'optimal'\nnominal_deg_s = 7\n[path.limits]\nfeed_deg_s = 6\nreserve = 0.25"
    move, turn = load_paths(listed(tmp_path, own))
    assert move.file.feed is not None
    assert turn.file.feed is not None
    assert (move.file.feed.nominal_mm_s, turn.file.feed.nominal_mm_s) == (20.0, 7.0)
    assert (move.file.limits.feed_mm_s, turn.file.limits.feed_mm_s) == (None, 6.0)
    assert (move.file.turns_alone, turn.file.turns_alone) == (False, True)
    assert turn.file.limits.reserve == 0.25
    both = load_paths(listed(tmp_path, feed=""))
    assert both[0].file.feed == both[1].file.feed, "without a unit, [feed] is for all"


@pytest.mark.parametrize(
    ("own", "words"),
    [
        (
            "",
            r"\[feed\] nominal_mm_s .* path 2, which moves rotary axes alone: give nominal_deg_s in \[path.feed\]",
        ),
        (
            "[path.feed]\nprofile = 'optimal'\nnominal_mm_s = 3",
            r"\[path 2.feed\] nominal_mm_s .* nominal_deg_s$",
        ),
        (
            "[path.feed]\nprofile = 'optimal'\n[path.limits]\ncentripetal_mm_s2 = 3",
            r"\[path 2.limits\] centripetal_mm_s2 .* remove it$",
        ),
        ("[path.feed]\nspeed = 3", r"\[path 2.feed\] speed: unknown key"),
    ],
)
def test_tables_of_a_path_that_are_wrong(tmp_path: Path, own: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        load_paths(listed(tmp_path, own))


def test_limits_of_the_file_that_a_turning_path_cannot_have(tmp_path: Path) -> None:
    file = listed(tmp_path, feed="")
    file.write_text(file.read_text() + "[limits]\ncentripetal_mm_s2 = 3\n")
    with pytest.raises(InputError, match=r"path 2, .*: give other limits in \[path.limits\] after"):
        load_paths(file)


def test_points_at_rest_are_the_same_exactly(tmp_path: Path) -> None:
    """A path whose x, y or z moves at all is drawn by them."""
    file = path_file(tmp_path, "[[1, 2, 3, 0, 0], [1, 2.01, 3, 30, 40]]", feed="")
    assert type(load_pipeline(file, allow_space=True)) is Pipeline


def test_the_api_takes_it() -> None:
    machine = hg.Machine.load(FIVE)
    path = hg.Path.through([[1, 2, 3, 0, 0], [1, 2, 3, 30, 40], [1, 2, 3, 60, 20]])
    assert path.length_mm > 85.0
    plan = path.plan(
        hg.Limits(feed_mm_s=60, axis_velocity_mm_s=(9, 9, 9, 50, 120)), machine=machine
    )
    run = plan.program().simulate()
    assert run.setpoints_counts[-1].tolist() == [6_000_000, 2_000_000]
    assert 59.0 < run.feed_mm_s.max() <= 60.0
    from_file = hg.load_plan(FILE).program()
    assert from_file.simulate().setpoints_counts[-1].tolist() == [2_000_000, 27_000_000]


def test_the_api_runs_it_on_a_bus(tmp_path: Path) -> None:
    """x, y and z go where the path has them; an image alone does not hold where that is."""
    program = hg.load_plan(FILE).program()
    program.save(tmp_path / "index.hdgp")
    loaded = hg.load_program(tmp_path / "index.hdgp", program.machine)
    with hg.local_bus() as bus, hg.connect(program.machine, bus) as controller:
        with pytest.raises(hg.InputError, match="moves rotary axes alone"):
            controller.run(loaded)
        run = controller.run(program)
        axes = controller.status()["axes"]
    assert run.setpoints_sha256 == program.simulate().setpoints_sha256
    points = load_pipeline(FILE, allow_space=True).standing_mm
    assert [axis["actual_mm"] for axis in axes[: len(points)]] == pytest.approx(points, abs=0.01)
