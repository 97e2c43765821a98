# SPDX-License-Identifier: MIT
"""A run that was recorded and is read again gives the figures of the live run, in every format."""

from __future__ import annotations

import json
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import pytest

from bench import EXAMPLES, MakeBench
from hodograph.bus.listening.frames import RECORD_DTYPE
from hodograph.bus.listening.recordings import read_recording, write_recording
from hodograph.cli.main import main

pytestmark = pytest.mark.bus

ALPHA = str(EXAMPLES / "alpha.toml")
MACHINE = str(EXAMPLES / "machines" / "paper_alpha.toml")
FRAME = struct.Struct("=IB3x8s")
NOT_RECORDED = {"bus", "deadline_misses", "pace"}


def result(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    capsys.readouterr()
    status = main(arguments)
    out, err = capsys.readouterr()
    assert status == 0, err
    found: dict[str, Any] = json.loads(out)
    return found


def failed(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str]:
    capsys.readouterr()
    status = main(arguments)
    err = capsys.readouterr().err
    assert "Traceback" not in err
    return status, err.splitlines()[-1]


def same(live: dict[str, Any], again: dict[str, Any]) -> None:
    assert set(live) == set(again)
    for key in set(live) - NOT_RECORDED:
        assert again[key] == live[key], key
    assert again["deadline_misses"] is None


def test_run_record_replay(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    log = tmp_path / "alpha.log"
    traces = [tmp_path / "live.csv", tmp_path / "again.csv"]
    live = result(capsys, "run", ALPHA, "--json", "--record", str(log), "--trace", str(traces[0]))
    again = result(capsys, "replay", str(log), ALPHA, "--json", "--trace", str(traces[1]))
    same(live, again)
    assert again["bus"] == str(log)
    assert again["pace"] == "real-time"
    assert live["frames"] == log.read_bytes().count(b"\n")
    assert traces[0].read_bytes() == traces[1].read_bytes()

    frames = read_recording(log)
    for suffix in (".asc", ".blf"):
        file = tmp_path / f"alpha{suffix}"
        write_recording(file, frames)
        same(live, result(capsys, "replay", str(file), ALPHA, "--json"))

    image = tmp_path / "alpha.hdgp"
    assert main(["compile", ALPHA, "-o", str(image)]) == 0
    same(live, result(capsys, "replay", str(log), str(image), "--machine", MACHINE, "--json"))
    status, line = failed(capsys, "replay", str(log), str(image))
    assert (status, "needs --machine" in line) == (2, True), line
    status, line = failed(capsys, "replay", str(log), str(EXAMPLES / "heart.toml"))
    assert (status, "recording: holds " in line) == (6, True), line
    status, line = failed(capsys, "replay", str(log), ALPHA, "--kernel", "float")
    assert (status, "is it this program and this kernel?" in line) == (6, True), line

    assert main(["replay", str(log), ALPHA, "--report", str(tmp_path / "report")]) == 0
    assert "bus load" in capsys.readouterr().out
    html = (tmp_path / "report" / "report.html").read_text()
    assert live["encoders_sha256"] in html

    short = tmp_path / "short.log"
    write_recording(short, frames[: frames.size // 2])
    status, line = failed(capsys, "replay", str(short), ALPHA)
    assert status == 6
    assert line.startswith(f"hodograph: {short}: ")
    write_recording(short, frames[:0])
    status, line = failed(capsys, "replay", str(short), ALPHA)
    assert (status, "0 SYNCs recorded" in line) == (6, True), line


def test_a_recording_from_beside(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """`hodograph record` hears all that happens: going to the start as well as the run."""
    file = tmp_path / "beside.blf"
    words = [sys.executable, "-m", "hodograph", "record", str(file), "--json"]
    words += ["--machine", MACHINE]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as child:
        until_there(file)
        heart = str(EXAMPLES / "heart.toml")
        live = result(capsys, "run", heart, "--json", "--pace", "fast")
        child.send_signal(signal.SIGINT)
        out, _ = child.communicate(timeout=120)
        assert child.returncode == 0
    told = json.loads(out)
    assert told["jumps"] == []
    frames = read_recording(file)
    assert frames.dtype == RECORD_DTYPE
    assert told["frames"] == frames.size > live["frames"]
    again = result(capsys, "replay", str(file), heart, "--json")
    for key in ("ticks", "setpoints_sha256", "encoders_sha256", "max_contour_error_um"):
        assert again[key] == live[key], key


def until_there(file: Path) -> None:
    """Waits for a recording to begin: its socket is opened right after its file."""
    deadline = time.monotonic() + 60
    while not file.exists():
        assert time.monotonic() < deadline
        time.sleep(0.05)
    time.sleep(0.5)


def motion(jump_at: int, recording: Path) -> None:
    """Two axes at 50 mm/s beyond SYNC 20; at `jump_at` the first one steps aside by 1 mm."""
    until_there(recording)
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as out:
        out.bind(("vcan0",))
        x, speed = 0, 0
        for k in range(1300):
            speed = min(50_000, speed + 4000) if k > 20 else 0
            x += speed + (1_000_000 if k == jump_at else 0)
            out.send(FRAME.pack(0x80, 1, bytes([k % 240 + 1])))
            for node, counts in ((2, x), (3, 0)):
                out.send(FRAME.pack(0x180 + node, 6, struct.pack("<Hi", 0x1237, counts)))
                out.send(FRAME.pack(0x200 + node, 6, struct.pack("<Hi", 0x0F, counts)))
            if k % 50 == 0:
                time.sleep(0.01)


@pytest.mark.parametrize("jump_at", [-1, 1100])
def test_a_jump_on_the_bus_is_told(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, jump_at: int
) -> None:
    def record(name: str, *more: str) -> tuple[int, dict[str, Any], str]:
        file = tmp_path / name
        sender = threading.Thread(target=motion, args=(jump_at, file))
        sender.start()
        capsys.readouterr()
        status = main(["record", str(file), "--seconds", "4", "--json", *more])
        out, err = capsys.readouterr()
        sender.join()
        return status, json.loads(out), err

    status, told, err = record("jump.log", "--machine", MACHINE)
    assert told["frames"] == 1300 * 5
    if jump_at < 0:
        assert (status, told["jumps"], err) == (0, [], "")
        return
    assert status == 6
    assert f"setpoint jump at SYNC {jump_at} of the recording, axis 1 and 2: speed" in err
    assert "the file is complete" in err.splitlines()[-1]
    assert len(told["jumps"]) == 2  # speed, acceleration
    assert read_recording(tmp_path / "jump.log").size == 1300 * 5
    status, told, err = record("unchecked.log")
    assert (status, told["jumps"]) == (0, None)
    assert "setpoints were not checked" in err


def test_without_a_machine_file_the_controller_is_asked(
    make_bench: MakeBench, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    make_bench("fast")
    words = [sys.executable, "-m", "hodograph", "goto", ALPHA, "--to", "3", "4"]
    with subprocess.Popen(words, stdout=subprocess.DEVNULL) as child:
        told = result(capsys, "record", str(tmp_path / "goto.log"), "--seconds", "4", "--json")
        assert child.wait() == 0
    assert told["jumps"] == []


def test_for_some_seconds(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    file = tmp_path / "silence.log"
    begun = time.monotonic()
    assert main(["record", str(file), "--seconds", "0.7"]) == 0
    assert time.monotonic() - begun >= 0.7
    assert "0 frames in 0." in capsys.readouterr().out
    assert file.read_bytes() == b""
    status, line = failed(capsys, "record", str(tmp_path / "bus.txt"))
    assert (status, "told by its name" in line) == (2, True), line
    status, line = failed(capsys, "record", str(file), "--bus", "socketcan:nocan7")
    assert (status, "no such network interface" in line) == (4, True), line
