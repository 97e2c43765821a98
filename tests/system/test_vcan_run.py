# SPDX-License-Identifier: MIT
"""Commands on SocketCAN, in real time: the same bits at both paces, the load by the kernel's time stamps, Ctrl-C.

What they do in all other respects is tested in virtual time: test_bus_run.py, test_bus_commands.py, test_status.py. Run
by pytest on vcan0; starts a controller, drives and `hodograph`, and writes to temporary folders.
"""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from bench import EXAMPLES, PAPER_ALPHA, VCAN0, MakeAlpha, MakeBench, patient_machine
from commands import result
from hodograph.bus.sdo.controller import OFF, RUNNING, connect
from hodograph.bustime import machine_bus_time
from hodograph.config import load_machine
from marks import long
from runs import same_motion

pytestmark = pytest.mark.bus

ALPHA = str(EXAMPLES / "alpha.toml")
LIMIT_S = 120.0
"""Of real time: no test is judged by it, one that hangs ends by it."""


@pytest.mark.parametrize("pace", ["real-time", "fast"])
def test_run_equals_simulate(capsys: pytest.CaptureFixture[str], tmp_path: Path, pace: str) -> None:
    traces = [tmp_path / "simulated.csv", tmp_path / "recorded.csv"]
    job = (ALPHA, "--json", "--machine", str(patient_machine(PAPER_ALPHA, tmp_path)))
    simulated = result(capsys, "simulate", *job, "--trace", str(traces[0]))
    recorded = result(capsys, "run", *job, "--trace", str(traces[1]), "--pace", pace)
    assert same_motion(recorded, simulated)
    assert (recorded["bus"], recorded["pace"]) == ("socketcan:vcan0", pace)
    assert traces[0].read_text() == traces[1].read_text()


def test_the_load_is_what_the_model_says(
    make_bench: MakeBench, capsys: pytest.CaptureFixture[str]
) -> None:
    """Frames of the ticks, per SYNC: so it holds however slow the host ticks."""
    model = machine_bus_time(load_machine(PAPER_ALPHA))
    controller = make_bench("real-time").controller
    assert controller.wait_for((OFF,), LIMIT_S) == OFF
    classes = result(capsys, "status", "--json", "--machine", str(PAPER_ALPHA))["bus_load"][
        "classes"
    ]
    nominal = model.period_us / 1e6 * classes["SYNC"]["frames_per_s"]
    for name, kind in (("SYNC", "SYNC"), ("RPDO1", "setpoints"), ("TPDO1", "positions")):
        least, most = model.load_of(kind)
        assert 0.95 * least <= classes[name]["percent"] / nominal <= 1.05 * most, name


@pytest.mark.parametrize(("number", "status"), [long(signal.SIGINT, 130), (signal.SIGKILL, -9)])
def test_nothing_is_left_running(alpha_at: MakeAlpha, number: signal.Signals, status: int) -> None:
    command = [sys.executable, "-m", "hodograph", "run", str(alpha_at(2))]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as child:
        try:
            with connect(VCAN0, 1, 1_000_000) as controller:
                controller.require(LIMIT_S)
                controller.wait_for((RUNNING,), LIMIT_S)
                child.send_signal(number)
                _, err = child.communicate(timeout=LIMIT_S)
                assert child.returncode == status, err
                while controller.answers(0.5):  # on its way: it stops the axes first
                    pass
        finally:
            child.kill()
