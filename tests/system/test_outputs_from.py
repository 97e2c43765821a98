# SPDX-License-Identifier: MIT
"""Outputs after `start --from`: at the place of an event, and one count before and after it. Run by pytest; starts a
controller and drives on a local bus, and writes to temporary folders.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from bench import EXAMPLES, Bench, MakeBench
from hodograph.bus.analysis import REACHED_AFTER
from hodograph.bus.capture.decode import decode_outputs, decode_ticks
from hodograph.bus.capture.recorder import Recorder
from hodograph.bus.sdo.controller import READY
from hodograph.cli.main import main

MACHINE = EXAMPLES / "machines" / "dispenser.toml"
LENGTH_MM = 12.0
COUNT_MM = 1e-6
PATH = f"""
[path]
closed = false
through = [[0, 0], [4, 0], [12, 0]]

[feed]
nominal_mm_s = 60
ramp_time_s = 0.05
n_c = 5

[machine]
file = "{MACHINE}"
"""
NEEDLE, VALVE, LASER = 0b010, 0b001, 0b100
POWER = round(20 * 327.67)
EVENTS = (
    # place in mm, what the path file says of the output, and all outputs from there on
    (0.0, 'name = "needle"\non = true', (NEEDLE, 0)),
    (2.0, 'name = "valve"\non = true', (NEEDLE | VALVE, 0)),
    (5.0, 'name = "power"\nvalue = 20', (NEEDLE | VALVE, POWER)),
    (5.0, 'name = "valve"\non = false', (NEEDLE, POWER)),
    (LENGTH_MM, 'name = "laser"\non = true', (NEEDLE | LASER, POWER)),
)
CASES = [
    (place_mm, count)
    for place_mm in (0.0, 2.0, 5.0, LENGTH_MM)
    for count in (-1, 0, 1)
    if 0.0 <= place_mm + count * COUNT_MM <= LENGTH_MM
]


def outputs_at(place_mm: float) -> tuple[int, int]:
    """Digital outputs and the first analogue one, as the events at or before a place make them."""
    return [outputs for at_mm, _, outputs in EVENTS if at_mm <= place_mm][-1]


@dataclass(frozen=True)
class Recorded:
    """By setpoint: arc length in counts, and the outputs when the axes are there."""

    counts: NDArray[np.int32]
    outputs: list[tuple[int, int]]

    @property
    def on(self) -> int:
        """The first setpoint at which an output is on."""
        return next(k for k, outputs in enumerate(self.outputs) if outputs != (0, 0))


def path_file(folder: Path) -> Path:
    file = folder / "path.toml"
    tables = [f"\n[[output]]\nat_mm = {place_mm}\n{words}\n" for place_mm, words, _ in EVENTS]
    file.write_text(PATH + "".join(tables))
    return file


def run_from(bench: Bench, file: Path, place_mm: float) -> Recorded:
    """The path from this place on, to which the axes go first."""
    assert main(["goto", str(MACHINE), "--to", f"{place_mm:.6f}", "0"]) == 0
    assert main(["upload", str(file)]) == 0
    recorder = Recorder(bench.bus)
    bench.clock.sleep(0.02)
    assert main(["start", "--from", f"{place_mm:.6f}"]) == 0
    bench.controller.wait_for((READY,), 60.0)
    bench.clock.sleep(0.05)
    recorder.stop()
    frames = recorder.so_far()
    assert bench.machine.outputs is not None
    values = decode_outputs(frames, bench.machine.outputs)[REACHED_AFTER:]
    outputs = list(zip(values["digital"].tolist(), values["analogue"][:, 0].tolist(), strict=True))
    targets = decode_ticks(frames, bench.machine.nodes).targets
    assert not targets[:, 1].any()
    count = min(len(targets), len(outputs))
    return Recorded(targets[:count, 0], outputs[:count])


@pytest.mark.parametrize(("place_mm", "count"), CASES)
def test_each_setpoint_has_the_outputs_of_its_place(
    make_bench: MakeBench, tmp_path: Path, place_mm: float, count: int
) -> None:
    """All events at or before the place act at once, the others with the first setpoint at or past theirs."""
    bench = make_bench(file=MACHINE)
    start_mm = place_mm + count * COUNT_MM
    run = run_from(bench, path_file(tmp_path), start_mm)
    assert run.counts[0] == round(start_mm / COUNT_MM)
    assert run.counts[-1] == round(LENGTH_MM / COUNT_MM)
    assert run.outputs[: run.on] == [(0, 0)] * run.on
    assert not np.any(run.counts[: run.on + 1] != run.counts[0])
    # Counts are those of the end already where less than half of one is left.
    whole = run.on + int(np.argmax(run.counts[run.on :] == run.counts[-1]))
    expected = [outputs_at(counts * COUNT_MM) for counts in run.counts[run.on : whole].tolist()]
    assert run.outputs[run.on : whole] == expected
    assert run.outputs[-1] == outputs_at(LENGTH_MM)


@pytest.mark.parametrize("place", ["-0.001", "12.001", "9e9", "1e300"])
def test_a_place_that_the_path_does_not_have(
    make_bench: MakeBench, tmp_path: Path, capsys: pytest.CaptureFixture[str], place: str
) -> None:
    make_bench(file=MACHINE)
    assert main(["upload", str(path_file(tmp_path))]) == 0
    capsys.readouterr()
    assert main(["start", "--from", place]) == 2
    assert "the path has arc lengths from 0 to 12 mm" in capsys.readouterr().err
