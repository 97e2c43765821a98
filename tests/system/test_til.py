# SPDX-License-Identifier: MIT
"""Target in the loop: the controller on an emulated board, on the bus, against the simulated drives."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import canopen
import pytest

from hodograph.cli.main import main

pytestmark = pytest.mark.bus

ROOT = Path(__file__).resolve().parents[2]
EMULATE = ROOT / "tools/emulate.py"
FILES = [str(ROOT / "examples" / f"{name}.toml") for name in ("alpha", "heart")]
HASHES = ("setpoints_sha256", "encoders_sha256")
FILTERS = [{"can_id": 0x581, "can_mask": 0x7FF}, {"can_id": 0x701, "can_mask": 0x7FF}]


def result(capsys: pytest.CaptureFixture[str], *arguments: str) -> Any:
    status = main(arguments)
    out, err = capsys.readouterr()
    assert status == 0, err
    return json.loads(out)


def test_the_m4f_runs_alpha_and_heart(capsys: pytest.CaptureFixture[str]) -> None:
    """`simulate` gives the hashes of `run` with the Linux controller (test_bus_run)."""
    board = ("--controller", f"{EMULATE} an386", "--pace", "fast", "--wait", "20")
    for run, file in zip(result(capsys, "run", *FILES, "--json", *board), FILES, strict=True):
        simulated = result(capsys, "simulate", file, "--json")
        assert [run[key] for key in HASHES] == [simulated[key] for key in HASHES]
        assert run["deadline_misses"] == 0


@pytest.mark.parametrize(
    ("target", "link"),
    [("an385", "fifo"), ("an500", "slcan"), ("an505", "fifo"), ("an505", "slcan")],
)
def test_the_other_boards_answer_and_end(target: str, link: str) -> None:
    words = [sys.executable, str(EMULATE), target, "--bus", "vcan0", "--node", "9", "--link", link]
    board = subprocess.Popen(words, stderr=subprocess.PIPE, text=True)
    filters = [{"can_id": each["can_id"] + 8, "can_mask": 0x7FF} for each in FILTERS]
    network = canopen.Network()
    network.connect(interface="socketcan", channel="vcan0", can_filters=filters)
    try:
        node: Any = network.add_node(9, str(ROOT / "firmware/app/controller.eds"))
        node.nmt.wait_for_heartbeat(timeout=20)
        node.sdo.RESPONSE_TIMEOUT = 5.0
        assert node.sdo[0x2002].raw == 0
        board.send_signal(signal.SIGTERM)
        assert board.wait(20) == 0, board.communicate()[1]
    finally:
        network.disconnect()
        board.kill()
        board.communicate()


def test_without_its_bridge_the_board_ends() -> None:
    words = [sys.executable, str(EMULATE), "an386", "--bus", "vcan0", "--node", "9", "--verbose"]
    board = subprocess.Popen(words, stderr=subprocess.PIPE, text=True)
    assert board.stderr is not None
    assert "this board is node 9" in board.stderr.readline()
    for bridge in _children("hodograph-bridge", board.pid):
        os.kill(bridge, signal.SIGKILL)
    _, words_of_it = board.communicate(timeout=20)
    assert board.returncode == 4
    assert "the bridge is gone" in words_of_it


def _children(name: str, parent: int) -> list[int]:
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            stat = (folder / "stat").read_text()
            command = (folder / "cmdline").read_bytes().split(b"\0")[0].decode()
        except OSError:
            continue
        if int(stat.rpartition(")")[2].split()[1]) == parent and command.endswith(name):
            found.append(int(folder.name))
    return found


def test_no_bus_is_said(tmp_path: Path) -> None:
    words = [sys.executable, str(EMULATE), "an386", "--bus", "vcan77"]
    done = subprocess.run(words, capture_output=True, text=True, timeout=30, check=False)
    assert done.returncode == 4
    assert "no interface vcan77" in done.stderr
