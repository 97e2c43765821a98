# SPDX-License-Identifier: MIT
"""Machine and drive files: the shipped ones, and every mistake in one line. Run by pytest; writes to temporary
folders.
"""

from __future__ import annotations

import re
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from hodograph.config import Feedforward, Homing, Scaling, Supervision, load_drive, load_machine
from hodograph.config.rewrite import drive_text
from hodograph.errors import InputError

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"

# The paper's Table 2 and plant (shared with nobody: typed from the paper).
GAINS = {
    "alpha_x": (97.38, 1.19, 252.8),
    "alpha_y": (97.38, 1.53, 253.2),
    "heart_x": (109.95, 1.2, 252.0),
    "heart_y": (109.95, 1.5, 253.0),
}
PLANT = {"x": (83.0089, 0.19936), "y": (50.4977, 0.15641)}


@pytest.mark.parametrize("name", GAINS)
def test_drives_of_the_paper(name: str) -> None:
    drive = load_drive(EXAMPLES / "drives" / f"{name}.toml")
    assert (drive.k_pp_rad_s_mm, drive.k_pv_nm_s_rad, drive.k_iv_per_s) == GAINS[name]
    assert (drive.gain_rad_s_v, drive.time_constant_s) == PLANT[name[-1]]
    assert (drive.k_pf_rad_mm, drive.k_vf, drive.screw_mm_rad) == (0.8, 0.85, 1.59)
    assert drive.torque_to_volts == 1 / 0.716
    assert (drive.interpolation, drive.speed, drive.delay_samples) == ("linear", "exact", 0)
    assert drive.volts_limit == 5.0


@pytest.mark.parametrize("name", ["paper_alpha", "paper_heart"])
def test_machines_of_the_paper(name: str) -> None:
    machine = load_machine(EXAMPLES / "machines" / f"{name}.toml")
    assert [axis.node for axis in machine.axes] == [2, 3]
    assert machine.period_us == 1000
    assert machine.counts_per_mm == 1_000_000
    assert machine.start_tolerance_counts == 5000
    assert machine.offset_mm == (0.0, 0.0)
    assert machine.supervision == Supervision(100, 1, 200)
    for axis in machine.axes:
        assert axis.homing == Homing(0, 0.0, 10.0, 1.0, 100.0)
        assert (axis.feedforward, axis.scaling) == (Feedforward(0.0, 0.0, 0.0), Scaling(0, 0, 0, 0))
        assert (axis.following_window_mm, axis.following_timeout_ms) == (None, 0)
        assert axis.quick_stop_mm_s2 == pytest.approx(
            4294.967
        )  # u32 cannot hold 5000 mm/s^2 in nm/s^2


def test_every_key_of_real_drives() -> None:
    machine = load_machine(EXAMPLES / "machines" / "real_drives.toml")
    assert machine.supervision == Supervision(
        answer_wait_ms=2, missed_max=1, setpoint_timeout_ms=50
    )
    assert machine.program_bytes == 129008
    x, y, z = machine.axes
    assert (x.following_window_mm, x.following_timeout_ms, x.quick_stop_mm_s2) == (2, 20, 3000)
    assert x.homing == Homing(17, -200.0, 20.0, 2.0, 200.0, 1)
    assert x.feedforward == Feedforward(1.0, 12.5, 3.0)
    assert x.scaling == Scaling(131072, 10_000_000, 1, 1)
    assert y.homing.method == 37
    assert (z.drive, z.feedforward.has_torque) == (None, False)
    assert machine.path_axes == (x, y)
    with pytest.raises(InputError, match="axis x cannot be simulated without a model"):
        machine.models(machine.axes)


def machine_with(folder: Path, old: str, new: str) -> Path:
    shutil.copytree(EXAMPLES, folder / "examples")
    file = folder / "examples" / "machines" / "paper_alpha.toml"
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, 1))
    return file


MISTAKES = [
    ("period_us = 1000", "period_us = 3000", r"period_us must be 1000, 2000, 4000 or 8000"),
    ("period_us = 1000", "period = 1000", r'did you mean "period_us"\?'),
    ("node = 1\n", "node = 0\n", r"\[controller\] node must be from 1 to 127"),
    ("node = 1\n", "node = 2\n", r"\[axis 1\] node 2 is taken by the controller"),
    ("node = 3", "node = 2", r"\[axis 2\] node 2 is taken by axis x"),
    ('kernel = "fixed"', 'kernel = "fxed"', r'kernel.*did you mean "fixed"\?'),
    ("feed_mm_s = 500", "feed_mm_s = nan", r"feed_mm_s must be a finite number"),
    ("reserve = 0.1", "reserve = 1", r"reserve must be from 0 to 0\.9"),
    ("travel_mm = [-200, 200]", "travel_mm = [200, -200]", r"travel_mm must be \[least, greatest\]"),
    ("travel_mm = [-200, 200]", "travel_mm = [-200]", r"travel_mm must be two numbers"),
    ("travel_mm = [-200, 200]", "travel_mm = [-3000, 200]", r"leaves the ±2147\.5 mm"),
    ("counts_per_mm = 1000000", "counts_per_mm = 100000", r"counts_per_mm must be the same for all"),
    ("../drives/alpha_x.toml", "../drives/alpha_z.toml", r"drive names .*alpha_z\.toml, which is not there"),
    ("offset_mm = [0, 0]", "offset_mm = [0, inf]", r"offset_mm must be a finite number"),
    ("[[axis]]", "[axis]", r"not valid TOML: Cannot overwrite a value"),
    ("[work]", "[wrk]", r'did you mean "work"\?'),
    ("[work]", "[supervision]\nmissed_max = -1\n[work]", r"\[supervision\] missed_max must be from 0 to 255"),
    ("[work]", "[supervision]\nanswer_wait_ms = 300\n[work]", r"setpoint_timeout_ms is 200: must be above"),
    ("[work]", "[supervision]\nanswer_wait = 3\n[work]", r'did you mean "answer_wait_ms"\?'),
    ("velocity_mm_s = 500\nacc", "acc", r"\[axis 2\] velocity_mm_s is missing: add"),
    ("jerk_mm_s3 = 200000\ncounts", "counts", r"\[axis 1\] jerk_mm_s3 is missing: add"),
    ("node = 3", "node = 3\nfollowing_window_mm = 0", r"\[axis 2\] following_window_mm must be from"),
    ("node = 3", "node = 3\nquick_stop_mm_s2 = 5000", r"quick_stop_mm_s2 must be from 1e-06 to 4295.0 \(u32 in counts"),
    ("node = 3", "node = 3\nhoming = {speed_mm_s = 3}", r"\[axis 2.homing\] method is missing"),
    ("node = 3", "node = 3\nhoming = {method = 5}", r"\[axis 2.homing\] method must be one of 0, 17, .*but is 5"),
    ("node = 3", "node = 3\nhoming = {method = 17, speed_mm_s = 1, slow_mm_s = 2}", r"slow_mm_s is 2, above"),
    ("node = 3", "node = 3\nhoming = {method = 17, sequence = 16}", r"sequence must be .*0 to 15"),
    ("node = 3", "node = 3\nhoming = 17", r"\[axis 2\] homing must be a section"),
    ("node = 3", "node = 3\nfeedforward = {velocity = 2.5}", r"\[axis 2.feedforward\] velocity must be from 0 to 2"),
    ("node = 3", "node = 3\nfeedforward = {torque_permille_s_mm = 1}", r'did you mean "torque_permille_s_m"\?'),
    ("node = 3", "node = 3\nscaling = {gear_motor_revolutions = 0}", r"both or none"),
    ("node = 3", 'node = 3\nunit = "inch"', r'unit cannot be "inch"; use one of: mm, deg'),
    ("node = 3", "node = 3\ntravel_deg = [0, 1]", r"travel_deg does not fit: the axis does not turn, use travel_mm"),
    ("node = 3", 'node = 3\nunit = "deg"', r"travel_mm does not fit: the axis turns, use travel_deg"),
    ("node = 3", "node = 3\nhoming = {method = 17, speed_deg_s = 1}", r"speed_deg_s does not fit: .* use speed_mm_s"),
    ("node = 3", "node = 3\nscaling = {feed_counts_per_rev = 1e6}", r"feed_counts_per_rev must be a whole number"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "message"), MISTAKES, ids=[m[2] for m in MISTAKES])
def test_mistakes(tmp_path: Path, old: str, new: str, message: str) -> None:
    with pytest.raises(InputError) as caught:
        load_machine(machine_with(tmp_path, old, new))
    text = str(caught.value)
    assert re.search(message, text), text
    assert "paper_alpha.toml" in text
    assert "\n" not in text


@pytest.mark.parametrize("count", range(1, 8))
def test_one_to_six_axes(tmp_path: Path, count: int) -> None:
    file = machine_with(tmp_path, "[work]", "[work]")
    text, axis = file.read_text().split("[[axis]]")[0], "[[axis]]\nname = 'a{0}'\nnode = {0}\n"
    axis += "velocity_mm_s = 500\nacceleration_mm_s2 = 5000\njerk_mm_s3 = 200000\n"
    axis += "travel_mm = [-1, 1]\ndrive = '../drives/alpha_x.toml'\n"
    file.write_text(text + "".join(axis.format(node) for node in range(2, 2 + count)))
    if count == 7:
        with pytest.raises(InputError, match=r"\[axis 7\] name makes 7 axes: a machine has 1 to 6"):
            load_machine(file)
        return
    machine = load_machine(file)
    assert machine.nodes == tuple(range(2, 2 + count))
    if count > 1:
        assert [axis.name for axis in machine.path_axes] == ["a2", "a3"]
        return
    with pytest.raises(InputError, match=r"has one axis \(a2\), a path needs two: add a second"):
        _ = machine.path_axes


PATHS = [
    ("path = 3", r"\[path\] must be a list of texts, but is 3"),
    ("path = []", r"must be a list of texts"),
    ('path = ["x", 2]', r"must be a text, but is 2"),
    ('path = ["x"]', r"names one axis: it takes two, or three to 6"),
    ('path = ["x", "q"]', r'names "q", but the axes are x, y, z, a, c'),
    ('path = ["x", "y", "x"]', r'names "x" twice'),
    ('path = ["x", "y", "a"]', r"axis a turns, but a path is drawn by the first three of its axes"),
    ('path = ["c", "y"]', r"axis c turns, but a path is drawn by the first two of its axes"),
    ('path = ["x", "y", "z", "a", "c", "b", "d"]', r'names "b", but the axes are'),
    ('path = ["x", "y", "z"]', r"offset_mm must be three numbers \[a, b, c\], but is \[0, 0, 0, 0, 0\]"),
    ('pth = ["x", "y", "z"]', r'did you mean "path"\?'),
]  # fmt: skip


def five_axes(folder: Path, path: str) -> Path:
    shutil.copytree(EXAMPLES, folder / "examples")
    file = folder / "examples" / "machines" / "mill_five_axes.toml"
    lines = file.read_text().splitlines(keepends=True)
    at = next(i for i, line in enumerate(lines) if line.startswith("path = "))
    file.write_text("".join([*lines[:at], path + "\n", *lines[at + 1 :]]))
    return file


@pytest.mark.parametrize(("path", "message"), PATHS, ids=[m[0] for m in PATHS])
def test_mistakes_in_the_path(tmp_path: Path, path: str, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        load_machine(five_axes(tmp_path, path))
    assert "mill_five_axes.toml" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_path_needs_names_that_differ(tmp_path: Path) -> None:
    file = five_axes(tmp_path, 'path = ["x", "y", "z", "a", "c"]')
    file.write_text(
        file.read_text().replace('name = "c"', 'name = "a"').replace('"a", "c"]', '"a"]')
    )
    with pytest.raises(InputError, match='names "a", which two axes are called'):
        load_machine(file)


def test_axes_are_in_the_order_of_the_path(tmp_path: Path) -> None:
    machine = load_machine(five_axes(tmp_path, 'path = ["z", "x", "y", "c", "a"]'))
    assert [axis.name for axis in machine.axes] == ["z", "x", "y", "c", "a"]
    assert machine.nodes == (4, 2, 3, 6, 5)
    text = machine.file.read_text().replace("offset_mm = [0, 0, 0, 0, 0]", "offset_mm = [1, -2]")
    machine.file.write_text(text.replace('["z", "x", "y", "c", "a"]', '["z", "y"]'))
    machine = load_machine(machine.file)
    assert [axis.name for axis in machine.path_axes] == ["z", "y"]
    assert [axis.name for axis in machine.axes] == ["z", "y", "x", "a", "c"]
    assert machine.offset_mm == (1.0, -2.0)


def test_machines_in_space() -> None:
    mill = load_machine(EXAMPLES / "machines" / "mill.toml")
    assert [(a.name, a.unit, a.counts_per_unit) for a in mill.path_axes] == [
        (name, "mm", 1_000_000) for name in "xyz"
    ]
    assert mill.offset_mm == (0.0, 0.0, 0.0)
    five = load_machine(EXAMPLES / "machines" / "mill_five_axes.toml")
    a, c = five.path_axes[3:]
    assert (a.unit, a.counts_per_unit, a.turns) == ("deg", 100_000, True)
    assert (a.travel_min_mm, a.travel_max_mm) == (-120, 120)
    assert (c.velocity_mm_s, c.acceleration_mm_s2, c.jerk_mm_s3) == (360, 3600, 90_000)
    assert c.quick_stop_mm_s2 == 3600  # of the axis itself
    assert five.counts_per_mm == 1_000_000


def test_every_key_of_an_axis_that_turns(tmp_path: Path) -> None:
    file = five_axes(tmp_path, 'path = ["x", "y", "z", "a", "c"]')
    file.write_text(
        file.read_text()
        + "following_window_deg = 2\nquick_stop_deg_s2 = 1000\n"
        + "[axis.homing]\nmethod = 17\noffset_deg = 3\nspeed_deg_s = 4\nslow_deg_s = 0.5\nacceleration_deg_s2 = 7\n"
        + "[axis.feedforward]\nvelocity = 1\ntorque_permille_s2_kdeg = 8\ntorque_permille_s_kdeg = 9\n"
    )
    c = load_machine(file).axes[4]
    assert (c.following_window_mm, c.quick_stop_mm_s2) == (2, 1000)
    assert c.homing == Homing(17, 3, 4, 0.5, 7, 1)
    assert c.feedforward == Feedforward(1, 8, 9)


def test_a_path_that_is_not_named_may_not_turn(tmp_path: Path) -> None:
    file = five_axes(tmp_path, "")
    text = file.read_text().replace("offset_mm = [0, 0, 0, 0, 0]", "")
    head, *axes = text.split("[[axis]]")
    file.write_text("[[axis]]".join([head, axes[3], *axes[:3], axes[4]]))
    machine = load_machine(file)
    with pytest.raises(InputError, match="axis a turns, but a path is drawn by the first two"):
        _ = machine.path_axes


def test_scaling_from_the_screw(tmp_path: Path) -> None:
    file = machine_with(
        tmp_path, "node = 2", "node = 2\nscaling = {encoder_increments_per_rev = 8192}"
    )
    assert load_machine(file).axes[0].scaling == Scaling(8192, 9_990_265, 0, 0)  # 2 pi 1.59 mm


def test_equipment_of_a_simulated_drive(tmp_path: Path) -> None:
    text = (EXAMPLES / "drives" / "alpha_x.toml").read_text()
    file = tmp_path / "drive.toml"
    file.write_text(text + "\n[equipment]\nlimit_negative_mm = -210\nfriction_volts = 0.2\n")
    drive = load_drive(file)
    assert drive.equipment.given() == {"limit_negative_mm": -210, "friction_volts": 0.2}
    assert drive.rated_torque_nm == pytest.approx(0.5 * 5.0 * 0.716)
    assert load_drive(EXAMPLES / "drives" / "alpha_x.toml").equipment.given() == {}


def test_servo_of_a_simulated_drive(tmp_path: Path) -> None:
    text = (EXAMPLES / "drives" / "alpha_x.toml").read_text()
    file = tmp_path / "drive.toml"
    text = text.replace("[encoder]\n", '[encoder]\nspeed = "differences"\n')
    file.write_text(
        text.replace("[servo]\n", '[servo]\ninterpolation = "cubic"\ndelay_samples = 1\n')
    )
    drive = load_drive(file)
    assert (drive.interpolation, drive.speed, drive.delay_samples) == ("cubic", "differences", 1)


def test_gains_in_radians_of_the_motor(tmp_path: Path) -> None:
    by_way = load_drive(EXAMPLES / "drives" / "alpha_x.toml")
    by_motor = load_drive(EXAMPLES / "drives" / "alpha_x_1ms.toml")
    assert (by_motor.integral, by_motor.interpolation) == ("forward", "none")
    for gain in ("k_pp_rad_s_mm", "k_pf_rad_mm"):
        larger = getattr(by_motor, gain) * by_motor.screw_mm_rad
        assert larger == pytest.approx(getattr(by_way, gain), rel=1e-15)
    file = tmp_path / "drive.toml"
    text = (EXAMPLES / "drives" / "alpha_x_1ms.toml").read_text()
    file.write_text(text.replace("k_pp_per_s =", "k_pp_rad_s_mm = 1\nk_pp_per_s ="))
    with pytest.raises(InputError, match=r"k_pp_per_s and k_pp_rad_s_mm are one gain in two units"):
        load_drive(file)
    file.write_text(text)
    changed = drive_text(file, by_motor, replace(by_motor, k_pp_rad_s_mm=50.0, k_vf=0.9))
    assert "k_pp_per_s = 79.5" in changed
    assert "k_pp_rad_s_mm" not in changed
    file.write_text(changed)
    assert load_drive(file).k_pp_rad_s_mm == pytest.approx(50.0, rel=1e-15)
    assert load_drive(file).k_pf_rad_mm == by_motor.k_pf_rad_mm


@pytest.mark.parametrize(
    ("section", "key", "least", "greatest", "below", "above"),
    [
        ("plant", "gain_rad_s_v", 1e-3, 1e6, 0.99e-3, 1.01e6),
        ("plant", "time_constant_s", 1e-5, 1e3, 0.99e-5, 1.01e3),
        ("plant", "screw_mm_rad", 1e-4, 1e3, 0.99e-4, 1.01e3),
        ("plant", "torque_to_volts", 1e-6, 1e6, 0.99e-6, 1.01e6),
        ("plant", "volts_limit", 1e-3, 32.767, 0.99e-3, 32.768),
        ("pdff", "k_pp_rad_s_mm", 0.0, 1e6, -1e-9, 1.01e6),
        ("pdff", "k_pv_nm_s_rad", 0.0, 1e6, -1e-9, 1.01e6),
        ("pdff", "k_iv_per_s", 0.0, 1e6, -1e-9, 1.01e6),
        ("pdff", "k_pf_rad_mm", 0.0, 1e6, -1e-9, 1.01e6),
        ("pdff", "k_vf", 0.0, 1e3, -1e-9, 1.01e3),
        ("encoder", "counts_per_rev", 16, 2**26, 15, 2**26 + 1),
        ("servo", "loop_rate_hz", 1000, 64000, 0, 65000),
        ("servo", "delay_samples", 0, 1, -1, 2),
        ("equipment", "overload_s", 0.0, 1e6, -1e-9, 1.01e6),
        ("equipment", "friction_volts", 0.0, 1e6, -1e-9, 1.01e6),
        ("equipment", "rated_torque_nm", 1e-9, 1e6, 0.99e-9, 1.01e6),
    ],
)
def test_ranges_of_a_drive_file(
    tmp_path: Path,
    section: str,
    key: str,
    least: float,
    greatest: float,
    below: float,
    above: float,
) -> None:
    file = tmp_path / "drive.toml"
    lines = (EXAMPLES / "drives" / "alpha_x.toml").read_text() + "\n[equipment]\n"
    others = re.sub(rf"(?m)^{key} =.*$", "", lines)

    def given(value: float) -> float | None:
        file.write_text(others.replace(f"[{section}]", f"[{section}]\n{key} = {value!r}"))
        drive = load_drive(file)
        if section == "equipment":
            return drive.equipment.given()[key]
        return getattr(drive, "encoder_" + key if section == "encoder" else key)

    assert given(least) == least
    assert given(greatest) == greatest
    for wrong in (below, above):
        with pytest.raises(InputError, match=rf"\[{section}\] {key} must be from "):
            given(wrong)


DRIVE_MISTAKES = [
    ("[servo]", "[servo]\ndelay_samples = 2", r"\[servo\] delay_samples must be from 0 to 1"),
    (
        "[encoder]",
        '[encoder]\nspeed = "exactly"',
        r'speed cannot be "exactly"; did you mean "exact"',
    ),
    (
        "[servo]",
        "[equipment]\nhome_from_mm = 1\n[servo]",
        r"home_from_mm and home_to_mm go together",
    ),
    (
        "[servo]",
        "[equipment]\nlimit_negative_mm = 1\nlimit_positive_mm = 1\n[servo]",
        r"limit_negative_mm is 1: must be below limit_positive_mm = 1",
    ),
    ("[servo]", "[equipment]\nfriction = 1\n[servo]", r'did you mean "friction_volts"\?'),
    ("gain_rad_s_v = 83.0089", "gain_rad_s_v = 0", r"gain_rad_s_v must be from"),
    (
        "gain_rad_s_v = 83.0089",
        "gain = 83.0089",
        r"gain: unknown key; use one of: gain_rad_s_v, time_constant_s",
    ),
    ("volts_limit = 5.0", "volts_limit = 50", r"volts_limit must be from"),
    ("counts_per_rev = 1048576", "counts_per_rev = 1.5", r"counts_per_rev must be a whole number"),
    ("loop_rate_hz = 16000", "loop_rate_hz = 1500", r"loop_rate_hz must be a multiple of 1000"),
    ("k_vf = 0.85\n", "", r"\[pdff\] k_vf is missing"),
]


@pytest.mark.parametrize(
    ("old", "new", "message"), DRIVE_MISTAKES, ids=[m[2] for m in DRIVE_MISTAKES]
)
def test_drive_mistakes(tmp_path: Path, old: str, new: str, message: str) -> None:
    text = (EXAMPLES / "drives" / "alpha_x.toml").read_text()
    assert old in text
    file = tmp_path / "drive.toml"
    file.write_text(text.replace(old, new, 1))
    with pytest.raises(InputError) as caught:
        load_drive(file)
    assert re.search(message, str(caught.value)), str(caught.value)
    assert str(caught.value).startswith(f"{file}: ")
