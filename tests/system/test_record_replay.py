# SPDX-License-Identifier: MIT
"""A run that was recorded and is read again gives the figures of the live run, in every format. Run by pytest; starts a
controller, drives and `hodograph` on a local bus, and writes to temporary folders.
"""

from __future__ import annotations

import json
import signal
import struct
from pathlib import Path
from typing import Any

import pytest

from bench import EXAMPLES, MakeBench
from commands import result, running
from hodograph.bus.capture.frames import RECORD_DTYPE
from hodograph.bus.capture.recordings import read_recording, write_recording
from hodograph.bus.clock import VirtualClock
from hodograph.bus.hub import LocalHub
from hodograph.bus.local_bus import LocalBus
from hodograph.cli.main import main

ALPHA = str(EXAMPLES / "alpha.toml")
MACHINE = str(EXAMPLES / "machines" / "paper_alpha.toml")
FRAME = struct.Struct("=IB3x8s")
NOT_RECORDED = {"bus", "deadline_misses", "pace"}
PERIOD_S = 0.001


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


def test_run_record_replay(
    hub: LocalHub, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    log = tmp_path / "alpha.log"
    traces = [tmp_path / "live.csv", tmp_path / "again.csv"]
    live = result(capsys, "run", ALPHA, "--json", "--record", str(log), "--trace", str(traces[0]))
    again = result(capsys, "replay", str(log), ALPHA, "--json", "--trace", str(traces[1]))
    same(live, again)
    print("LIVE", live)
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


def test_a_recording_from_beside(
    hub: LocalHub, clock: VirtualClock, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """`hodograph record` receives all that happens: going to the start as well as the run."""
    file = tmp_path / "beside.blf"
    heart = str(EXAMPLES / "heart.toml")
    with running(clock, "record", str(file), "--json", "--machine", MACHINE) as command:
        live = result(capsys, "run", heart, "--json")
        command.signal(signal.SIGINT)
        assert command.wait() == 0
        out = command.out
    reported = json.loads(out)
    assert reported["jumps"] == []
    frames = read_recording(file)
    assert frames.dtype == RECORD_DTYPE
    assert reported["frames"] == frames.size > live["frames"]
    again = result(capsys, "replay", str(file), heart, "--json")
    for key in ("ticks", "setpoints_sha256", "encoders_sha256", "max_contour_error_um"):
        assert again[key] == live[key], key


def motion(hub: LocalHub, clock: VirtualClock, jump_at: int) -> None:
    """The first of two axes at 40 mm/s beyond SYNC 60, within its limits; at `jump_at` it steps aside by 1 mm."""
    with LocalBus(hub.address.channel) as out:
        x, speed = 0, 0
        for k in range(1300):
            speed += 100 * max(0, 20 - abs(k - 40))
            x += speed + (1_000_000 if k == jump_at else 0)
            out.send_raw(FRAME.pack(0x80, 1, bytes([k % 240 + 1])))
            for node, counts in ((2, x), (3, 0)):
                out.send_raw(FRAME.pack(0x180 + node, 6, struct.pack("<Hi", 0x1237, counts)))
                out.send_raw(FRAME.pack(0x200 + node, 6, struct.pack("<Hi", 0x0F, counts)))
            clock.sleep(PERIOD_S)


@pytest.mark.parametrize("jump_at", [-1, 100, 500, 1100, 1299])
def test_a_jump_on_the_bus_is_reported(
    hub: LocalHub, clock: VirtualClock, tmp_path: Path, jump_at: int
) -> None:
    def record(name: str, *more: str) -> tuple[int, dict[str, Any], str]:
        words = ("record", str(tmp_path / name), "--seconds", "1.5", "--json", *more)
        with running(clock, *words) as command:
            motion(hub, clock, jump_at)
            status = command.wait()
            return status, json.loads(command.out), command.err

    status, reported, err = record("jump.log", "--machine", MACHINE)
    assert reported["frames"] == 1300 * 5
    assert reported["seconds"] == pytest.approx(1.5, abs=1e-6)
    if jump_at < 0:
        assert (status, reported["jumps"], err) == (0, [], "")
        return
    assert status == 6
    assert f"setpoint jump at SYNC {jump_at} of the recording, axis 1 and 2: speed" in err
    assert "the file is complete" in err.splitlines()[-1]
    assert (
        len(reported["jumps"]) == 5
    )  # speed, acceleration; speed, acceleration, jerk of the first axis
    assert read_recording(tmp_path / "jump.log").size == 1300 * 5
    status, reported, err = record("unchecked.log")
    assert (status, reported["jumps"]) == (0, None)
    assert "setpoints were not checked" in err


def test_without_a_machine_file_the_controller_is_asked(
    make_bench: MakeBench,
    clock: VirtualClock,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
) -> None:
    make_bench()
    with running(clock, "goto", ALPHA, "--to", "3", "4") as command:
        reported = result(capsys, "record", str(tmp_path / "goto.log"), "--seconds", "4", "--json")
        assert command.wait() == 0
    assert reported["jumps"] == []
    assert reported["frames"] > 4000


def test_for_some_seconds(
    hub: LocalHub, clock: VirtualClock, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    file = tmp_path / "silence.log"
    begun_ns = clock.stamp_ns()
    assert main(["record", str(file), "--seconds", "0.7"]) == 0
    assert clock.stamp_ns() - begun_ns == pytest.approx(700_000_000, abs=300)
    assert capsys.readouterr().out == f"{file}: 0 frames in 0.7 s\n"
    assert file.read_bytes() == b""
    status, line = failed(capsys, "record", str(tmp_path / "bus.txt"))
    assert (status, "the end of its name gives the format" in line) == (2, True), line
    status, line = failed(capsys, "record", str(file), "--bus", f"local:{tmp_path / 'none'}")
    assert (status, "no hub serves it" in line) == (4, True), line


def test_two_runs_give_the_same_recording(one_core: None, tmp_path: Path) -> None:
    """Byte by byte: frames, their order and their times."""
    logs = [tmp_path / "first.log", tmp_path / "second.log"]
    for log in logs:
        with LocalHub() as hub:
            assert main(["run", ALPHA, "--record", str(log), "--bus", str(hub.address)]) == 0
    assert logs[0].stat().st_size > 100_000
    assert logs[0].read_bytes() == logs[1].read_bytes()
