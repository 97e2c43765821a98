# SPDX-License-Identifier: MIT
"""A recorded run: its load lies between the model's bounds, and cantools reads its frames with our DBC."""

from __future__ import annotations

import json
from pathlib import Path

import cantools
import pytest

from hodograph.bus.address import parse_address
from hodograph.bus.listening.recorder import Recorder
from hodograph.cli.main import main
from hodograph.config import load_machine
from hodograph.dbc import dbc_text

pytestmark = pytest.mark.bus

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def test_load_and_dbc_of_a_run(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    machine = load_machine(EXAMPLES / "machines" / "paper_alpha.toml")
    database = cantools.database.load_string(dbc_text(machine), "dbc", strict=True)
    report = tmp_path / "report"
    with Recorder(parse_address("socketcan:vcan0")) as recorder:
        file = str(EXAMPLES / "alpha.toml")
        status = main(["run", file, "--pace", "fast", "--json", "--report", str(report)])
    out, err = capsys.readouterr()
    assert status == 0, err
    load = json.loads(out)["bus_load"]
    assert load["model_least_percent"] <= load["measured_percent"] <= load["model_worst_percent"]
    assert 50 < load["measured_percent"] < 65
    assert "Bus load" in (report / "report.html").read_text()

    frames = recorder.frames()
    targets = []
    for frame in frames[(frames["id"] < 0x580) | (frames["id"] >= 0x700)]:
        data = bytes(frame["data"][: frame["length"]])
        decoded = database.decode_message(int(frame["id"]), data)
        if frame["id"] == 0x202:
            targets.append(float(decoded["Drive2_TargetPosition"]))
    assert targets[0] == 0
    assert max(targets) == pytest.approx(66.0, abs=40)
