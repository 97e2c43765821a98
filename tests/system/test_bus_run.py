# SPDX-License-Identifier: MIT
"""`hodograph run` on a bus: the same bits as `hodograph simulate`, and the same frames at every run. Run by pytest;
starts a controller and drives on a local bus, and writes to temporary folders.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from commands import result
from hodograph.bus.capture.recorder import Frames, Recorder
from hodograph.bus.hub import LocalHub
from hodograph.cli.main import main
from runs import SIMULATE_ONLY, same_motion

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
RUN_ONLY = {"bus", "deadline_misses", "pace", "frames", "bus_load", "unhomed_starts"}


@pytest.mark.parametrize(
    ("name", "kernel"), [("alpha", "fixed"), ("heart", "float"), ("star", "double")]
)
def test_run_equals_simulate(
    hub: LocalHub, capsys: pytest.CaptureFixture[str], tmp_path: Path, name: str, kernel: str
) -> None:
    file = str(EXAMPLES / f"{name}.toml")
    traces = [tmp_path / "simulated.csv", tmp_path / "recorded.csv"]
    common = (file, "--json", "--kernel", kernel, "--trace")
    simulated = result(capsys, "simulate", *common, str(traces[0]))
    recorded = result(capsys, "run", *common, str(traces[1]))
    assert set(recorded) == (set(simulated) - SIMULATE_ONLY) | RUN_ONLY
    assert same_motion(recorded, simulated)
    assert recorded["pace"] == "real-time"
    assert recorded["bus"] == str(hub.address)
    assert recorded["deadline_misses"] == 0
    assert recorded["frames"] > 5 * recorded["ticks"]
    assert traces[0].read_text() == traces[1].read_text()


@pytest.mark.usefixtures("hub")
def test_two_files_and_a_report(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    files = [str(EXAMPLES / f"{name}.toml") for name in ("alpha", "heart")]
    found = result(capsys, "run", *files, "--json", "--report", str(tmp_path / "report"))
    assert [run["file"] for run in found] == files
    for run, file in zip(found, files, strict=True):
        simulated = result(capsys, "simulate", file, "--json")
        assert run["encoders_sha256"] == simulated["encoders_sha256"]
    html = (tmp_path / "report" / "report.html").read_text()
    assert "recorded on the bus" in html
    assert "Bus load" in html
    assert html.count("figure of the search: as for alpha") == 1
    assert not (tmp_path / "report" / "heart_search.png").exists()
    assert found[0]["encoders_sha256"] in html


@pytest.mark.usefixtures("hub")
def test_the_optimal_feed_and_the_plant_from_its_recording(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """Pieces of any length, axes at their limits: the same bits, no setpoint that jumps, and enough motion to fit."""
    file, recording = str(EXAMPLES / "alpha_optimal.toml"), str(tmp_path / "run.log")
    simulated = result(capsys, "simulate", file, "--json")
    recorded = result(capsys, "run", file, "--json", "--record", recording)
    assert same_motion(recorded, simulated)
    assert simulated["ticks"] < 800
    assert 3.0 < simulated["max_volts"] < 4.5
    machine = str(EXAMPLES / "machines" / "paper_alpha.toml")
    axes = result(capsys, "identify", recording, "--machine", machine, "--json")["axes"]
    for axis, gain, time_s in zip(axes, (83.0089, 50.4977), (0.19936, 0.15641), strict=True):
        assert axis["gain_rad_s_v"]["value"] == pytest.approx(gain, rel=0.01)
        assert axis["time_constant_s"]["value"] == pytest.approx(time_s, rel=0.01)


def recorded_run(file: str) -> Frames:
    """All frames of a bus on which a machine is started, brought up, runs a path and ends."""
    with LocalHub() as hub, Recorder(hub.address) as recorder:
        assert main(["run", file, "--bus", str(hub.address)]) == 0
        return recorder.so_far()


@pytest.mark.usefixtures("one_core")
def test_two_runs_give_the_same_frames_at_the_same_times() -> None:
    first, second = (recorded_run(str(EXAMPLES / "alpha.toml")) for _ in range(2))
    assert first.size > 10_000
    assert first.dtype == second.dtype
    assert first.tobytes() == second.tobytes()
