# SPDX-License-Identifier: MIT
"""The plant from a recorded run with noise: within one per cent, and within the confidence intervals of the fit. Run by
pytest; writes to temporary folders.
"""

from __future__ import annotations

import json
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hodograph.bus.capture.recordings import write_recording
from hodograph.cli.main import main
from hodograph.config import Drive, load_machine
from hodograph.errors import RunError
from hodograph.identify import Plant, identify_axis, stretches

from .recorded import EXAMPLES, chain_of, drives_of, recording

SEEDS = range(6)
PER_CENT = 0.01


def with_friction(drive: Drive, volts: float) -> Drive:
    return replace(drive, equipment=replace(drive.equipment, friction_volts=volts))


def wrong(drive: Drive) -> Drive:
    """As the drive file has it before: plant far off, no friction, the loop right."""
    return replace(
        drive,
        gain_rad_s_v=1.4 * drive.gain_rad_s_v,
        time_constant_s=0.6 * drive.time_constant_s,
    )


def identified(
    name: str, machine: str, seed: int, friction: float = 0.0
) -> list[tuple[Drive, Plant]]:
    pipeline = chain_of(name, machine)
    given = drives_of(machine)
    truth = (with_friction(given[0], friction), with_friction(given[1], friction))
    frames = recording(pipeline, truth, seed)
    return [
        (real, identify_axis(stretches(frames, node), wrong(drive), 1_000_000, 1000))
        for node, drive, real in zip(pipeline.machine.nodes, given, truth, strict=True)
    ]


def test_gain_and_time_constant_within_a_per_cent_over_seeds() -> None:
    errors, claimed, noise_mv = [], [], []
    for seed in SEEDS:
        for drive, plant in identified("alpha", "paper_alpha", seed):
            assert plant.friction_volts is None
            for found, real in (
                (plant.gain_rad_s_v, drive.gain_rad_s_v),
                (plant.time_constant_s, drive.time_constant_s),
            ):
                errors.append(found.value / real - 1)
                claimed.append(found.within / real)
            noise_mv.append(plant.rms_mv)
    worst, within = np.max(np.abs(errors)), np.abs(errors) < np.array(claimed)
    assert 1e-5 < worst < PER_CENT
    assert worst < 0.005
    assert 0.85 <= np.mean(within) <= 1.0
    assert np.max(claimed) < 0.005
    assert np.mean(noise_mv) == pytest.approx(10.0, rel=0.05)


@pytest.mark.parametrize("friction", [0.05, 0.3])
def test_with_friction(friction: float) -> None:
    for drive, plant in identified("alpha", "paper_alpha", 1, friction):
        assert plant.friction_volts is not None
        assert plant.friction_volts.value == pytest.approx(friction, abs=0.004)
        assert 0 < plant.friction_volts.within < 0.01
        assert plant.gain_rad_s_v.value == pytest.approx(drive.gain_rad_s_v, rel=PER_CENT)
        assert plant.time_constant_s.value == pytest.approx(drive.time_constant_s, rel=PER_CENT)


def test_with_torque_offsets_and_cubics() -> None:
    for drive, plant in identified("alpha", "tuned", 0):
        assert plant.friction_volts is None
        assert plant.gain_rad_s_v.value == pytest.approx(drive.gain_rad_s_v, rel=0.005)
        assert plant.time_constant_s.value == pytest.approx(drive.time_constant_s, rel=0.005)
        # The stiff loop turns the encoder's increments into volts, which nothing foresees.
        assert 11 < plant.rms_mv < 14


def test_less_noise_is_a_narrower_interval() -> None:
    pipeline, drives = chain_of("alpha"), drives_of("paper_alpha")
    widths = []
    for noise in (1.0, 30.0):
        frames = recording(pipeline, drives, 1, noise_counts=2 * noise, noise_mv=noise)
        plant = identify_axis(stretches(frames, 2), wrong(drives[0]), 1_000_000, 1000)
        widths.append(plant.gain_rad_s_v.within)
    assert 5 * widths[0] < widths[1] < 100 * widths[0]


def test_a_loop_that_is_another_is_seen_in_what_is_left_over() -> None:
    pipeline, drives = chain_of("alpha"), drives_of("paper_alpha")
    frames = recording(pipeline, drives, 1)
    other = replace(drives[0], k_pp_rad_s_mm=0.5 * drives[0].k_pp_rad_s_mm)
    plant = identify_axis(stretches(frames, 2), other, 1_000_000, 1000)
    assert plant.rms_mv > 15
    assert plant.rms_um > 1


def test_only_motions_from_rest_of_a_drive_that_follows() -> None:
    pipeline, drives = chain_of("alpha"), drives_of("paper_alpha")
    frames = recording(pipeline, drives, 1)
    (motion,) = stretches(frames, 2)
    assert motion.inputs.start_counts == motion.inputs.targets[0]
    assert 1090 < len(motion.position_counts) <= 1102
    assert abs(motion.position_counts[0] - motion.inputs.start_counts) < 200
    with pytest.raises(RunError, match="begins at rest"):
        stretches(recording(pipeline, drives, 1, status=0x0233), 2)
    with pytest.raises(RunError, match="sends no volts"):
        stretches(frames[frames["id"] != 0x282], 2)
    syncs = np.flatnonzero(frames["id"] == 0x80)
    with pytest.raises(RunError, match="begins at rest"):
        stretches(frames[syncs[400] :], 2)


def test_the_command(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    pipeline, drives = chain_of("alpha"), drives_of("paper_alpha")
    file = tmp_path / "run.log"
    write_recording(file, recording(pipeline, drives, 3))
    machine = str(EXAMPLES / "machines" / "paper_alpha.toml")
    output = tmp_path / "found.toml"
    assert main(["identify", str(file), "--machine", machine, "-o", str(output)]) == 0
    out, _ = capsys.readouterr()
    text = out.replace(str(tmp_path), "").split("\n/")[0]
    sections = text.split("\n\n# axis ")
    periods = (1099, 1100)  # from an axis' first count to its last
    for name, count, section, drive in zip("xy", periods, sections, drives, strict=True):
        assert f"{name}: {count} periods" in section
        found = tomllib.loads(section[section.index("[plant]") :])["plant"]
        assert found["gain_rad_s_v"] == pytest.approx(drive.gain_rad_s_v, rel=0.005)
    written = load_machine(output)
    for drive, axis in zip(drives, written.path_axes, strict=True):
        assert axis.drive is not None
        assert axis.drive.k_pp_rad_s_mm == drive.k_pp_rad_s_mm
        assert axis.drive.gain_rad_s_v != drive.gain_rad_s_v
        assert axis.drive.gain_rad_s_v == pytest.approx(drive.gain_rad_s_v, rel=0.005)
    assert main(["identify", str(file), "--machine", machine, "-o", str(output)]) == 2
    assert "add --force" in capsys.readouterr().err
    assert main(["identify", str(file), "--machine", machine, "--json"]) == 0
    axes = json.loads(capsys.readouterr().out)["axes"]
    assert [axis["name"] for axis in axes] == ["x", "y"]
    assert 0 < axes[0]["gain_rad_s_v"]["within"] < 1


def test_a_recording_without_a_run(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    pipeline, drives = chain_of("alpha"), drives_of("paper_alpha")
    frames = recording(pipeline, drives, 3)
    file = tmp_path / "rest.log"
    write_recording(file, frames[: np.flatnonzero(frames["id"] == 0x80)[290]])
    machine = str(EXAMPLES / "machines" / "paper_alpha.toml")
    assert main(["identify", str(file), "--machine", machine]) == 6
    err = capsys.readouterr().err
    assert "axis x: node 2 follows no motion" in err
    assert "no axis can be identified" in err


def test_each_axis_has_its_own_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of rotary axes, counts of a degree."""
    file, scales = tmp_path / "any.log", list[int]()
    write_recording(file, recording(chain_of("alpha"), drives_of("paper_alpha"), 3))

    def scale(_motions: object, _drive: Drive, counts_per_unit: int, _period_us: int) -> Plant:
        scales.append(counts_per_unit)
        raise RunError("not needed here")

    monkeypatch.setattr("hodograph.identify.stretches", lambda *_: [])
    monkeypatch.setattr("hodograph.identify.identify_axis", scale)
    machine = str(EXAMPLES / "machines" / "mill_five_axes.toml")
    assert main(["identify", str(file), "--machine", machine]) == 6
    assert scales == [1_000_000] * 3 + [100_000] * 2
