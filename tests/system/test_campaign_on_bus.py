# SPDX-License-Identifier: MIT
"""A fault in a run without a bus is the fault that a simulated drive has on the bus: the same tick, the same bits. Run
by pytest; starts a controller and drives on a local bus, and writes to temporary folders.
"""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import pytest

from hodograph.bus import processes
from hodograph.bus.hub import LocalHub
from hodograph.cli.main import main

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
RULES = "load at=200 for=60 node=2 volts=1.5\nsaturate at=400 for=40 node=3 volts=3.5\n"


def test_the_same_bits(
    hub: LocalHub,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    rules = tmp_path / "rules"
    rules.write_text(RULES)
    plain = processes.drive_command

    def faulty(*arguments: Any) -> list[str]:
        return [*plain(*arguments), "--faults", str(rules)]

    monkeypatch.setattr(processes, "drive_command", faulty)
    alpha = EXAMPLES / "alpha.toml"
    assert main(["run", str(alpha), "--json"]) == 0
    on_bus = json.loads(capsys.readouterr().out)

    file = tmp_path / "campaign.toml"
    listed = json.dumps(RULES.splitlines())
    file.write_text(f'paths = ["{alpha}"]\n[[faults]]\nname = "two"\nrules = {listed}\n')
    folder = tmp_path / "out"
    assert main(["campaign", str(file), "-o", str(folder), "--workers", "1"]) == 0
    with (folder / "runs.csv").open(encoding="utf-8", newline="") as source:
        (row,) = csv.DictReader(source)
    assert row["encoders_sha256"] == on_bus["encoders_sha256"]
    assert float(row["max_contour_error_um"]) == on_bus["max_contour_error_um"]
    assert not row["encoders_sha256"].startswith("81c8a7cb")  # as without the faults
