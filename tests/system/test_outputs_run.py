# SPDX-License-Identifier: MIT
"""Outputs on a bus: they reach the I/O module with the same setpoint as in the simulation, and a replay gives them too.
Run by pytest; starts a controller and drives on a local bus, and writes to temporary folders.
"""

import json
from pathlib import Path

import pytest

from bench import EXAMPLES
from hodograph.bus.hub import LocalHub
from hodograph.cli.main import main
from hodograph.pipeline import load_pipeline
from hodograph.simulate import simulate_on, write_trace

PATH = """
[path]
closed = false
through = [[0, 0], [8, 1], [14, 5]]

[feed]
nominal_mm_s = 50
ramp_time_s = 0.1
n_c = 5

[machine]
file = "{machine}"
"""
OUTPUTS = (
    ("needle", "at_mm = 0.0", "on = true"),
    ("power", "at_mm = 3.0", "per_mm_s = 0.5"),
    ("valve", "at_point = 1", "on = true"),
    ("power", "at_mm = 12.0", "value = -20"),
    ("valve", "at_fraction = 1.0", "on = false"),
)


@pytest.mark.parametrize("delay_ticks", [1, 3])
def test_a_run_on_the_bus_switches_as_simulated(
    hub: LocalHub, tmp_path: Path, capsys: pytest.CaptureFixture[str], delay_ticks: int
) -> None:
    machine = tmp_path / "machine.toml"
    text = (EXAMPLES / "machines" / "dispenser.toml").read_text()
    text = text.replace("../drives", str(EXAMPLES / "drives"))
    machine.write_text(text.replace("delay_ticks = 1", f"delay_ticks = {delay_ticks}"))
    file = tmp_path / "path.toml"
    tables = (f'[[output]]\nname = "{name}"\n{at}\n{what}\n' for name, at, what in OUTPUTS)
    file.write_text(PATH.format(machine=machine) + "\n".join(tables))
    recording, trace = tmp_path / "run.log", tmp_path / "run.csv"
    arguments = ["run", str(file), "--json", "--record", str(recording), "--trace", str(trace)]
    assert main(arguments) == 0
    found = json.loads(capsys.readouterr().out)
    pipeline = load_pipeline(file)
    simulated = simulate_on(pipeline.machine, pipeline.image)
    assert found["outputs"] == simulated.summary()["outputs"]
    assert [one["name"] for one in found["outputs"]] == [name for name, *_ in OUTPUTS]
    assert found["bus_load"]["kinds"]["outputs"]["frames"] > 10
    own = tmp_path / "own.csv"
    write_trace(simulated, own)
    late = delay_ticks - 1
    wanted, measured = own.read_text().splitlines(), trace.read_text().splitlines()
    assert measured[0] == wanted[0]
    columns = slice(-4, None)
    shifted = [line.split(",")[columns] for line in wanted[1 : len(wanted) - late]]
    assert [line.split(",")[columns] for line in measured[1 + late :]] == shifted
    assert main(["replay", str(recording), str(file), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["outputs"] == found["outputs"]
