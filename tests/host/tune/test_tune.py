# SPDX-License-Identifier: MIT
"""`hodograph tune`: goals are met, requested properties, files without loss, refusals. Run by pytest; writes to
temporary folders.
"""

from __future__ import annotations

import json
import shutil
import tomllib
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from hodograph.cli import output as cli_output
from hodograph.cli.main import main
from hodograph.config import Drive, Machine, load_machine
from hodograph.config.rewrite import rewritten
from hodograph.errors import PlanError
from hodograph.pipeline import load_pipeline
from hodograph.simulate import simulate
from hodograph.tune import Asked, Wanted, search, tune
from hodograph.tune.cases import CASES, NOMINAL, outcome
from hodograph.tune.search import greatest_bandwidth

from .conftest import EXAMPLES

MACHINES = EXAMPLES / "machines"


def run(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    status = main(arguments)
    out, err = capsys.readouterr()
    return status, out, err


@pytest.mark.parametrize(
    ("name", "paper_um", "within"),
    [
        ("alpha", 21.353, 0.001),
        ("heart", 28.098, 0.001),
        ("alpha_optimal", 35.0, 10.0),
        ("heart_optimal", 35.0, 10.0),
    ],
)
def test_the_example_machine_has_a_contour_error_of_its_encoder(
    name: str, paper_um: float, within: float
) -> None:
    """Requested: 1 um at the paper's feed, 2 um at the optimal one."""
    plain = load_pipeline(EXAMPLES / f"{name}.toml")
    tuned = load_pipeline(EXAMPLES / f"{name}.toml", MACHINES / "tuned.toml")
    assert plain.image == tuned.image
    errors = []
    for pipeline in (plain, tuned):
        machine = pipeline.machine
        drives = machine.models(machine.path_axes)
        motion = simulate(pipeline.image, drives, feedforward=machine.path_feedforward)
        assert motion.max_volts < 5.0
        errors.append(motion.max_contour_error_um)
    assert errors[0] == pytest.approx(paper_um, abs=within)
    assert 0.002 < errors[1] < 0.05


def test_the_example_machine_is_what_tune_finds(
    machine: Machine, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The search's last step again: the greatest bandwidth of the damping that was best."""
    monkeypatch.setattr(search, "DAMPINGS", (0.85,))
    monkeypatch.setattr(search, "BANDWIDTHS", 1)
    monkeypatch.setattr(search, "SPAN", 1.0)
    pipeline = load_pipeline(EXAMPLES / "alpha.toml", machine.file)
    found = tune(machine, [pipeline], Asked(interpolation="cubic"))
    example = load_machine(MACHINES / "tuned.toml")
    assert found.drives == example.models(example.path_axes)
    assert found.feedforward == example.path_feedforward
    assert found.tried == 1
    nominal = found.paths[0].cases[0]
    assert nominal.given.contour_error_um == pytest.approx(21.353, abs=0.001)
    assert nominal.tuned.contour_error_um < nominal.plain.contour_error_um < 0.1


@pytest.mark.parametrize(("name", "most_um"), [("alpha", 1.0), ("heart_optimal", 2.0)])
def test_straight_lines_and_late_sensing_keep_the_goals_too(
    machine: Machine, name: str, most_um: float
) -> None:
    pipeline = load_pipeline(EXAMPLES / f"{name}.toml")
    late = [
        replace(drive, speed="differences", delay_samples=1, interpolation="cubic")
        for drive in machine.models(machine.path_axes)
    ]
    axes = tuple(replace(a, drive=d) for a, d in zip(machine.path_axes, late, strict=True))
    asked = Asked(bandwidth_hz=214.5, damping=0.85)
    errors = []
    for given in (machine, replace(machine, axes=axes)):
        found = tune(given, [], asked)
        motion = simulate(pipeline.image, found.drives, feedforward=found.feedforward)
        errors.append(motion.max_contour_error_um)
    assert 0.1 < errors[0] < most_um
    assert 0.005 < errors[1] < 0.1


def test_every_case_differs_from_the_model(drives: tuple[Drive, Drive]) -> None:
    image = load_pipeline(EXAMPLES / "alpha.toml").image
    nominal = outcome(image, 1_000_000, drives, None, NOMINAL)
    for case in CASES[1:]:
        found = outcome(image, 1_000_000, drives, None, case)
        assert found != nominal, case.name
        assert 15 < found.contour_error_um < 30, case.name
        assert not found.saturated


@pytest.mark.parametrize(("volts", "spoiled"), [(4.5, True), (3.5, False)])
def test_volts_that_a_plan_leaves_are_for_weaker_plants(
    tmp_path: Path, volts: float, spoiled: bool
) -> None:
    """docs/guides/tuning.md: the fastest feed for 4.5 V of 5 V is none for a plant with a fifth less gain."""
    text = (EXAMPLES / "alpha_optimal.toml").read_text().replace("volts = 4.5", f"volts = {volts}")
    file = tmp_path / "alpha.toml"
    file.write_text(text)
    pipeline = load_pipeline(file, MACHINES / "tuned.toml")
    drives, forward = (
        pipeline.machine.models(pipeline.machine.path_axes),
        pipeline.machine.path_feedforward,
    )
    weak = next(case for case in CASES if case.name == "gain -20 %")
    found = outcome(pipeline.image, 1_000_000, (drives[0], drives[1]), forward, weak)
    assert found.saturated is spoiled
    assert (found.contour_error_um > 100) is spoiled
    assert (found.contour_error_um < 0.1) is not spoiled


def test_saturation_is_seen(drives: tuple[Drive, Drive]) -> None:
    pipeline = load_pipeline(EXAMPLES / "heart.toml")
    weak = next(c for c in CASES if c.name == "gain -20 %, time constant +20 %")
    assert outcome(pipeline.image, 1_000_000, drives, None, weak).saturated
    assert not outcome(pipeline.image, 1_000_000, drives, None, NOMINAL).saturated


def test_each_axis_has_its_own_voltage_limit(drives: tuple[Drive, Drive]) -> None:
    """y takes 2.5 V, which x with a limit of 2 V does not: it takes 1.3 V."""
    x, y = drives
    image = load_pipeline(EXAMPLES / "alpha.toml").image
    weaker = (replace(x, volts_limit=2.0), y)
    assert not outcome(image, 1_000_000, weaker, None, NOMINAL).saturated
    weaker = (replace(x, volts_limit=1.0), y)
    assert outcome(image, 1_000_000, weaker, None, NOMINAL).saturated


def _with_gains(machine: Machine, **factors: float) -> Machine:
    """The machine with these gains of x multiplied."""
    x, y = machine.axes
    assert x.drive is not None
    gains = {name: factor * getattr(x.drive, name) for name, factor in factors.items()}
    return replace(machine, axes=(replace(x, drive=replace(x.drive, **gains)), y))


@pytest.mark.parametrize(
    ("name", "factor"),
    [("k_pv_nm_s_rad", 500.0), ("k_iv_per_s", 10000.0), ("k_pp_rad_s_mm", 300.0)],
)
def test_unstable_gains_of_a_drive_file_are_named(
    machine: Machine, name: str, factor: float
) -> None:
    """The bandwidth is not the reason. The value that the message recommends is stable."""
    given = _with_gains(machine, **{name: factor})
    with pytest.raises(PlanError) as raised:
        tune(given, [], Asked(bandwidth_hz=60.0))
    text = str(raised.value)
    x, y = given.axes
    assert x.drive is not None
    assert text.startswith("axis x: the loop is not stable with ")
    assert f"{name} = {getattr(x.drive, name):g}" in text
    assert "\n" not in text
    lower = float(text.partition(f"{name} to ")[2].split()[0])
    assert 0.0 < lower < getattr(x.drive, name)
    x = replace(x, drive=replace(x.drive, **{name: lower}))
    assert tune(replace(given, axes=(x, y)), [], Asked(bandwidth_hz=60.0)).axes


def test_gains_of_which_no_smaller_one_is_stable_are_all_named(machine: Machine) -> None:
    given = _with_gains(machine, k_pp_rad_s_mm=0.0)
    with pytest.raises(PlanError, match=r"axis x: .* k_pp_rad_s_mm = 0, .*: set all three"):
        tune(given, [], Asked(bandwidth_hz=60.0))


def test_bandwidth_damping_and_stiffness_asked_for(machine: Machine) -> None:
    found = tune(machine, [], Asked(bandwidth_hz=80.0, damping=0.8, stiffness_n_um=190.0))
    assert min(axis.tuned.stiffness_n_um for axis in found.axes) == pytest.approx(190, rel=1e-3)
    assert found.poles.natural_rad_s == pytest.approx(2 * 3.14159265 * 80)
    stiffest = tune(machine, [], Asked(bandwidth_hz=80.0, damping=0.8))
    assert min(axis.tuned.stiffness_n_um for axis in stiffest.axes) > 191
    with pytest.raises(PlanError, match=r"stiffness 1e\+06 N/um: .* at most"):
        tune(machine, [], Asked(bandwidth_hz=80.0, stiffness_n_um=1e6))
    with pytest.raises(PlanError, match="quicker without feedback"):
        tune(machine, [], Asked(bandwidth_hz=0.3))
    with pytest.raises(PlanError, match="not stable at 16000 samples"):
        tune(machine, [], Asked(bandwidth_hz=4000.0))


def test_more_margin_is_less_bandwidth(drives: tuple[Drive, Drive]) -> None:
    usual = greatest_bandwidth(drives, 1.0, Wanted())
    careful = greatest_bandwidth(drives, 1.0, Wanted(modulus=0.7, delay_s=500e-6))
    assert usual is not None
    assert careful is not None
    assert 0.1 * usual < careful < 0.5 * usual
    assert greatest_bandwidth(drives, 1.0, Wanted(modulus=1.5)) is None


def test_velocity_over_the_bus(machine: Machine) -> None:
    found = tune(machine, [], Asked(bandwidth_hz=80.0, velocity="bus"))
    assert [drive.k_pf_rad_mm for drive in found.drives] == [0.0, 0.0]
    assert [forward.velocity for forward in found.feedforward] == [1.0, 1.0]


def test_output_keeps_everything_else(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    shutil.copytree(EXAMPLES / "drives", tmp_path / "drives")
    machines = tmp_path / "machines"
    machines.mkdir()
    text = (
        (MACHINES / "paper_alpha.toml")
        .read_text()
        .replace("period_us = 1000 ", "period_us = 2000 ")
    )
    third = '\n[[axis]]\nname = "z"\nnode = 4\ntravel_mm = [0, 9]\n'
    third += "velocity_mm_s = 500\nacceleration_mm_s2 = 5000\njerk_mm_s3 = 200000\n"
    third += 'drive = "../drives/alpha_x.toml" # z\n'
    (machines / "given.toml").write_text(text + third)
    output = tmp_path / "tuned.toml"
    arguments = ("tune", str(machines / "given.toml"), "--bandwidth", "60", "-o", str(output))
    status, out, err = run(capsys, *arguments, "--json")
    assert status == 0, err
    written = [tmp_path / "tuned_x.toml", tmp_path / "tuned_y.toml", output]
    result = json.loads(out)
    assert result["files"] == [str(file) for file in written]
    before, after = tomllib.loads(text + third), tomllib.loads(output.read_text())
    for axis in after["axis"][:2]:
        assert axis.pop("feedforward")["torque_permille_s2_m"] > 100
    assert [axis.pop("drive") for axis in after["axis"]] == [
        "tuned_x.toml",
        "tuned_y.toml",
        "drives/alpha_x.toml",
    ]
    for axis in before["axis"]:
        del axis["drive"]
    assert after == before
    for line in (line for line in text.splitlines() if "#" in line):
        assert line in output.read_text()
    drive = tomllib.loads(written[0].read_text())
    given = tomllib.loads((tmp_path / "drives" / "alpha_x.toml").read_text())
    gains = drive.pop("pdff")
    assert gains.keys() == given.pop("pdff").keys()
    assert drive == given
    side: dict[str, Any] = result["axes"][0]["tuned"]
    assert gains == {name: side[name] for name in gains}
    assert len(load_machine(output).axes) == 3

    status, _, err = run(capsys, *arguments)
    assert status == 2
    assert "there already: name another --output, or add --force" in err
    written[1].write_text("other")
    assert run(capsys, *arguments, "--force")[0] == 0
    assert "other" not in written[1].read_text()


class _CrashError(Exception):
    """The process ends here."""


@pytest.mark.parametrize("after", [0, 1, 2, 3])
def test_a_crash_leaves_no_machine_file_without_its_drives(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, after: int
) -> None:
    """The command ends after so many files."""
    written: list[Path] = []
    plain = cli_output.write_file

    def write_file(file: Path, data: bytes) -> None:
        if len(written) == after:
            raise _CrashError
        written.append(file)
        plain(file, data)

    monkeypatch.setattr(cli_output, "write_file", write_file)
    file = tmp_path / "tuned.toml"
    arguments = ("--bandwidth", "60", "-o", str(file))
    with suppress(_CrashError):
        main(["tune", str(MACHINES / "paper_alpha.toml"), *arguments])
    assert len(written) == after
    assert file.exists() == (after == 3)
    if file.exists():
        assert len(load_machine(file).axes) == 2


def test_names_that_differ_by_signs_have_files_of_their_own(tmp_path: Path) -> None:
    """The second axis would get the gains of the first, or the first those of the second."""
    text = (MACHINES / "paper_alpha.toml").read_text()
    text = text.replace('name = "x"', 'name = "x+"').replace('name = "y"', 'name = "x*"')
    text = text.replace('path = ["x", "y"]', 'path = ["x+", "x*"]')
    text = text.replace('drive = "', f'drive = "{MACHINES}/')
    file = tmp_path / "given.toml"
    file.write_text(text)
    machine = load_machine(file)
    drives = {i: replace(a.drive, k_vf=0.5 + i) for i, a in enumerate(machine.axes) if a.drive}
    for path, words in rewritten(machine, drives, {}, tmp_path / "out.toml", "tune").items():
        path.write_text(words)
    found = [a.drive.k_vf for a in load_machine(tmp_path / "out.toml").axes if a.drive]
    assert found == [0.5, 1.5]


def test_nothing_is_written_when_one_file_is_there(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "tuned_y.toml").write_text("mine")
    arguments = ("--bandwidth", "60", "-o", str(tmp_path / "tuned.toml"))
    status, _, err = run(capsys, "tune", str(MACHINES / "paper_alpha.toml"), *arguments)
    assert status == 2
    assert "tuned_y.toml: there already" in err
    assert [file.name for file in tmp_path.iterdir()] == ["tuned_y.toml"]
    assert (tmp_path / "tuned_y.toml").read_text() == "mine"


def test_report_and_text(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = str(EXAMPLES / "alpha.toml")
    status, out, err = run(
        capsys,
        *("tune", str(MACHINES / "paper_alpha.toml"), "--bandwidth", "90", "--path", path),
        *("--interpolation", "cubic", "--report", str(tmp_path / "report")),
    )
    assert status == 0, err
    assert "k_pp" in out
    assert "as modelled" in out
    assert "21.353" in out
    files = {file.name for file in (tmp_path / "report").iterdir()}
    figures = {f"{kind}_{axis}.png" for kind in ("frequency", "step") for axis in "xy"}
    assert files == {"tune.html", "contour_alpha.png", *figures}
    html = (tmp_path / "report" / "tune.html").read_text()
    assert html.count("data:image/png;base64,") == 5
    assert "Coulomb friction" in html


@pytest.mark.parametrize(
    ("arguments", "status", "message"),
    [
        ((), 2, "--bandwidth HZ, or --path FILE"),
        (("--stiffness", "3"), 2, "--bandwidth HZ, or --path FILE"),
        (("--path", "alpha.toml", "--damping", "1"), 2, "--damping goes with --bandwidth"),
        (("--bandwidth", "0"), 2, '"0" is not a number above 0'),
        (("--bandwidth", "60", "--delay-us", "-1"), 2, "--delay-us"),
        (("--path", "alpha.toml", "--margin", "1.2"), 3, "no gains leave a modulus margin of 1.2"),
        (("--bandwidth", "60", "--velocity", "bus", "-o", "OUT"), 2, "at most 1 drive"),
    ],
)
def test_what_cannot_be(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    arguments: tuple[str, ...],
    status: int,
    message: str,
) -> None:
    monkeypatch.chdir(EXAMPLES)
    given = [word.replace("OUT", str(tmp_path / "out.toml")) for word in arguments]
    found, _, err = run(capsys, "tune", str(MACHINES / "paper_alpha.toml"), *given)
    assert found == status
    assert message in err
    assert len(err.splitlines()) == 1
    assert not list(tmp_path.iterdir())
