# SPDX-License-Identifier: MIT
"""Some scenarios of `make faults`, one seed each: what is injected is detected or survived, without a violation. Run by
pytest; starts controllers, drives and injectors on local buses, and writes to temporary folders.
"""

from __future__ import annotations

import json

import pytest

from hodograph.cli.main import main
from hodograph.data import EXAMPLES
from hodograph.faults.case_runner import run_campaign
from hodograph.faults.scenario import find_scenarios
from marks import long

pytestmark = pytest.mark.usefixtures("one_core")

SOME = [
    "bus-off",
    "bus-off-tick",
    "controller-heartbeat-lost",
    "cut-upload",
    "drive-fault",
    "drive-restarts",
    "drive-stops",
    "encoder-jumps",
    "five-axes-following-error",
    "flood",
    "kill-controller",
    "kill-drives",
    "kill-host",
    "kill-one-drive",
    "limit-switch",
    "module-heartbeat-lost",
    "optimal-following-error",
    "optimal-following-error-early",
    "optimal-heartbeat-lost",
    "rpdo1-corrupt-target",
    "rpdo1-lost",
    long("space-drive-fault"),
    "sync-lost",
    "tpdo1-late",
    "tpdo1-lost",
    "tpdo1-lost-once",
]


@pytest.mark.parametrize("name", SOME)
def test_no_violation(name: str) -> None:
    scenarios = find_scenarios(EXAMPLES / "faults", [name])
    (verdict,) = run_campaign(scenarios, [0], None)
    assert verdict.injected > 0, verdict.summary()
    assert verdict.violations == (), verdict.summary()


def test_the_command_fails_where_there_are_violations(
    capsys: pytest.CaptureFixture[str], tmp_path_factory: pytest.TempPathFactory
) -> None:
    """A scenario that expects a fault where none can be."""
    folder = tmp_path_factory.mktemp("scenarios")
    path = EXAMPLES / "faults" / "path.toml"
    (folder / "wrong.toml").write_text(
        f'text = "volts get lost"\npath = "{path}"\nrules = ["drop at=50 id=0x282"]\n'
        "[expect]\ncodes = [0x8250]\n"
    )
    assert main(["faults", str(folder / "wrong.toml"), "--seeds", "1", "--json"]) == 6
    out, err = capsys.readouterr()
    result = json.loads(out)
    assert result["violations"] == 1
    assert result["cases"][0]["violations"] == ["no fault was raised"]
    assert "1 violations in 1 cases" in err
