# SPDX-License-Identifier: MIT
"""A recorded run: its load lies between the model's bounds, and cantools reads its frames with our DBC. Run by pytest;
starts a controller and drives on a local bus, and writes to temporary folders.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import cantools
import pytest

from hodograph.bus.capture.recorder import Recorder
from hodograph.bus.hub import LocalHub
from hodograph.cli.main import main
from hodograph.config import load_machine
from hodograph.dbc import dbc_text
from hodograph.native import NativeProgram
from hodograph.pipeline import load_pipeline

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def test_load_and_dbc_of_a_run(hub: LocalHub, capsys: pytest.CaptureFixture[str]) -> None:
    machine = load_machine(EXAMPLES / "machines" / "paper_alpha.toml")
    database: Any = cantools.database.load_string(dbc_text(machine), "dbc", strict=True)
    file = EXAMPLES / "alpha.toml"
    with Recorder(hub.address) as recorder:
        status = main(["run", str(file), "--json"])
    out, err = capsys.readouterr()
    assert status == 0, err
    load = json.loads(out)["bus_load"]
    assert load["model_least_percent"] <= load["measured_percent"] <= load["model_worst_percent"]
    # docs/reference/bus-time.md section 3
    assert load["measured_percent"] == pytest.approx(59.8, abs=0.1)

    frames = recorder.frames()
    targets = []
    for frame in frames[(frames["id"] < 0x580) | (frames["id"] >= 0x700)]:
        data = bytes(frame["data"][: frame["length"]])
        decoded = database.decode_message(int(frame["id"]), data)
        if frame["id"] == 0x202:
            targets.append(float(decoded["Drive2_TargetPosition"]))
    assert targets[0] == 0
    program = NativeProgram(load_pipeline(file).image)
    _, setpoints = program.setpoints("fixed", machine.counts_per_mm)
    assert (min(targets), max(targets)) == pytest.approx(
        (setpoints[:, 0].min() / 1e6, setpoints[:, 0].max() / 1e6)
    )
