# SPDX-License-Identifier: MIT
"""Feedforward on a bus: remapped PDOs, offsets, and still the same bits as without a bus. Run by pytest; starts a
controller and drives on a local bus, and writes to temporary folders.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from commands import result
from runs import same_motion

pytestmark = pytest.mark.usefixtures("hub")

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def alpha(folder: Path, gains: dict[str, str], equipment: str = "") -> str:
    """The alpha on a machine with these tables of feedforward; two frames more a tick want 2 ms."""
    folder.mkdir()
    machine = (EXAMPLES / "machines" / "paper_alpha.toml").read_text()
    machine = machine.replace("period_us = 1000", "period_us = 2000")
    for axis in ("x", "y"):
        drive = f'drive = "../drives/alpha_{axis}.toml"'
        model = f'drive = "alpha_{axis}.toml"\n'
        text = (EXAMPLES / "drives" / f"alpha_{axis}.toml").read_text()
        (folder / f"alpha_{axis}.toml").write_text(f"{text}\n[equipment]\n{equipment}\n")
        machine = machine.replace(drive, model + gains.get(axis, ""))
    (folder / "machine.toml").write_text(machine)
    path = (EXAMPLES / "alpha.toml").read_text()
    file = folder / "alpha.toml"
    file.write_text(path.replace("machines/paper_alpha.toml", "machine.toml"))
    return str(file)


def test_the_same_bits_as_without_a_bus(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    gains = {
        "x": "feedforward = { velocity = 0.1, torque_permille_s2_m = 400, torque_permille_s_m = 50 }",
        "y": "feedforward = { velocity = 0.05, torque_permille_s2_m = 300 }",
    }
    file = alpha(tmp_path / "forward", gains)
    simulated = result(capsys, "simulate", file, "--json")
    recorded = result(capsys, "run", file, "--json")
    assert same_motion(recorded, simulated)
    plain = result(capsys, "simulate", alpha(tmp_path / "plain", {}), "--json")
    assert plain["setpoints_sha256"] == simulated["setpoints_sha256"]
    assert plain["encoders_sha256"] != simulated["encoders_sha256"]


def test_friction_and_rating_too(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    gains = {"x": "feedforward = { torque_permille_s_m = 500 }"}
    file = alpha(tmp_path / "equipped", gains, "friction_volts = 0.2\nrated_torque_nm = 2")
    simulated = result(capsys, "simulate", file, "--json")
    recorded = result(capsys, "run", file, "--json")
    assert same_motion(recorded, simulated)
    for other in ("friction_volts = 0.2", "rated_torque_nm = 2"):
        less = result(capsys, "simulate", alpha(tmp_path / other[:8], gains, other), "--json")
        assert less["encoders_sha256"] != simulated["encoders_sha256"]


def test_the_tuned_machine_on_the_bus(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """Cubics and torque offsets give the same bits too, and the plant comes out of the recording."""
    machine = str(EXAMPLES / "machines" / "tuned.toml")
    given = (str(EXAMPLES / "alpha.toml"), "--machine", machine)
    file = tmp_path / "run.log"
    simulated = result(capsys, "simulate", *given, "--json")
    recorded = result(capsys, "run", *given, "--json", "--record", str(file))
    assert same_motion(recorded, simulated)
    assert 0.002 < simulated["max_contour_error_um"] < 0.05
    axes = result(capsys, "identify", str(file), "--machine", machine, "--json")["axes"]
    for axis, gain, time_s in zip(axes, (83.0089, 50.4977), (0.19936, 0.15641), strict=True):
        assert axis["gain_rad_s_v"]["value"] == pytest.approx(gain, rel=0.01)
        assert axis["time_constant_s"]["value"] == pytest.approx(time_s, rel=0.01)
