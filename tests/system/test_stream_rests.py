# SPDX-License-Identifier: MIT
"""Sections as one job on a bus: program stops, the recording, and `run` that streams what does not fit. Run by pytest;
starts a controller and drives on a local bus, and writes to temporary folders.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from bench import EXAMPLES
from commands import result
from hodograph.bus.capture.decode import RPDO1, SYNC_ID
from hodograph.bus.capture.recordings import read_recording
from hodograph.bus.capture.setpoint_check import find_jumps, step_limits
from hodograph.bus.hub import LocalHub
from hodograph.bus.sdo.controller import connect
from hodograph.bus.sdo.node import Node
from hodograph.bus.sdo.objects import HELD, QUICK_STOP, RESUME, RUNNING, STATE, STOP
from hodograph.bus.sdo.stream_channel import PROGRAM_STOP, STOPPED, stream_status
from hodograph.cli import stream_command
from hodograph.cli.main import main
from hodograph.config import load_machine
from hodograph.job_run import BusCheck
from hodograph.stream import sender

MILL = EXAMPLES / "machines" / "mill.toml"
ENABLE_OPERATION = 0x0F
"""Low byte of the controlword of a drive in operation."""

PART = "F6000\nG61\nG1 X4\nG4 P0.1\nM0\nG1 Y3\nM1\nG1 X0 Y0\nM2\n"


def _part(folder: Path, text: str = PART) -> str:
    file = folder / "part.ngc"
    file.write_text(text)
    return str(file)


def _streamed(file: str, folder: Path, machine: Path = MILL) -> tuple[str, ...]:
    """The words of a command that streams a file, with a journal in the folder."""
    journal = str(folder / "stream.json")
    return ("stream", file, "--machine", str(machine), "--journal", journal)


def test_program_stops_wait_for_the_operator_or_a_resume(
    hub: LocalHub,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The first one ends by Enter, the second one by a resume from elsewhere; all in one job of the controller."""
    asked: list[str] = []

    def operator(text: str, check: BusCheck) -> None:
        asked.append(text)
        with connect(hub.address, 1, 1_000_000) as controller:
            for _ in range(3):
                check()
            assert controller.state() == HELD
            assert stream_status(controller).state == PROGRAM_STOP
            if len(asked) == 2:
                controller.command(RESUME)
        for _ in range(100):
            if len(asked) == 2:
                check()

    monkeypatch.setattr(stream_command, "await_enter", operator)
    part, log = _part(tmp_path), tmp_path / "bus.log"
    found = result(capsys, *_streamed(part, tmp_path), "--json", "--record", str(log))
    assert [text.removeprefix(part) for text in asked] == [":5: M0", ":7: M1"]
    assert (found["sections"], found["chunks"]) == (3, 3)
    frames = read_recording(log, None)
    assert (frames["id"] == SYNC_ID).sum() > 1000 * found["motion_s"]
    x = frames["data"][frames["id"] == RPDO1 + 2][:, 2:6].copy().view("<i4")[:, 0]
    assert x.max() == 4_000_000
    assert (x == 4_000_000).sum() > 100  # the dwell
    assert abs(x[-1]) < 1000


def test_notes_come_before_the_motion(
    hub: LocalHub,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The operator at a tool change has to know that the machine does not change the tool."""
    known: list[str] = []

    def operator(text: str, check: BusCheck) -> None:
        del text
        known.append(capsys.readouterr().err)
        check()

    monkeypatch.setattr(stream_command, "await_enter", operator)
    part = _part(tmp_path, "F6000\nG1 X4\nM6 T2\nG1 Y3\nM2\n")
    assert main(_streamed(part, tmp_path)) == 0
    note = f"{part}:3: tool change (M6): done by hand"
    assert note in known[0]
    assert note not in capsys.readouterr().err


@pytest.mark.parametrize("command", [STOP, QUICK_STOP])
def test_a_stop_just_before_a_chunk_ends_the_job(
    hub: LocalHub,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    command: int,
) -> None:
    """The controller refuses the chunk. The user has to hear of the stop, not of the chunk."""
    sent, waited = sender.send_chunk, []

    def stopped(node: Node, data: bytes, job: int, sequence: int, place: str) -> bool:
        if not waited and node.read(STATE, None) == RUNNING:
            with connect(hub.address, 1, 1_000_000) as other:
                other.command(command)
                for _ in range(100):
                    waited.append(stream_status(node).state)
                    if waited[-1] == STOPPED:
                        break
                    node.clock.sleep(0.05)
        return sent(node, data, job, sequence, place)

    monkeypatch.setattr(sender, "send_chunk", stopped)
    moves = "".join(f"G1 X{10 * k} Y{k % 2}\n" for k in range(1, 6))
    part = _part(tmp_path, f"F120\n{moves}M2\n")
    assert main(_streamed(part, tmp_path)) == 6
    assert waited[-1] == STOPPED
    err = capsys.readouterr().err
    assert "stopped before its end: the job ends here; hodograph stream --continue goes on" in err
    assert "refused" not in err


def test_run_streams_what_no_bank_can_hold(
    hub: LocalHub, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = MILL.read_text().replace("../drives", f"{EXAMPLES}/drives")
    assert "[controller]" in text
    machine = tmp_path / "small.toml"
    machine.write_text(text.replace("[controller]", "[controller]\nprogram_bytes = 4000", 1))
    words = ("run", _part(tmp_path), "--machine", str(machine), "--no-stops", "--json")
    assert main([*words, "--trace", str(tmp_path / "trace.csv")]) != 0
    assert "hodograph stream takes jobs of any length" in capsys.readouterr().err
    found = result(capsys, *words)
    assert (found["sections"], found["chunks"]) == (3, 3)
    assert found["underruns"] == 0


def test_axes_that_turn_alone_are_jobs_between_the_others(
    hub: LocalHub, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """On five axes: the setpoints on the bus end each job where it ends, and no step is above the limits."""
    file, log = tmp_path / "turned.ngc", tmp_path / "bus.log"
    file.write_text("G21 G90 G61 F6000\nG0 A6 C20\nG1 X6 C23\nG4 P0.1\nG1 A3\nM2\n")
    machine = EXAMPLES / "machines" / "mill_five_axes.toml"
    words = _streamed(str(file), tmp_path, machine)
    found = result(capsys, *words, "--json", "--record", str(log))
    assert (found["sections"], found["underruns"]) == (3, 0)
    frames = read_recording(log, None)
    assert _last_setpoints(frames, range(2, 7)) == [6_000_000, 0, 0, 300_000, 2_300_000]


def test_a_list_of_paths_turns_axes_alone_between_the_others(
    hub: LocalHub, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """`run` streams it: each path begins where the one before ends, so that no axis is moved between them."""
    facets, log = EXAMPLES / "facets.toml", tmp_path / "bus.log"
    found = result(capsys, "run", str(facets), "--record", str(log), "--json")
    assert (found["sections"], found["chunks"], found["underruns"]) == (3, 3, 0)
    machine = load_machine(EXAMPLES / "machines" / "mill_five_axes.toml")
    frames = read_recording(log, None)
    assert not find_jumps(frames, machine.nodes, step_limits(machine))
    ends = [-20_000_000, 30_000_000, 2_000_000, 1_200_000, 12_000_000]
    assert _last_setpoints(frames, machine.nodes) == ends


def _last_setpoints(frames: NDArray[np.void], nodes: Iterable[int]) -> list[int]:
    """The last target of each drive in operation, counts. Targets after it are actual positions."""
    ends = []
    for node in nodes:
        data = frames["data"][frames["id"] == RPDO1 + node]
        enabled = data[data[:, 0] == ENABLE_OPERATION]
        ends.append(int(enabled[-1, 2:6].copy().view("<i4")[0]))
    return ends
