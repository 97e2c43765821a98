# SPDX-License-Identifier: MIT
"""A recording made of a simulated run, read again: hashes and figures are those of the simulation. Run by pytest;
writes to temporary folders.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from hodograph.bus.analysis import complete_ticks, program_tick, replay, runs_of
from hodograph.bus.capture.frames import RECORD_DTYPE, Frames
from hodograph.bus.capture.recordings import read_recording, write_recording
from hodograph.cli.main import main
from hodograph.errors import RunError
from hodograph.pipeline import Pipeline, load_pipeline
from hodograph.simulate import Motion, simulate

ROOT = Path(__file__).resolve().parents[3]
ALPHA = ROOT / "examples" / "alpha.toml"
NODES = (2, 3)
STANDING = 300
PERIOD_US = 1000
START_US = 1_795_267_433_123_457
ENABLED = 0x0F, 0x1637

Counts = NDArray[np.int64]


@pytest.fixture(scope="module")
def pipeline() -> Pipeline:
    return load_pipeline(ALPHA)


@pytest.fixture(scope="module")
def motion(pipeline: Pipeline) -> Motion:
    machine = pipeline.machine
    return simulate(
        pipeline.image,
        [axis.drive for axis in machine.axes],
        kernel=machine.kernel,
        counts_per_mm=machine.counts_per_mm,
    )


def run_of(motion: Motion) -> tuple[Counts, Counts, Counts]:
    """Targets, positions, volts of standing, the run, standing; positions two SYNCs after their setpoints."""
    rows = motion.rows
    targets = padded(rows["set_counts"][:, :2], STANDING, STANDING)
    actual = padded(rows["act_counts"][:, :2], STANDING + 2, STANDING - 2)
    volts = padded(rows["volts_mv"][:, :2], STANDING + 2, STANDING - 2)
    return targets, actual, volts


def padded(values: NDArray[np.int32], before: int, after: int) -> Counts:
    first, last = values[:1].astype(np.int64), values[-1:].astype(np.int64)
    return np.concatenate([np.repeat(first, before, 0), values, np.repeat(last, after, 0)])


def frame(identifier: int, data: bytes) -> Frames:
    made = np.zeros(1, dtype=RECORD_DTYPE)
    made["id"], made["length"] = identifier, len(data)
    made["data"][0, : len(data)] = list(data)
    return made


def recorded(targets: Counts, actual: Counts, volts: Counts, first_sync: int = 0) -> Frames:
    """Frames as the bus carries them, a period's evenly spread over it."""
    control, status = ENABLED
    parts = []
    for j in range(len(targets)):
        parts.append(frame(0x080, bytes([(first_sync + j) % 240 + 1])))
        for axis, node in enumerate(NODES):
            words = [(0x200 + node, control, targets), (0x180 + node, status, actual)]
            for identifier, word, values in words:
                position = int(values[j, axis]).to_bytes(4, "little", signed=True)
                parts.append(frame(identifier, word.to_bytes(2, "little") + position))
            mv = int(volts[j, axis]).to_bytes(2, "little", signed=True)
            parts.append(frame(0x280 + node, mv))
    frames = np.concatenate(parts)
    frames["time_us"] = (
        START_US + (first_sync * PERIOD_US) + np.arange(frames.size) * PERIOD_US // 7
    )
    return frames


@pytest.fixture(scope="module")
def frames(motion: Motion) -> Frames:
    return recorded(*run_of(motion))


@pytest.mark.parametrize("suffix", [".log", ".asc", ".blf"])
def test_the_figures_of_the_simulation(
    frames: Frames,
    pipeline: Pipeline,
    motion: Motion,
    tmp_path: Path,
    suffix: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    file = tmp_path / f"alpha{suffix}"
    write_recording(file, frames)
    found = replay(read_recording(file), file.name, pipeline.image, pipeline.machine, "fixed")
    assert found.motion.summary() == motion.summary()
    assert found.pace == "real-time"
    assert found.frames == frames.size
    assert found.wall_s == pytest.approx(motion.ticks * PERIOD_US / 1e6, rel=1e-3)
    assert main(["replay", str(file), str(ALPHA), "--json"]) == 0
    reported = json.loads(capsys.readouterr().out)
    assert reported | motion.summary() == reported
    assert reported["deadline_misses"] is None
    assert reported["bus_load"]["kinds"]["SYNC"]["frames"] == len(motion.rows) + 2 * STANDING - 1


def test_a_run_among_other_things(frames: Frames, pipeline: Pipeline, motion: Motion) -> None:
    """Booting (SYNCs alone), a move to the start, the run; then a second run that was stopped half-way."""
    booting = np.concatenate([frame(0x080, bytes([j % 240 + 1])) for j in range(500)])
    start = motion.rows["set_counts"][:, :2][0].astype(np.int64)
    way = start + np.arange(400, -1, -1)[:, None] * [30, 20]
    there = recorded(way, way, np.zeros_like(way), 500)
    run = recorded(*run_of(motion), 500 + len(way))
    half = [part[: len(motion.rows) // 2] for part in run_of(motion)]
    again = recorded(*half, 500 + len(way) + len(motion.rows) + 2 * STANDING)
    whole = np.concatenate([booting, there, run, again])
    found = replay(whole, "beside", pipeline.image, pipeline.machine, "fixed")
    assert found.motion.summary() == motion.summary()
    assert found.frames == whole.size


def test_what_is_not_the_program(frames: Frames, pipeline: Pipeline, motion: Motion) -> None:
    targets, actual, volts = run_of(motion)
    targets = targets.copy()
    targets[STANDING + 400, 0] += 1
    with pytest.raises(RunError, match=r"setpoint 400 on the bus .* \(1 differ\)"):
        replay(recorded(targets, actual, volts), "x", pipeline.image, pipeline.machine, "fixed")
    lost = np.delete(frames, 7 * 700 + 3)
    with pytest.raises(RunError, match="is incomplete"):
        replay(lost, "x", pipeline.image, pipeline.machine, "fixed")


@pytest.mark.parametrize("file_has", ["nothing", "no setpoints", "all but one"])
def test_missing_frames_are_no_jump(
    frames: Frames,
    pipeline: Pipeline,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    file_has: str,
) -> None:
    """Of a log, 30 ms are missing at full feed: all frames, the setpoints of a node, or one of them."""
    tick = STANDING + 500
    at = np.arange(frames.size)
    within = (at >= 7 * tick) & (at < 7 * (tick + 30))
    if file_has == "no setpoints":
        within &= frames["id"] == 0x202
    elif file_has == "all but one":
        within = at == np.flatnonzero(within & (frames["id"] == 0x202))[0]
    file = tmp_path / "alpha.log"
    write_recording(file, frames[~within])
    assert main(["replay", str(file), str(ALPHA)]) == 6
    err = capsys.readouterr().err
    assert "frames missing" in err
    assert "jump" not in err
    stamp = int(frames["time_us"][7 * (tick - (file_has == "nothing"))]) / 1e6
    assert f"at {stamp:.6f} s" in err


def test_a_jump_away_from_missing_frames_is_a_jump(motion: Motion, pipeline: Pipeline) -> None:
    targets, actual, volts = run_of(motion)
    targets = targets.copy()
    targets[STANDING + 400 :, 0] += 100_000
    frames = recorded(targets, actual, volts)
    lost = np.delete(frames, np.arange(7 * 800, 7 * 830))
    with pytest.raises(RunError, match=f"setpoint jump at SYNC {STANDING + 400} of the recording"):
        replay(lost, "x", pipeline.image, pipeline.machine, "fixed")


def test_where_the_program_is() -> None:
    setpoints = np.array([[0, 0], [0, 0], [1, 0], [1, 1], [3, 1]], dtype=np.int32)
    still = np.zeros((4, 2), dtype=np.int32)
    assert program_tick(np.concatenate([still, setpoints]), setpoints) == 4
    assert program_tick(np.concatenate([still, setpoints[:4]]), setpoints) is None
    away = np.array([[9, 9], [4, 4], [2, 2], [0, 0]], dtype=np.int32)
    assert program_tick(np.concatenate([away, still, setpoints]), setpoints) == 8
    assert program_tick(still, setpoints) is None


def test_runs_and_complete_ticks() -> None:
    assert runs_of(np.array([1, 1, 0, 1, 0, 0, 1], dtype=bool)) == [(0, 2), (3, 4), (6, 7)]
    assert runs_of(np.zeros(3, dtype=bool)) == []
    names = [0x202, 0x080, 0x202, 0x080, 0x202, 0x202, 0x080, 0x080, 0x202, 0x080]
    frames = np.concatenate([frame(name, b"\1") for name in names])
    sync_at = np.flatnonzero(frames["id"] == 0x080)
    assert complete_ticks(frames, sync_at, 0x202).tolist() == [True, False, False, True]


def test_volts_that_no_drive_reports_are_not_shown_as_zero(
    frames: Frames, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, trace = tmp_path / "alpha.log", tmp_path / "trace.csv"
    write_recording(file, frames[~np.isin(frames["id"], [0x280 + node for node in NODES])])
    assert main(["replay", str(file), str(ALPHA), "--json", "--trace", str(trace)]) == 0
    assert json.loads(capsys.readouterr().out)["max_volts"] is None
    header, *rows = trace.read_text().splitlines()
    assert header.endswith(",x_volts,y_volts")
    assert all(row.endswith(",nan,nan") for row in rows)
